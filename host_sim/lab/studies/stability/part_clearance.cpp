// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_report.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host_sim/lab/stability/peg_insertion.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr const char* kFrictionColours[] = {"#0072b2", "#e69f00", "#d55e00"};
constexpr double kFloor_m = -0.040;

struct PegRow {
  double clearance_m = 0, friction = 0;
  PegRun wobble, wobble_half, tilted, tilted_half;  ///< half: steps half as long

  [[nodiscard]] double offset_error_m() const {
    return std::abs(reach_aside_m(wobble.end.proxy) - clearance_m);
  }
  [[nodiscard]] double floor_error_m() const { return std::abs(wobble.deepest_m - kFloor_m); }
  [[nodiscard]] double lag_m() const { return tilted.end.proxy.p[2] - tilted.end.device.p[2]; }
  /// What friction allows while the tilted peg slides: at its first slip and at the end.
  [[nodiscard]] double held_n(bool at_end) const {
    return two_point_force_n(at_end ? tilted.end : tilted.slip, clearance_m, friction);
  }
  [[nodiscard]] double pull_n(bool at_end) const {
    return (at_end ? tilted.end : tilted.slip).force_n[2];
  }
  /// Largest force step over what friction held in the swaying insertion.
  [[nodiscard]] double slip_share() const {
    return friction > 0 ? std::max(wobble.largest_force_step_n, wobble_half.largest_force_step_n) /
                              (friction * wobble.largest_force_n)
                        : 0;
  }
};

/// In single precision each of the two is known to `still` alone.
bool halves(double coarse, double fine, double still, double least) {
  const double rounding = HAPTIC_REAL_IS_FLOAT ? still : 0.0;
  return coarse < still || coarse + rounding >= least * fine;
}

bool continuous(const PegRun& coarse, const PegRun& fine, const ClearanceLimits& limits) {
  return halves(coarse.largest_force_step_n, fine.largest_force_step_n, limits.still_force_n,
                limits.least_ratio) &&
         halves(coarse.largest_torque_step_nm, fine.largest_torque_step_nm, limits.still_torque_nm,
                limits.least_ratio);
}

/// The spring pulls with what sliding on two points gives; without friction there is hardly a lag.
bool as_friction_says(const PegRow& cell, const ClearanceLimits& limits) {
  for (const bool at_end : {false, true}) {
    const double held = cell.held_n(at_end);
    const double room = std::max(limits.friction_share * held, limits.still_force_n);
    if (!(std::abs(cell.pull_n(at_end) - held) <= room)) return false;
  }
  return cell.friction > 0 || std::abs(cell.lag_m()) <= limits.free_lag_m;
}

std::vector<PegRow> all_cells(bool quick) {
  std::vector<double> clearances{1e-3, 3e-4, 1e-4, 3e-5, 1e-5}, frictions{0, 0.2, 0.5};
  if (quick) {
    clearances = {1e-3, 1e-5};
    frictions = {0, 0.5};
  }
  std::vector<PegRow> cells;
  for (const double clearance : clearances) {
    for (const double friction : frictions) {
      const std::vector<std::byte> scene = inserted_peg_scene(clearance, friction);
      PegRow cell;
      cell.clearance_m = clearance;
      cell.friction = friction;
      cell.wobble = run_peg(scene, PegPath::kWobble, kPeriod_s, true);
      cell.wobble_half = run_peg(scene, PegPath::kWobble, kPeriod_s / 2, false);
      cell.tilted = run_peg(scene, PegPath::kTilted, kPeriod_s, true);
      cell.tilted_half = run_peg(scene, PegPath::kTilted, kPeriod_s / 2, false);
      cells.push_back(std::move(cell));
    }
  }
  return cells;
}

double halving(double coarse, double fine) { return fine > 0 ? coarse / fine : 0; }

