// SPDX-License-Identifier: Apache-2.0
// Pictures of the continuity measurement.
#include <algorithm>
#include <cmath>

#include "host_sim/lab/continuity/continuity_report.hpp"
#include "host_sim/report/picture.hpp"

namespace haptic::sim {
namespace {

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
