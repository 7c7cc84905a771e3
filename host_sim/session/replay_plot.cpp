// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/replay_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {
namespace {

constexpr double kReplayWidth = 1200, kReplayHeight = 820, kReplayLeft = 90, kRight = 170;
constexpr double kReplayPlotWidth = kReplayWidth - kReplayLeft - kRight;
// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 4> kCurveColours = {"#d55e00", "#009e73", "#0072b2", "#000000"};
constexpr std::array<const char*, 7> kSituationColours = {
    "#ffffff", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#cc79a7"};
static_assert(kSituationColours.size() == static_cast<std::size_t>(ContactSituation::kCount));

std::string legend(const Panel& panel, const std::vector<NamedCurve>& series) {
  std::string svg;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double x = panel.left + panel.width + 14,
                 y = panel.top + 16 + 20 * static_cast<double>(i);
    svg += "<line x1=\"" + pixel(x) + "\" y1=\"" + pixel(y) + "\" x2=\"" + pixel(x + 24) +
           "\" y2=\"" + pixel(y) + "\" stroke=\"" + kCurveColours[i] + "\" stroke-width=\"3\"/>\n";
    svg += text_at(x + 30, y + 4, series[i].name, "start", 13);
  }
  return svg;
}

std::string vector_panel(Panel panel, std::span<const double> times, const std::string& label,
                         const std::array<const char*, 4>& names, std::span<const TickRecord> ticks,
                         const double (TickRecord::*vector)[3]) {
  std::vector<NamedCurve> series;
  for (std::size_t axis = 0; axis < 4; ++axis) {
    NamedCurve s{names[axis], kCurveColours[axis], {}};
    s.values.reserve(ticks.size());
    for (const TickRecord& tick : ticks) {
      const double* v = tick.*vector;
      s.values.push_back(axis < 3 ? v[axis] : std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
    }
    series.push_back(std::move(s));
  }
  fit_range(panel, series);
  std::string svg = panel_frame(panel, label, false) + legend(panel, series);
  const std::array<std::size_t, 4> order = {3, 0, 1, 2};  // the norm behind its components
  for (const std::size_t i : order) {
    svg += curve(panel, times, series[i].values, kCurveColours[i], i == 3 ? 2.0 : 1.2);
  }
  return svg;
}

/// d_near in mm. Far free motion would flatten what happens in contact: the axis ends a few
/// penetrations above zero.
std::string depth_panel(Panel panel, std::span<const double> times,
                        std::span<const TickRecord> ticks) {
  NamedCurve depth{"d_near", kCurveColours[2], {}};
  double low = 0, high = 0;
  for (const TickRecord& tick : ticks) {
    const double mm = 1e3 * tick.d_near_m;
    depth.values.push_back(std::isfinite(mm) ? mm : 0.0);
    low = std::min(low, depth.values.back());
    high = std::max(high, depth.values.back());
  }
  const double top = low < 0 ? std::min(high, -6 * low) : high;
  const bool cut = top < high;
  panel.low = low - 0.08 * (top - low) - (top == low ? 1.0 : 0.0);
  panel.high = top + 0.08 * (top - low) + (top == low ? 1.0 : 0.0);
  std::string svg = panel_frame(panel, "d_near (mm)", false);
  const double y_zero = panel.y_of(0.0);
  svg += "<rect x=\"" + pixel(panel.left) + "\" y=\"" + pixel(y_zero) + "\" width=\"" +
         pixel(panel.width) + "\" height=\"" + pixel(panel.top + panel.height - y_zero) +
         "\" fill=\"#d55e00\" fill-opacity=\"0.08\"/>\n";
  svg += curve(panel, times, depth.values, "#000000", 1.4);
  const double x = panel.left + panel.width + 14;
  svg += text_at(x, panel.top + 20, "d_near", "start", 13);
  svg += text_at(x, panel.top + 40, "shaded: collision", "start", 12);
  if (cut)
    svg +=
        text_at(x, panel.top + 58, "cut above " + mark_label(panel.high, 0.1) + " mm", "start", 12);
  return svg;
}

/// A coloured band; a pixel column shows its most frequent contact, so that short contacts stay
/// visible.
std::string situation_band(const Panel& panel, std::span<const TickRecord> ticks) {
  std::string svg;
  std::array<bool, kSituationColours.size()> seen{};
  const auto column_of = [&](const TickRecord& tick) {
    return static_cast<int>(std::floor(panel.x_of(tick.t_s) - panel.left));
  };
  int run_begin = 0;
  std::size_t run_code = 0;
  const auto flush = [&](int end) {
    if (run_code != 0 && end > run_begin) {
      svg += "<rect x=\"" + pixel(panel.left + run_begin) + "\" y=\"" + pixel(panel.top) +
             "\" width=\"" + std::to_string(end - run_begin) + "\" height=\"" +
             pixel(panel.height) + "\" fill=\"" + kSituationColours[run_code] + "\"/>\n";
    }
  };
  std::size_t i = 0;
  while (i < ticks.size()) {
    const int column = column_of(ticks[i]);
    std::array<std::size_t, kSituationColours.size()> counts{};
    std::size_t end = i;
    for (; end < ticks.size() && column_of(ticks[end]) == column; ++end) {
      const auto code = std::min(static_cast<std::size_t>(ticks[end].situation), counts.size() - 1);
      ++counts[code];
      seen[code] = true;
    }
    std::size_t code = 0;
    for (std::size_t c = 1; c < counts.size(); ++c) {
      if (counts[c] > 0 && (code == 0 || counts[c] > counts[code])) code = c;
    }
    if (code != run_code) {
      flush(column);
      run_begin = column;
      run_code = code;
    }
    i = end;
  }
  flush(static_cast<int>(panel.width));
  svg += panel_frame(panel, "", true);
  svg += text_at(panel.left - 8, panel.top + panel.height / 2 + 4, "situation", "end", 13);
  double x = panel.left;
  const double y = panel.top + panel.height + 52;
  for (std::size_t c = 0; c < seen.size(); ++c) {
    if (!seen[c]) continue;
    svg += "<rect x=\"" + pixel(x) + "\" y=\"" + pixel(y) +
           "\" width=\"16\" height=\"12\" stroke=\"#404040\" fill=\"" + kSituationColours[c] +
           "\"/>\n";
    svg += text_at(x + 22, y + 11, to_text(static_cast<ContactSituation>(c)), "start", 13);
    x += 130;
  }
  return svg;
}

}  // namespace

std::string replay_plot(std::span<const TickRecord> ticks, const std::string& title) {
  std::vector<double> times;
  std::size_t contact = 0;
  for (const TickRecord& tick : ticks) {
    times.push_back(tick.t_s);
    contact += tick.d_near_m <= 0 ? 1u : 0u;
  }
  const auto panel = [&](double top, double height) {
    return time_panel(times, kReplayLeft, top, kReplayPlotWidth, height);
  };
  std::string svg = svg_head(kReplayWidth, kReplayHeight);
  svg += text_at(kReplayLeft, 28, title + ": reaction on the hand", "start", 18,
                 "font-weight=\"bold\"");
  svg +=
      text_at(kReplayLeft, 48,
              std::to_string(ticks.size()) + " ticks, " + std::to_string(contact) + " in contact",
              "start", 13, "fill=\"#505050\"");
  svg += vector_panel(panel(62, 210), times, "force (N)", {"Fx", "Fy", "Fz", "|F|"}, ticks,
                      &TickRecord::force_n);
  svg += vector_panel(panel(290, 210), times, "torque (N m)", {"Tx", "Ty", "Tz", "|T|"}, ticks,
                      &TickRecord::torque_nm);
  svg += depth_panel(panel(518, 150), times, ticks);
  svg += situation_band(panel(686, 36), ticks);
  svg += text_at(kReplayLeft + kReplayPlotWidth / 2, 758, "time (s)", "middle", 13);
  return svg + "</svg>\n";
}

}  // namespace haptic::sim