std::string csv_of(const std::vector<PegRow>& cells) {
  ReportTable table(
      "clearance_m,friction,path,largest_force_step_n,ratio_when_halved,largest_torque_step_nm,"
      "ratio_when_halved,worst_gap_m,final_reach_m,deepest_m,lag_m,slip_pull_n,slip_friction_n,"
      "end_pull_n,end_friction_n,advance_m");
  for (const PegRow& cell : cells) {
    for (const bool wobble : {true, false}) {
      const PegRun& run = wobble ? cell.wobble : cell.tilted;
      const PegRun& half = wobble ? cell.wobble_half : cell.tilted_half;
      table.add(
          {cell.clearance_m, cell.friction, wobble ? "wobble" : "tilted", run.largest_force_step_n,
           halving(run.largest_force_step_n, half.largest_force_step_n), run.largest_torque_step_nm,
           halving(run.largest_torque_step_nm, half.largest_torque_step_nm), run.worst_gap_m,
           reach_aside_m(run.end.proxy), run.deepest_m, run.end.proxy.p[2] - run.end.device.p[2],
           run.slip.force_n[2], wobble ? 0.0 : cell.held_n(false), run.end.force_n[2],
           wobble ? 0.0 : cell.held_n(true), run.advance_m});
    }
  }
  return table.csv();
}

std::string wobble_table(const std::vector<PegRow>& cells) {
  std::string text = table_head({"clearance, mm", "friction", "deepest, mm", "way - clearance, um",
                                 "largest dF, N", "halving", "of what friction held",
                                 "largest dT, N m", "halving", "worst gap, um"});
  for (const PegRow& c : cells) {
    text += table_row(
        {short_number(1e3 * c.clearance_m, 3), short_number(c.friction, 3),
         fixed(1e3 * c.wobble.deepest_m, 4), short_number(1e6 * c.offset_error_m(), 3),
         short_number(c.wobble.largest_force_step_n, 3),
         fixed(halving(c.wobble.largest_force_step_n, c.wobble_half.largest_force_step_n), 2),
         c.friction > 0 ? fixed(c.slip_share(), 2) : "-",
         short_number(c.wobble.largest_torque_step_nm, 3),
         fixed(halving(c.wobble.largest_torque_step_nm, c.wobble_half.largest_torque_step_nm), 2),
         short_number(1e6 * c.wobble.worst_gap_m, 3)});
  }
  return text;
}

std::string tilted_table(const std::vector<PegRow>& cells) {
  std::string text =
      table_head({"clearance, mm", "friction", "slips at, N", "friction gives, N",
                  "pull at the end, N", "friction gives, N", "lag, mm", "advance, mm",
                  "largest dF, N", "halving", "largest dT, N m", "halving"});
  for (const PegRow& c : cells) {
    text += table_row(
        {short_number(1e3 * c.clearance_m, 3), short_number(c.friction, 3),
         short_number(c.pull_n(false), 3), short_number(c.held_n(false), 3),
         short_number(c.pull_n(true), 3), short_number(c.held_n(true), 3),
         fixed(1e3 * c.lag_m(), 3), fixed(1e3 * c.tilted.advance_m, 3),
         short_number(c.tilted.largest_force_step_n, 3),
         fixed(halving(c.tilted.largest_force_step_n, c.tilted_half.largest_force_step_n), 2),
         short_number(c.tilted.largest_torque_step_nm, 3),
         fixed(halving(c.tilted.largest_torque_step_nm, c.tilted_half.largest_torque_step_nm), 2)});
  }
  return text;
}

/// Left: lag of the peg in the tilted push over time at the narrowest clearance. Right: offset over
/// the clearance after the swaying insertion.
std::string picture(const std::vector<PegRow>& cells) {
  std::string svg = heading_at(70, 28, "Peg of 10 mm in a hole of five pieces");
  const double narrow = cells.back().clearance_m;
  double top = 0;
  for (const PegRow& c : cells) {
    if (c.clearance_m == narrow)
      top = std::max(top, *std::max_element(c.tilted.lag_mm.begin(), c.tilted.lag_mm.end()));
  }
  const Panel lag{80, 60, 420, 300, 0, duration_s(PegPath::kTilted), -0.2, 1.1 * top + 0.1};
  svg += panel_frame(lag, "lag of the tilted peg (mm)", true);
  svg += text_at(290, 398, "time (s), clearance " + short_number(1e3 * narrow, 3) + " mm", "middle",
                 13);
  const LogPanel offset{600, 60, 420, 300, 1e-5, 1e-3, 1e-5, 1e-3};
  svg += log_panel_frame(offset, "", "clearance (m)", "final offset (m)", 1);
  svg += line_at({offset.x_of(1e-5), offset.y_of(1e-5)}, {offset.x_of(1e-3), offset.y_of(1e-3)},
                 "#808080", 1, "5 4");
  std::size_t colour = 0;
  for (const PegRow& c : cells) {
    const auto shade = kFrictionColours[c.friction == 0 ? 0 : c.friction < 0.4 ? 1 : 2];
    svg += mark_at(offset.x_of(c.clearance_m), offset.y_of(reach_aside_m(c.wobble.end.proxy)),
                   {shade, 'x'});
    if (c.clearance_m != narrow) continue;
    svg += curve(lag, c.tilted.t_s, c.tilted.lag_mm, shade, 2);
    const double y = 80 + 20 * static_cast<double>(colour++);
    svg += legend_entry(96, y - 4, shade, "friction " + short_number(c.friction, 3));
  }
  return svg_document(1060, 420, svg);
}

