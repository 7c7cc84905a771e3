// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/continuity/continuity_report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

/// The runs of one law, a row each.
void add_rows(ReportTable& table, const ContactPath& path, std::span<const PathRun> runs) {
  for (std::size_t k = 0; k < runs.size(); ++k)
    table.add({path.name, law_name(runs[k].law), runs[k].steps, runs[k].largest_torque_step_nm,
               runs[k].largest_force_step_n, ratio_to_previous(runs, k)});
}

constexpr const char* kColumns =
    "path,law,steps,largest_torque_step_nm,largest_force_step_n,ratio_to_previous";

nlohmann::ordered_json to_json(const ContactPath& path, std::span<const PathRun> runs) {
  ReportTable table(kColumns);
  add_rows(table, path, runs);
  return table.json({"path", "law"});
}

/// "82 / 82 / 82": the runs of one law.
std::string steps_text(std::span<const PathRun> runs) {
  std::string text;
  for (const PathRun& run : runs)
    text += (text.empty() ? "" : " / ") + short_number(1e3 * run.largest_torque_step_nm, 3);
  return text;
}

std::string counts_text(std::span<const PathRun> runs) {
  std::string text;
  for (const PathRun& run : runs) text += (text.empty() ? "" : " / ") + std::to_string(run.steps);
  return text;
}

/// Least ratio among those that decide; "-" where nothing moves.
std::string deciding_ratio(std::span<const PathRun> runs, std::uint32_t fine_steps) {
  double least = 0;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    const double ratio = ratio_to_previous(runs, k);
    if (runs[k].steps >= fine_steps && ratio > 0)
      least = least > 0 ? std::min(least, ratio) : ratio;
  }
  return least > 0 ? fixed(least, 2) : "-";
}

// Pictures of the continuity measurement.

constexpr const char* kPaperColour = "#d55e00";
constexpr const char* kWeightedColour = "#0072b2";

/// Half the range of the parameter that a close-up shows.
constexpr double kCloseUp = 0.02;

void draw_key(SvgPage& page, double x, double y) {
  page.raw(legend_entry(x, y - 4, kPaperColour, "paper, eqs. (1)-(6)", 2.0));
  page.raw(legend_entry(x + 180, y - 4, kWeightedColour, "weighted region", 2.0));
}

/// Torque of the run at each pose, in mN m: its component along `axis`, or its length where that is
/// zero.
std::vector<double> torque_curve(const PathRun& run, const Vector& axis) {
  std::vector<double> values;
  for (const Vector& torque : run.torque_w)
    values.push_back(1e3 * (axis.isZero() ? torque.norm() : axis.dot(torque)));
  return values;
}

/// Both runs within the panel's range of the parameter, on an axis that fits both.
void draw_torques(SvgPage& page, Panel panel, const PathResult& result, const Vector& axis,
                  const std::string& label) {
  const PathRun* const runs[2] = {&result.paper.back(), &result.weighted.back()};
  const char* const colours[2] = {kPaperColour, kWeightedColour};
  std::vector<double> parameter[2], values[2];
  double low = 0, high = 0;
  for (std::size_t r = 0; r < 2; ++r) {
    const std::vector<double> all = torque_curve(*runs[r], axis);
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double s = runs[r]->parameter[k];
      if (s < panel.t_low || s > panel.t_high) continue;
      parameter[r].push_back(s);
      values[r].push_back(all[k]);
      low = std::min(low, all[k]);
      high = std::max(high, all[k]);
    }
  }
  const double margin = high - low > 1e-6 ? 0.06 * (high - low) : 0.5;
  panel.low = low - margin;
  panel.high = high + margin;
  page.raw(panel_frame(panel, label, true));
  for (std::size_t r = 0; r < 2; ++r)
    page.raw(curve(panel, parameter[r], values[r], colours[r], 1.8));
}

std::string short_power(double exponent) {
  constexpr const char* kPowers[] = {"0.001", "0.01", "0.1", "1", "10", "100"};
  return kPowers[std::clamp(std::lround(exponent) + 3, 0L, 5L)];
}

/// Powers of ten from 10^low to 10^high, by exponent.
void draw_decades(SvgPage& page, const Panel& panel) {
  for (double e = std::ceil(panel.low); e <= panel.high; e += 1) {
    const double y = panel.y_of(e);
    page.line({panel.left, y}, {panel.left + panel.width, y}, "#e4e4e4", 1);
    page.text(panel.left - 6, y + 4, short_power(e), "end", 12);
  }
}

/// Place on the axis in mN m, drawn at the edge where it lies outside.
double log_of(double torque_step_nm, const Panel& panel) {
  return std::clamp(std::log10(std::max(1e3 * torque_step_nm, 1e-12)), panel.low, panel.high);
}

void draw_slope(SvgPage& page, const Panel& panel, std::span<const PathRun> runs,
                const char* colour) {
  Pixel last;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Pixel at{panel.x_of(std::log10(runs[k].steps)),
                   panel.y_of(log_of(runs[k].largest_torque_step_nm, panel))};
    if (k > 0) page.line(last, at, colour, 2.0);
    page.dot(at, 3.5, colour);
    last = at;
  }
}

}  // namespace

