// SPDX-License-Identifier: Apache-2.0
// Table, page and picture of the guide study.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "host_sim/lab/studies/planning/guide_study.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/report/quantile.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kGuideColours[] = {kPointColour, kRegionColour, kLitColour, kForceColour,
                                         kTorqueColour};

double median(const StudyCell& cell, double InsertionRun::*figure) {
  return quantile(cell.sorted(figure), 0.5);
}

ReportTable table_of(const std::vector<StudyCell>& cells) {
  ReportTable table(
      "hand,guide,runs,inserted_percent,median_s,p90_s,median_peak_n,p95_peak_n,median_hand_mj,"
      "largest_guide_mj,stated_mj");
  for (const StudyCell& c : cells) {
    const std::vector<double> times = c.sorted(&InsertionRun::time_s),
                              peaks = c.sorted(&InsertionRun::peak_n);
    const bool led = c.sorted(&InsertionRun::stated_j).front() > 0;
    table.add({c.hand, c.guide, c.runs.size(), shown_as("%.1f", 100 * c.inserted_share()),
               shown_as("%.2f", quantile(times, 0.5)), shown_as("%.2f", quantile(times, 0.9)),
               shown_as("%.2f", quantile(peaks, 0.5)), shown_as("%.2f", quantile(peaks, 0.95)),
               shown_as("%.1f", 1e3 * median(c, &InsertionRun::hand_j)),
               led ? shown_as("%.1f", 1e3 * c.sorted(&InsertionRun::guide_j).back()) : Cell{},
               led ? shown_as("%.1f", 1e3 * c.sorted(&InsertionRun::stated_j).front()) : Cell{}});
  }
  return table;
}

ReportTable runs_of(const std::vector<StudyCell>& cells) {
  ReportTable table("hand,guide,run,inserted,time_s,peak_n,hand_j,guide_j,stated_j");
  for (const StudyCell& c : cells) {
    for (std::size_t k = 0; k < c.runs.size(); ++k) {
      const InsertionRun& r = c.runs[k];
      table.add({c.hand, c.guide, k, yes_or_no(r.inserted), shown_as("%.3f", r.time_s),
                 shown_as("%.5g", r.peak_n), shown_as("%.5g", r.hand_j),
                 shown_as("%.5g", r.guide_j), shown_as("%.5g", r.stated_j)});
    }
  }
  return table;
}

/// Share of the runs that were in by each time.
std::vector<double> shares_by(const StudyCell& cell, const std::vector<double>& times) {
  std::vector<double> ends;
  for (const InsertionRun& run : cell.runs) {
    if (run.inserted) ends.push_back(run.time_s);
  }
  std::ranges::sort(ends);
  std::vector<double> shares;
  for (const double t : times) {
    const auto in = std::ranges::upper_bound(ends, t) - ends.begin();
    shares.push_back(100 * static_cast<double>(in) / static_cast<double>(cell.runs.size()));
  }
  return shares;
}

std::string table_picture(const std::vector<StudyCell>& cells, double top) {
  constexpr const char* kHeads[] = {
      "hand",    "guide",       "in, %",           "median, s",        "p90, s",
      "peak, N", "p95 peak, N", "hand's work, mJ", "guide's most, mJ", "stated, mJ"};
  constexpr double kRow = 22, kFirst = 70, kSecond = 150, kNumbers = 330, kColumn = 112;
  const auto x_of = [&](std::size_t k) {
    return k == 0 ? kFirst : k == 1 ? kSecond : kNumbers + kColumn * static_cast<double>(k - 2);
  };
  const auto anchor_of = [](std::size_t k) { return k < 2 ? "start" : "end"; };
  std::string svg;
  for (std::size_t k = 0; k < std::size(kHeads); ++k)
    svg += text_at(x_of(k), top, kHeads[k], anchor_of(k), 13);
  double y = top;
  for (const StudyCell& c : cells) {
    const std::vector<double> times = c.sorted(&InsertionRun::time_s),
                              peaks = c.sorted(&InsertionRun::peak_n);
    const double stated_j = c.sorted(&InsertionRun::stated_j).front();
    const auto of_guide = [&](double j) { return stated_j > 0 ? fixed(1e3 * j, 1) : "-"; };
    const std::string words[] = {c.hand,
                                 c.guide,
                                 fixed(100 * c.inserted_share(), 1),
                                 fixed(quantile(times, 0.5), 2),
                                 fixed(quantile(times, 0.9), 2),
                                 fixed(quantile(peaks, 0.5), 2),
                                 fixed(quantile(peaks, 0.95), 2),
                                 fixed(1e3 * median(c, &InsertionRun::hand_j), 1),
                                 of_guide(c.sorted(&InsertionRun::guide_j).back()),
                                 of_guide(stated_j)};
    y += kRow;
    for (std::size_t k = 0; k < std::size(words); ++k)
      svg += text_at(x_of(k), y, words[k], anchor_of(k), 13);
  }
  return svg;
}