void add_findings(const std::vector<PegRow>& cells, const ClearanceLimits& limits,
                  PartReport& report) {
  double offset = 0, floor = 0, slip = 0;
  bool friction = true, smooth = true, sound = true;
  for (const PegRow& c : cells) {
    offset = std::max(offset, c.offset_error_m());
    floor = std::max(floor, c.floor_error_m());
    friction = friction && as_friction_says(c, limits);
    smooth = smooth && continuous(c.tilted, c.tilted_half, limits) &&
             (c.friction > 0 || continuous(c.wobble, c.wobble_half, limits));
    slip = std::max(slip, c.slip_share());
    sound = sound && c.wobble.refused_ticks + c.tilted.refused_ticks == 0;
  }
  const auto add = [&](const std::string& topic, const std::string& stated,
                       const std::string& found, bool holds, const std::string& remark) {
    report.findings.push_back({topic, stated, found, yes_or_no(holds), remark});
    report.passed = report.passed && holds;
  };
  add("clearance sweep: the swaying peg reaches the floor",
      "within " + short_number(1e6 * limits.floor_m, 3) + " um",
      short_number(1e6 * floor, 3) + " um", floor <= limits.floor_m && sound,
      "all clearances and frictions");
  add("clearance sweep: pressed sideways it stands off by the clearance",
      "within " + short_number(1e6 * limits.offset_m, 3) + " um",
      short_number(1e6 * offset, 3) + " um", offset <= limits.offset_m, "final offset");
  add("clearance sweep: tilted and pushed, it follows or is held as friction says",
      "within " + short_number(100 * limits.friction_share, 3) + " %", friction ? "all" : "NOT all",
      friction, "sliding on two points, at the first slip and at the end");
  add("clearance sweep: largest steps of force and torque when the step is halved",
      "halving at least " + short_number(limits.least_ratio, 3), smooth ? "all" : "NOT all", smooth,
      "swaying without friction, tilted with any");
  add("clearance sweep: largest force step where the swaying peg sticks and slips",
      "at most " + fixed(limits.slip_share, 2) + " of what friction held", fixed(slip, 2),
      slip <= limits.slip_share, "a slip is a jump: it does not shrink with the step");
}

}  // namespace

PartReport clearance_part(bool quick, const ClearanceLimits& limits) {
  const std::vector<PegRow> cells = all_cells(quick);
  PartReport report;
  report.title = "6. Clearance sweep of the peg";
  add_findings(cells, limits, report);
  report.markdown =
      "Square peg, 10 mm wide, hole 40 mm deep in five pieces that share their planes, law proxy, "
      "k_t 1000 N/m, k_r 1 N m/rad, 1 kHz. Ratio: largest step at 1 ms over that at 0.5 ms; 2 "
      "where nothing jumps.\n\nSwaying insertion, at the end 1 mm into the floor and 2 mm "
      "aside:\n\n" +
      wobble_table(cells) +
      "\nTilted by 0.08 rad on two points, 15 mm deep, pushed 8 mm down. Below the force at which "
      "it slips it is jammed. Friction gives: sliding on two points in balance with the "
      "spring.\n\n" +
      tilted_table(cells) + "\n" +
      picture_line("clearance.svg", "Lag of the tilted peg, offset of the pressed one");
  report.files = {{"clearance.csv", csv_of(cells)},
                  {"clearance.md", "# " + report.title + "\n\n" + report.markdown},
                  {"clearance.svg", picture(cells)}};
  return report;
}

}  // namespace haptic::sim