PathRun run_path(const ContactPath& path, LawId law, std::uint32_t steps) {
  const std::vector<std::byte> scene =
      scene_of(path.a, {&path.b, 1}, kPathStiffness_n_per_m, kPathEpsilon_m, law);
  CoreSession session(scene, path.name);
  PathRun run;
  run.law = law;
  run.steps = steps;
  Vector last_force = Vector::Zero(), last_torque = Vector::Zero();
  for (std::uint32_t k = 0; k <= steps; ++k) {
    const double s = static_cast<double>(k) / steps;
    const PathPose pose = path.pose(s);
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose_at(pose.p, pose.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk)
      throw tools::InputError(path.name + ": a pose is refused: " + to_text(result.status));
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.largest_force_step_n = std::max(run.largest_force_step_n, (force - last_force).norm());
      const double torque_step_nm = (torque - last_torque).norm();
      if (torque_step_nm > run.largest_torque_step_nm) {
        run.largest_torque_step_nm = torque_step_nm;
        run.largest_torque_step_at = s;
        run.largest_torque_step_w = torque - last_torque;
      }
    }
    last_force = force;
    last_torque = torque;
    run.parameter.push_back(s);
    run.torque_w.push_back(torque);
  }
  return run;
}

std::vector<PathResult> run_paths(bool quick) {
  std::vector<PathResult> results;
  for (const ContactPath& path : contact_paths()) {
    std::vector<std::uint32_t> steps = {250, 1000, 4000, 16000};
    if (quick) steps = {path.fine_steps / 4, path.fine_steps};
    PathResult result{path, {}, {}};
    for (const std::uint32_t count : steps) {
      result.paper.push_back(run_path(path, LawId::kPaper, count));
      result.weighted.push_back(run_path(path, LawId::kWeightedRegion, count));
    }
    results.push_back(std::move(result));
  }
  return results;
}

double ratio_to_previous(std::span<const PathRun> runs, std::size_t k) {
  if (k == 0 || runs[k].largest_torque_step_nm < kStillTorque_nm) return 0;
  return runs[k - 1].largest_torque_step_nm / runs[k].largest_torque_step_nm;
}

bool settles(std::span<const PathRun> runs, std::uint32_t fine_steps) {
  bool looked = false, settled = true;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (runs[k].steps < fine_steps) continue;
    looked = true;
    settled = settled && (runs[k].largest_torque_step_nm < kStillTorque_nm ||
                          ratio_to_previous(runs, k) >= kLeastRatio);
  }
  return looked && settled;
}

std::string continuity_csv(std::span<const PathResult> results) {
  ReportTable table(kColumns);
  for (const PathResult& result : results) {
    add_rows(table, result.path, result.paper);
    add_rows(table, result.path, result.weighted);
  }
  return table.csv();
}

std::string continuity_json(std::span<const PathResult> results) {
  nlohmann::ordered_json json;
  json["stiffness_n_per_m"] = kPathStiffness_n_per_m;
  json["depth_m"] = kPathDepth_m;
  json["epsilon_m"] = kPathEpsilon_m;
  json["least_ratio"] = kLeastRatio;
  json["still_torque_nm"] = kStillTorque_nm;
  json["passed"] = continuous(results);
  for (const PathResult& result : results) {
    nlohmann::ordered_json path;
    path["name"] = result.path.name;
    path["title"] = result.path.title;
    path["fine_steps"] = result.path.fine_steps;
    path["weighted_region_settles"] = settles(result.weighted, result.path.fine_steps);
    path["paper_settles"] = settles(result.paper, result.path.fine_steps);
    path["paper"] = to_json(result.path, result.paper);
    path["weighted_region"] = to_json(result.path, result.weighted);
    json["paths"].push_back(path);
  }
  return json.dump(2) + "\n";
}

std::string continuity_page(std::span<const PathResult> results) {
  std::string page =
      "# Continuity of the contact laws\n\n"
      "Made by `host_sim continuity --out DIR`: the core runs over six smooth paths, cubes of "
      "0.1 m, k_F 1000 N/m, depth 1 mm (1 N on one face; up to 1.7 mm on the last path), epsilon = "
      "epsilon_o = 0.5 mm. Each path is cut into equal steps, coarse to fine. Largest change of "
      "the torque per step, mN m; a law without jumps brings it down by four when the steps are "
      "four times smaller, a jump stays. The least ratio from the fine steps on decides; a law "
      "settles when it is " +
      fixed(kLeastRatio, 0) + " or more, or when nothing moves.\n\n" +
      table_head({"path", "steps", "paper", "weighted region", "fine from", "ratio, paper",
                  "ratio, weighted", "weighted settles"});
  for (const PathResult& r : results) {
    page += table_row({r.path.title, counts_text(r.weighted), steps_text(r.paper),
                       steps_text(r.weighted), std::to_string(r.path.fine_steps),
                       deciding_ratio(r.paper, r.path.fine_steps),
                       deciding_ratio(r.weighted, r.path.fine_steps),
                       yes_or_no(settles(r.weighted, r.path.fine_steps))});
  }
  page +=
      "\nA contact comes and goes while its depth differs from D_near by less than epsilon. The "
      "general motion turns so fast that 4000 steps give that only a few steps, so there 4000 "
      "against 16000 decides.\n\n" +
      picture_line("continuity.svg", "Largest torque step over the number of steps");
  for (const PathResult& r : results) {
    page += "\n## " + r.path.name + ": " + r.path.title + "\n\n" +
            picture_line(r.path.name + ".svg", "Torque over the path");
  }
  return page;
}

