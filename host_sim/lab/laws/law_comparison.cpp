// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/laws/law_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "rt_core/scene/capacity.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

double distance(const double (&a)[3], const double (&b)[3]) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

LawTick tick_of(double t_s, const StepResult& result) {
  LawTick tick;
  tick.t_s = t_s;
  for (int i = 0; i < 3; ++i) {
    tick.force_n[i] = static_cast<double>(result.wrench_w.force_w[i]);
    tick.torque_nm[i] = static_cast<double>(result.wrench_w.torque_w[i]);
    tick.goal_m[i] = static_cast<double>(result.goal_pose_wa.p_wa[i]);
    tick.proxy_m[i] = static_cast<double>(result.proxy_pose_wa.p_wa[i]);
  }
  tick.proxy_gap_m = static_cast<double>(result.proxy_gap_m);
  tick.d_near_m = static_cast<double>(result.d_near_m);
  tick.flags = result.flags;
  return tick;
}

std::vector<LawStep> largest(std::vector<LawStep> steps, double LawStep::*size) {
  std::ranges::stable_sort(
      steps, [size](const LawStep& a, const LawStep& b) { return a.*size > b.*size; });
  steps.resize(std::min(steps.size(), kListedSteps));
  return steps;
}

/// Steps and ways of a run whose ticks are complete.
void finish(LawRun& run, const double (&towards)[3]) {
  std::vector<LawStep> steps;
  run.farthest_goal_m = run.farthest_proxy_m = -std::numeric_limits<double>::infinity();
  const auto along = [&towards](const double(&p)[3]) {
    return p[0] * towards[0] + p[1] * towards[1] + p[2] * towards[2];
  };
  for (std::size_t k = 0; k < run.ticks.size(); ++k) {
    const LawTick& tick = run.ticks[k];
    if (k > 0) {
      const LawTick& last = run.ticks[k - 1];
      steps.push_back(
          {k, distance(tick.force_n, last.force_n), distance(tick.torque_nm, last.torque_nm)});
    }
    if (run.law == LawId::kProxy) run.worst_gap_m = std::min(run.worst_gap_m, tick.proxy_gap_m);
    run.farthest_goal_m = std::max(run.farthest_goal_m, along(tick.goal_m));
    const double way = along(tick.proxy_m);
    if (way <= run.farthest_proxy_m) continue;
    run.farthest_proxy_m = way;
    const double lag = along(tick.goal_m) - way, all = distance(tick.proxy_m, tick.goal_m);
    run.proxy_there_m = std::sqrt(std::max(0.0, all * all - lag * lag));
  }
  run.force_steps = largest(steps, &LawStep::force_n);
  run.torque_steps = largest(steps, &LawStep::torque_nm);
  run.end_distance_m = distance(run.ticks.back().proxy_m, run.ticks.back().goal_m);
}

std::string step_table(const LawRun& run, bool torque) {
  std::string text = table_head({"time, s", "change of force, N", "change of torque, mN m"});
  for (const LawStep& step : torque ? run.torque_steps : run.force_steps) {
    text += table_row({fixed(run.ticks[step.tick].t_s, 3), short_number(step.force_n, 4),
                       short_number(1e3 * step.torque_nm, 4)});
  }
  return text;
}

/// A panel of the picture: its label, what it takes from a tick, and the value below which that is
/// rounding noise.
struct LawPanel {
  const char* label;
  double floor;
  double (*value)(const LawTick&);
};
constexpr LawPanel kLawPanels[] = {
    {"|F| (N)", 1e-3,
     [](const LawTick& t) { return std::hypot(t.force_n[0], t.force_n[1], t.force_n[2]); }},
    {"Fx (N)", 1e-3, [](const LawTick& t) { return t.force_n[0]; }},
    {"Fy (N)", 1e-3, [](const LawTick& t) { return t.force_n[1]; }},
    {"Fz (N)", 1e-3, [](const LawTick& t) { return t.force_n[2]; }},
    {"|T| (N m)", 1e-4,
     [](const LawTick& t) { return std::hypot(t.torque_nm[0], t.torque_nm[1], t.torque_nm[2]); }},
    {"part from device (mm)", 1e-3,
     [](const LawTick& t) { return 1e3 * distance(t.proxy_m, t.goal_m); }}};

}  // namespace

std::vector<std::byte> scene_with_law(const SceneView& view, LawId law, double k_r_nm_per_rad) {
  SceneParameters changed = view.parameters();
  changed.law = law;
  if (k_r_nm_per_rad > 0) changed.coupling.k_r_nm_per_rad = k_r_nm_per_rad;
  return scene_with_parameters(view, changed);
}

std::vector<std::byte> scene_with_parameters(const SceneView& view,
                                             const SceneParameters& changed) {
  const tools::SceneBytes blob =
      tools::changed_scene(view, [&](SceneParameters& p) { p = changed; });
  const std::span<const std::byte> bytes = blob.span();
  return {bytes.begin(), bytes.end()};
}

LawRun run_law(std::span<const std::byte> scene, LawId law, std::span<const MotionSample> motion,
               const double (&towards)[3]) {
  CoreSession session(scene, law_name(law));
  const CouplingParameters& coupling = session.view().parameters().coupling;
  LawRun run;
  run.law = law;
  run.k_t_n_per_m = coupling.k_t_n_per_m;
  run.k_r_nm_per_rad = coupling.k_r_nm_per_rad;
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const StepResult result = session.core().step(input_of(motion[k], k, GoalContact::kAsked));
    if (result.status != RtStatus::kOk) {
      throw tools::InputError("tick " + std::to_string(k) +
                              ": the pose is refused: " + to_text(result.status));
    }
    run.ticks.push_back(tick_of(motion[k].t_s, result));
  }
  finish(run, towards);
  return run;
}