std::string picture(const GuideStudyBench& bench, const std::vector<StudyCell>& cells) {
  constexpr double kWide = 320, kHigh = 240, kApart = 390, kTop = 70;
  std::vector<double> times;
  for (double t = 0; t <= bench.task.limit_s + 1e-9; t += 0.05) times.push_back(t);
  std::string svg =
      heading_at(70, 28, "Peg into its hole: share of the runs that are in by a time");
  std::vector<std::string> hands;
  for (const StudyCell& c : cells) {
    if (hands.empty() || hands.back() != c.hand) hands.push_back(c.hand);
  }
  for (std::size_t h = 0; h < hands.size(); ++h) {
    const Panel panel{
        78 + kApart * static_cast<double>(h), kTop, kWide, kHigh, 0, bench.task.limit_s, 0, 102};
    svg += panel_frame(panel, h == 0 ? "in (%)" : " ", true);
    svg += text_at(panel.left + kWide / 2, kTop - 10, hands[h] + " hand", "middle", 13);
    svg += text_at(panel.left + kWide, kTop + kHigh + 32, "time (s)", "end", 12);
    std::size_t guide = 0;
    for (const StudyCell& c : cells) {
      if (c.hand != hands[h]) continue;
      svg += curve(panel, times, shares_by(c, times),
                   kGuideColours[guide % std::size(kGuideColours)], 1.8);
      ++guide;
    }
  }
  for (std::size_t g = 0; g < bench.guides.size(); ++g) {
    svg += legend_entry(70 + 180 * static_cast<double>(g), kTop + kHigh + 62,
                        kGuideColours[g % std::size(kGuideColours)], bench.guides[g].name);
  }
  const double below = kTop + kHigh + 100;
  svg += table_picture(cells, below);
  return svg_document(70 + kApart * static_cast<double>(hands.size()),
                      below + 22 * static_cast<double>(cells.size() + 2), svg);
}

std::string page(const GuideStudyBench& bench, const std::vector<StudyCell>& cells,
                 const GuideStudyOptions& options) {
  const StudyVerdict verdict = verdict_of(cells);
  const InsertionTask& task = bench.task;
  return "# Guides at a peg\n\nA square peg of 20 mm with " +
         short_number(options.clearance_mm, 3) + " mm of clearance per side, " +
         short_number(1e3 * task.depth_m, 3) + " mm deep into its hole. A hand aims up to " +
         short_number(1e3 * task.aside_m, 3) + " mm beside the hole and up to " +
         short_number(task.askew_rad, 3) + " rad askew, trembles by up to " +
         short_number(1e3 * task.tremor_m, 3) + " mm and " + short_number(task.tremor_rad, 3) +
         " rad at 8 to 12 Hz, presses down with 1 N, gives way to what it feels within half a "
         "second, "
         "and searches in a spiral where it gets no deeper for 0.4 s. Run k of every cell has the "
         "same hand; a run ends when the peg is in or after " +
         short_number(task.limit_s, 3) +
         " s, which then is its time. `plan` is the guide of `[guide]` with its defaults, over " +
         std::to_string(options.plans) +
         " plans; `harmonic` leads down a harmonic function along a channel in C-space, by "
         "translations alone from where the hand begins, upright; `other start` is a plan to the "
         "same goal that begins 16 mm aside, upright; `other hole` one whose hole lies 3 mm aside. "
         "Peak: largest contact force, median and p95 of the runs. The hand's work is "
         "the median, the guide's the most of any run at any time.\n\n" +
         picture_line("guide_study.svg", "Share of runs that are in by a time, and the table") +
         "\n" + table_of(cells).markdown() + "\n" + table_head({"must hold", "holds"}) +
         table_row({"every run is finite and slower than 10 m/s", yes_or_no(verdict.sound)}) +
         table_row({"no guide does more than its scene states", yes_or_no(verdict.within_energy)}) +
         table_row({"with the right guide no hand puts in fewer", yes_or_no(verdict.helps)}) +
         table_row({"nor takes longer (median, p90)", yes_or_no(verdict.as_fast)}) +
         table_row(
             {"nor presses harder (median and p95 of the peaks)", yes_or_no(verdict.as_gentle)});
}

}  // namespace

std::vector<OutputText> guide_study_files(const GuideStudyBench& bench,
                                          const std::vector<StudyCell>& cells,
                                          const GuideStudyOptions& options) {
  const ReportTable table = table_of(cells);
  const nlohmann::ordered_json json{
      {"runs", options.runs},          {"plans", options.plans},
      {"seed", options.seed},          {"clearance_mm", options.clearance_mm},
      {"limit_s", bench.task.limit_s}, {"passed", verdict_of(cells).passed()},
      {"cells", table.json()}};
  return {{"guide_study.csv", table.csv()},
          {"guide_study.json", json.dump(1) + "\n"},
          {"guide_study_runs.csv", runs_of(cells).csv()},
          {"guide_study.svg", picture(bench, cells)},
          {"guide_study.md", page(bench, cells, options)}};
}

}  // namespace haptic::sim