std::vector<OutputText> continuity_files(std::span<const PathResult> results) {
  std::vector<OutputText> files = {{"continuity.csv", continuity_csv(results)},
                                   {"continuity.json", continuity_json(results)},
                                   {"continuity.svg", step_picture(results)},
                                   {"README.md", continuity_page(results)}};
  for (const PathResult& result : results)
    files.push_back({result.path.name + ".svg", torque_picture(result)});
  return files;
}

bool continuous(std::span<const PathResult> results) {
  return !results.empty() && std::all_of(results.begin(), results.end(), [](const PathResult& r) {
    return settles(r.weighted, r.path.fine_steps);
  });
}

std::string torque_picture(const PathResult& result) {
  SvgPage page(900, 720, result.path.name + ": " + result.path.title);
  const PathRun& paper = result.paper.back();
  const double at = std::clamp(paper.largest_torque_step_at, kCloseUp, 1 - kCloseUp);
  draw_torques(page, {90, 60, 780, 250, 0, 1, 0, 0}, result, Vector::Zero(), "|torque| (mN m)");
  page.text(870, 346, "path parameter", "end", 13);
  if (paper.largest_torque_step_nm >= kStillTorque_nm) {
    draw_torques(page, {90, 370, 780, 250, at - kCloseUp, at + kCloseUp, 0, 0}, result,
                 paper.largest_torque_step_w.normalized(), "component (mN m)");
    page.text(90, 362, "close-up of the largest step of the paper's law: torque along that step",
              "start", 13);
  } else {
    page.text(480, 480, "nothing moves under the paper's law: no close-up", "middle", 13);
  }
  draw_key(page, 100, 670);
  page.text(90, 704,
            "torque about x0; " + std::to_string(result.weighted.back().steps) +
                " steps, k_F = 1000 N/m, epsilon = epsilon_o = 0.5 mm",
            "start", 12, "fill=\"#505050\"");
  return page.finish();
}

std::string step_picture(std::span<const PathResult> results) {
  SvgPage page(1140, 760, "Largest change of the torque per step (mN m) over the number of steps");
  const double low = std::log10(200), high = std::log10(20000);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const PathResult& result = results[i];
    const double left = 100 + 350.0 * static_cast<double>(i % 3);
    const double top = 80 + 325.0 * static_cast<double>(i / 3);
    const Panel panel{left, top, 290, 240, low, high, -3, 2.5};
    draw_decades(page, panel);
    for (const double steps : {250.0, 1000.0, 4000.0, 16000.0}) {
      const double x = panel.x_of(std::log10(steps));
      page.line({x, top}, {x, top + panel.height}, "#e4e4e4", 1);
      page.text(x, top + panel.height + 16, std::to_string(std::lround(steps)), "middle", 12);
    }
    page.text(left + panel.width, top + panel.height + 34, "steps of the path", "end", 12);
    if (i % 3 == 0) {
      const std::string turn = "transform=\"rotate(-90 42 " + pixel(top + 120) + ")\"";
      page.text(42, top + 120, "largest change (mN m)", "middle", 13, turn.c_str());
    }
    const Pixel box[4] = {{left, top},
                          {left + panel.width, top},
                          {left + panel.width, top + panel.height},
                          {left, top + panel.height}};
    page.polygon(box, "none", 1.0, "#404040", 1);
    const double first = log_of(result.weighted.front().largest_torque_step_nm, panel);
    const double ends[2] = {std::log10(result.weighted.front().steps),
                            std::log10(result.weighted.back().steps)};
    if (first > panel.low) {
      page.line({panel.x_of(ends[0]), panel.y_of(first)},
                {panel.x_of(ends[1]), panel.y_of(first - ends[1] + ends[0])}, "#808080", 1.2, true);
    } else {
      page.text(left + panel.width / 2, top + panel.height / 2,
                "nothing moves under the weighted law", "middle", 13);
    }
    draw_slope(page, panel, result.paper, kPaperColour);
    draw_slope(page, panel, result.weighted, kWeightedColour);
    page.text(left, top - 8, result.path.name, "start", 13);
  }
  draw_key(page, 100, 730);
  page.line({450, 726}, {474, 726}, "#808080", 1.2, true);
  page.text(480, 730, "a quarter of the change at four times the steps", "start", 13);
  return page.finish();
}

}  // namespace haptic::sim
