// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/delay_report.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "host_sim/report/picture.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/report/report_table.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kBins = 60;
constexpr double kShownPeriods = 3;  ///< later ones are in the last bin
constexpr double kWidth = 1200, kLeft = 90, kPanelWidth = 500, kGap = 90, kPanelHeight = 230;
constexpr std::array<const char*, 2> kColours = {"#0072b2", "#d55e00"};
constexpr std::array<const char*, kDelayStages> kStageColours = {"#56b4e9", "#e69f00", "#009e73",
                                                                 "#cc79a7", "#0072b2"};

std::vector<std::int64_t> column(const std::vector<DelayTimes>& times, DelayStage stage) {
  std::vector<std::int64_t> out;
  for (const DelayTimes& t : times) out.push_back(t[static_cast<std::size_t>(stage)]);
  return out;
}

std::vector<DelayTimes> exact_times(const DelayOfMode& mode) {
  std::vector<DelayTimes> out;
  for (const VirtualDelay& d : mode.exact) out.push_back(d.at_ns);
  return out;
}

DelayFigures figures_of(std::vector<std::int64_t> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  return {values.front(), quantile(values, 0.5), quantile(values, 0.99), values.back()};
}

/// Share of all per bin of kShownPeriods.
std::array<double, kBins> histogram(const std::vector<std::int64_t>& values, double period_ns) {
  std::array<double, kBins> bins{};
  for (const std::int64_t value : values) {
    const double at = static_cast<double>(value) / (kShownPeriods * period_ns) * kBins;
    bins[static_cast<std::size_t>(std::clamp(at, 0.0, kBins - 1.0))] +=
        1.0 / static_cast<double>(values.size());
  }
  return bins;
}

std::string csv_of(const std::vector<DelayOfMode>& modes) {
  ReportTable table("time,mode,phase,report_us,tick_us,command_us,handed_us,acts_us");
  const auto add = [&table](const char* time, const DelayOfMode& mode, const std::string& phase,
                            const DelayTimes& at_ns) {
    std::vector<Cell> row{time, name_of(mode), phase};
    for (const std::int64_t ns : at_ns) row.emplace_back(fixed(1e-3 * static_cast<double>(ns), 3));
    table.add(std::move(row));
  };
  for (const DelayOfMode& mode : modes) {
    for (const VirtualDelay& d : mode.exact) add("virtual", mode, fixed(d.phase, 4), d.at_ns);
    for (const DelayTimes& t : mode.measured.at_ns) add("real", mode, "", t);
  }
  return table.csv();
}

Json json_of(const DelayFigures& f) {
  const auto us = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
  return {{"min_us", us(f.least_ns)},
          {"median_us", us(f.median_ns)},
          {"p99_us", us(f.p99_ns)},
          {"max_us", us(f.largest_ns)}};
}

std::string account(const std::string& scene, const DelayQuestion& question,
                    const std::vector<DelayOfMode>& modes) {
  Json json;
  json["scene"] = scene;
  json["rate_hz"] = question.rate_hz;
  const double period_ns = 1e9 / question.rate_hz;
  for (const DelayOfMode& mode : modes) {
    Json entry;
    entry["mode"] = name_of(mode);
    entry["reports"] = mode.measured.reports;
    entry["answered"] = mode.measured.at_ns.size();
    entry["contact_ticks"] = mode.measured.contact_ticks;
    entry["fifo"] = mode.measured.grants.fifo();
    for (std::size_t k = 0; k < kDelayStages; ++k) {
      const auto stage = static_cast<DelayStage>(k);
      entry["virtual"][to_text(stage)] = json_of(exact_figures(mode, stage));
      entry["real"][to_text(stage)] = json_of(measured_figures(mode, stage));
    }
    entry["histogram"] = {
        {"bin_us", 1e-3 * kShownPeriods * period_ns / kBins},
        {"virtual", histogram(column(exact_times(mode), DelayStage::kActs), period_ns)},
        {"real", histogram(column(mode.measured.at_ns, DelayStage::kActs), period_ns)}};
    json["modes"].push_back(entry);
  }
  return json.dump(2) + "\n";
}

std::string shaded(double x, double y, double width, double height, const char* colour) {
  return rectangle_at({x, y}, width, height, colour, "fill-opacity=\"0.6\"");
}