std::string comparison_csv(std::span<const LawRun> runs) {
  std::string csv = "t_s";
  for (const LawRun& run : runs) {
    for (const char* column : {"fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm", "x_m", "y_m",
                               "z_m", "proxy_gap_m", "flags"})
      csv += std::string(",") + law_name(run.law) + "_" + column;
  }
  csv += ",goal_x_m,goal_y_m,goal_z_m,d_near_m\n";
  for (std::size_t k = 0; k < runs[0].ticks.size(); ++k) {
    append_number(csv, runs[0].ticks[k].t_s);
    for (const LawRun& run : runs) {
      const LawTick& tick = run.ticks[k];
      for (const double v : tick.force_n) append_number(csv += ',', v);
      for (const double v : tick.torque_nm) append_number(csv += ',', v);
      for (const double v : tick.proxy_m) append_number(csv += ',', v);
      append_number(csv += ',', tick.proxy_gap_m);
      csv += "," + std::to_string(tick.flags);
    }
    for (const double v : runs[0].ticks[k].goal_m) append_number(csv += ',', v);
    append_number(csv += ',', runs[0].ticks[k].d_near_m);
    csv += '\n';
  }
  return csv;
}

std::string comparison_page(std::span<const LawRun> runs, const std::string& title) {
  std::string page =
      "# " + title + ": laws compared\n\n" + std::to_string(runs[0].ticks.size()) +
      " ticks. Coupling " + short_number(runs[0].k_t_n_per_m, 4) + " N/m, " +
      short_number(runs[0].k_r_nm_per_rad, 4) + " N m/rad.\n\n" +
      table_head({"law", "largest change of force, N", "at, s", "largest change of torque, mN m",
                  "at, s", "way in, device, mm", "way in, part, mm", "part from device there, mm",
                  "part to device at the end, mm", "worst gap, um"});
  for (const LawRun& run : runs) {
    const LawStep &force = run.force_steps[0], &torque = run.torque_steps[0];
    page += table_row({law_name(run.law), short_number(force.force_n, 4),
                       fixed(run.ticks[force.tick].t_s, 3), short_number(1e3 * torque.torque_nm, 4),
                       fixed(run.ticks[torque.tick].t_s, 3), fixed(1e3 * run.farthest_goal_m, 4),
                       fixed(1e3 * run.farthest_proxy_m, 4), fixed(1e3 * run.proxy_there_m, 4),
                       fixed(1e3 * run.end_distance_m, 6),
                       run.law == LawId::kProxy ? short_number(1e6 * run.worst_gap_m, 4) : "-"});
  }
  page += "\n" + picture_line("compare_laws.svg", "Force and torque under both laws");
  for (const LawRun& run : runs) {
    page += std::string("\n## Law ") + law_name(run.law) + ": largest changes of force\n\n" +
            step_table(run, false) + "\nof torque\n\n" + step_table(run, true);
  }
  return page;
}

std::string comparison_json(std::span<const LawRun> runs) {
  nlohmann::ordered_json json;
  for (const LawRun& run : runs) {
    nlohmann::ordered_json entry{{"law", law_name(run.law)},
                                 {"ticks", run.ticks.size()},
                                 {"k_r_nm_per_rad", run.k_r_nm_per_rad},
                                 {"farthest_goal_m", run.farthest_goal_m},
                                 {"farthest_proxy_m", run.farthest_proxy_m},
                                 {"proxy_beside_goal_m", run.proxy_there_m},
                                 {"end_distance_m", run.end_distance_m},
                                 {"worst_gap_m", run.worst_gap_m}};
    for (const auto& [name, steps] : {std::pair{"force_steps", &run.force_steps},
                                      std::pair{"torque_steps", &run.torque_steps}}) {
      for (const LawStep& step : *steps) {
        entry[name].push_back({{"t_s", run.ticks[step.tick].t_s},
                               {"force_n", step.force_n},
                               {"torque_nm", step.torque_nm}});
      }
    }
    json.push_back(std::move(entry));
  }
  return json.dump(2) + "\n";
}

std::string comparison_picture(std::span<const LawRun> runs, const std::string& title) {
  constexpr double kWidth = 1200, kLeft = 90, kPlotWidth = 940, kTop = 56, kHeight = 170, kGap = 34;
  std::vector<double> times;
  for (const LawTick& tick : runs[0].ticks) times.push_back(tick.t_s);
  std::string svg = heading_at(kLeft, 30, title + ": reaction on the hand under two laws");
  double top = kTop;
  for (const LawPanel& source : kLawPanels) {
    Panel panel = time_panel(times, kLeft, top, kPlotWidth, kHeight);
    std::vector<NamedCurve> curves;
    for (const LawRun& run : runs) {
      const bool first = curves.empty();
      NamedCurve& c = curves.emplace_back(NamedCurve{
          law_name(run.law), first ? kForceColour : kTorqueColour, {}, first ? 3.4 : 1.2});
      for (const LawTick& tick : run.ticks) c.values.push_back(source.value(tick));
    }
    fit_range(panel, curves, source.floor);
    const bool last = &source == &kLawPanels[std::size(kLawPanels) - 1];
    svg += curve_panel(panel, source.label, times, curves, last);
    top += kHeight + kGap;
  }
  svg += text_at(kLeft + kPlotWidth / 2, top + 14, "time (s)", "middle", 13);
  return svg_document(kWidth, top + 30, svg);
}

}  // namespace haptic::sim