std::string histogram_panel(double left, const std::vector<DelayOfMode>& modes, double period_ns,
                            bool exact) {
  const double shown_ms = 1e-6 * kShownPeriods * period_ns;
  const Panel panel{left, 90, kPanelWidth, kPanelHeight, 0, shown_ms, 0, 100};
  std::string svg = panel_frame(panel, "% of the reports", true);
  svg +=
      text_at(left + kPanelWidth, 90 + kPanelHeight + 32, "time after the sample (ms)", "end", 12);
  svg += text_at(
      left, 80,
      exact ? "virtual time: exact, over all phases of the timer" : "real time: this machine",
      "start", 14, "font-weight=\"bold\"");
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const auto bins = histogram(exact ? column(exact_times(modes[m]), DelayStage::kActs)
                                      : column(modes[m].measured.at_ns, DelayStage::kActs),
                                period_ns);
    const double width = kPanelWidth / static_cast<double>(kBins);
    for (std::size_t k = 0; k < kBins; ++k) {
      const double top = panel.y_of(100 * bins[k]);
      if (bins[k] > 0)
        svg += shaded(left + width * static_cast<double>(k), top, width,
                      panel.top + panel.height - top, kColours[m]);
    }
    svg += shaded(left + 330, 104 + 22 * static_cast<double>(m), 14, 12, kColours[m]);
    svg += text_at(left + 350, 114 + 22 * static_cast<double>(m), name_of(modes[m]), "start", 13);
  }
  return svg;
}

/// The medians of the stages, one after the other.
std::string stage_bars(double top, const std::vector<DelayOfMode>& modes, double period_ns) {
  const Panel panel{kLeft + 110, top, 2 * kPanelWidth + kGap - 110, 150, 0, 1e-6 * 1.5 * period_ns,
                    0,           1};
  std::string svg = text_at(kLeft, top - 12, "medians of the stages (ms after the sample)", "start",
                            14, "font-weight=\"bold\"");
  double y = top + 10;
  for (const DelayOfMode& mode : modes) {
    for (const bool exact : {true, false}) {
      double from = 0;
      for (std::size_t k = 0; k < kDelayStages; ++k) {
        const auto stage = static_cast<DelayStage>(k);
        const DelayFigures f = exact ? exact_figures(mode, stage) : measured_figures(mode, stage);
        const double to = 1e-6 * static_cast<double>(f.median_ns);
        if (to > from)
          svg +=
              shaded(panel.x_of(from), y, panel.x_of(to) - panel.x_of(from), 22, kStageColours[k]);
        from = std::max(from, to);
      }
      svg += text_at(
          panel.left - 8, y + 16,
          std::string(mode.report_clocked ? "report" : "timer") + (exact ? ", exact" : ", real"),
          "end", 13);
      svg += text_at(panel.x_of(from) + 6, y + 16, fixed(from, 3), "start", 12);
      y += 34;
    }
  }
  for (const double mark : nice_marks(panel.t_low, panel.t_high, 8)) {
    svg += text_at(panel.x_of(mark), top + 160, mark_label(mark, 0.1), "middle", 12);
    svg += shaded(panel.x_of(mark), top, 0.6, 146, "#808080");
  }
  double x = panel.left;
  for (std::size_t k = 0; k < kDelayStages; ++k) {
    svg += shaded(x, top + 176, 14, 12, kStageColours[k]);
    svg += text_at(x + 20, top + 187, to_text(static_cast<DelayStage>(k)), "start", 13);
    x += 190;
  }
  return svg;
}

std::string picture(const DelayQuestion& question, const std::vector<DelayOfMode>& modes) {
  const double period_ns = 1e9 / question.rate_hz, height = 600;
  std::string svg =
      heading_at(kLeft, 32, "From the sample of a motion to the force that answers it (ms)");
  svg += text_at(kLeft, 54, "reports and servo loop at " + fixed(question.rate_hz, 0) + " Hz",
                 "start", 13);
  svg += histogram_panel(kLeft, modes, period_ns, true);
  svg += histogram_panel(kLeft + kPanelWidth + kGap, modes, period_ns, false);
  return svg_document(kWidth, height, svg + stage_bars(400, modes, period_ns));
}

}  // namespace

const char* name_of(const DelayOfMode& mode) {
  return mode.report_clocked ? "report-clocked" : "timer-clocked";
}

DelayFigures exact_figures(const DelayOfMode& mode, DelayStage stage) {
  return figures_of(column(exact_times(mode), stage));
}

DelayFigures measured_figures(const DelayOfMode& mode, DelayStage stage) {
  return figures_of(column(mode.measured.at_ns, stage));
}

std::vector<OutputText> delay_files(const std::string& scene, const DelayQuestion& question,
                                    const std::vector<DelayOfMode>& modes) {
  return {{"delay.csv", csv_of(modes)},
          {"delay.json", account(scene, question, modes)},
          {"delay.svg", picture(question, modes)}};
}

}  // namespace haptic::sim
