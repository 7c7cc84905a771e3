// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/replay_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host_sim/report/svg_canvas.hpp"

namespace haptic::sim {
namespace {

constexpr double kReplayWidth = 1200, kReplayLeft = 90, kRight = 190;
constexpr double kReplayPlotWidth = kReplayWidth - kReplayLeft - kRight;
// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 4> kCurveColours = {"#d55e00", "#009e73", "#0072b2", "#c0c0c0"};
constexpr std::array<const char*, 7> kSituationColours = {
    "#ffffff", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#404040", "#cc79a7"};
// A quantity that stays below its floor is rounding noise: its axis reaches to the floor.
constexpr double kForceFloor_n = 1.0e-3, kTorqueFloor_nm = 1.0e-4, kLengthFloor_mm = 1.0e-3;
// Farther apart than this d_near is a lower bound, as a rule, and not drawn.
constexpr double kDepthTop_mm = 5.0;
// A release: the force falls by this share of the largest force, and by no less than this, within
// so many ticks. Two of them closer together than `kReleaseApart_s` are one.
constexpr double kReleaseShare = 0.2, kLeastRelease_n = 0.02, kReleaseApart_s = 0.1;
constexpr std::size_t kReleaseTicks = 3, kMostReleases = 6;
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
                         const double (TickRecord::*vector)[3], double floor) {
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
  fit_range(panel, series, floor);
  std::string svg = panel_frame(panel, label, false) + legend(panel, series);
  const std::array<std::size_t, 4> order = {3, 0, 1, 2};  // the norm behind its components
  for (const std::size_t i : order) {
    svg += curve(panel, times, series[i].values, kCurveColours[i], i == 3 ? 4.0 : 1.4);
  }
  return svg;
}

/// A sudden fall of the force: the part slipped off what held it.
struct Release {
  double t_s = 0, fall_n = 0;
};

double norm_of(const double (&v)[3]) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// The largest releases of a run, in the order of time.
std::vector<Release> releases_of(std::span<const TickRecord> ticks) {
  double largest_n = 0;
  for (const TickRecord& tick : ticks) largest_n = std::max(largest_n, norm_of(tick.force_n));
  const double least_n = std::max(kReleaseShare * largest_n, kLeastRelease_n);
  std::vector<Release> found;
  for (std::size_t i = kReleaseTicks; i < ticks.size(); ++i) {
    const double fall_n = norm_of(ticks[i - kReleaseTicks].force_n) - norm_of(ticks[i].force_n);
    if (!(fall_n >= least_n)) continue;
    if (!found.empty() && ticks[i].t_s - found.back().t_s < kReleaseApart_s) {
      if (fall_n > found.back().fall_n) found.back() = {ticks[i].t_s, fall_n};
    } else {
      found.push_back({ticks[i].t_s, fall_n});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Release& l, const Release& r) { return l.fall_n > r.fall_n; });
  if (found.size() > kMostReleases) found.resize(kMostReleases);
  std::sort(found.begin(), found.end(),
            [](const Release& l, const Release& r) { return l.t_s < r.t_s; });
  return found;
}

/// A dashed line through all panels at each release, named at the top.
std::string release_marks(const Panel& first, double bottom, std::span<const Release> releases) {
  std::string svg;
  for (const Release& release : releases) {
    const double x = first.x_of(release.t_s);
    svg += "<line x1=\"" + pixel(x) + "\" y1=\"" + pixel(first.top) + "\" x2=\"" + pixel(x) +
           "\" y2=\"" + pixel(bottom) +
           "\" stroke=\"#a0005a\" stroke-width=\"1\" stroke-dasharray=\"4 3\"/>\n";
    svg += text_at(x + 4, first.top + 13, "release, -" + mark_label(release.fall_n, 0.01) + " N",
                   "start", 11, "fill=\"#a0005a\"");
  }
  return svg;
}

/// Distance in mm of the part, as it is felt, from the goal that the device asks for: what the
/// spring of law proxy pulls by.
std::string apart_panel(Panel panel, std::span<const double> times,
                        std::span<const TickRecord> ticks) {
  NamedCurve apart{"apart", kCurveColours[2], {}};
  for (const TickRecord& tick : ticks) {
    apart.values.push_back(std::isfinite(tick.apart_m) ? 1e3 * tick.apart_m : 0.0);
  }
  fit_range(panel, {&apart, 1}, kLengthFloor_mm);
  std::string svg = panel_frame(panel, "apart (mm)", false);
  svg += curve(panel, times, apart.values, kCurveColours[2], 1.4);
  const double x = panel.left + panel.width + 14;
  svg += text_at(x, panel.top + 20, "distance of the part from", "start", 12);
  svg += text_at(x, panel.top + 36, "the pose of the device:", "start", 12);
  return svg + text_at(x, panel.top + 52, "the spring's length", "start", 12);
}

/// d_near in mm at the goal pose. Far free motion would flatten what happens in contact: the axis
/// ends a few penetrations above zero, and what lies above is not drawn. Ticks without a search
/// have no value.
std::string depth_panel(Panel panel, std::span<const double> times,
                        std::span<const TickRecord> ticks) {
  double low = 0, high = 0;
  for (const TickRecord& tick : ticks) {
    const double mm = 1e3 * tick.d_near_m;
    if (!std::isfinite(mm)) continue;
    low = std::min(low, mm);
    high = std::max(high, mm);
  }
  const double near = std::min(high, kDepthTop_mm);
  const double top = std::max(low < 0 ? std::min(near, -6 * low) : near, low + kLengthFloor_mm);
  panel.low = low - 0.08 * (top - low);
  panel.high = top < high ? top : top + 0.08 * (top - low);
  std::string svg = panel_frame(panel, "d_near (mm)", false);
  const double y_zero = panel.y_of(0.0);
  svg += "<rect x=\"" + pixel(panel.left) + "\" y=\"" + pixel(y_zero) + "\" width=\"" +
         pixel(panel.width) + "\" height=\"" + pixel(panel.top + panel.height - y_zero) +
         "\" fill=\"#d55e00\" fill-opacity=\"0.08\"/>\n";
  const auto drawn = [&](const TickRecord& tick) { return 1e3 * tick.d_near_m <= panel.high; };
  for (std::size_t i = 0; i < ticks.size();) {
    if (!drawn(ticks[i])) {
      ++i;
      continue;
    }
    std::vector<double> values;
    const std::size_t begin = i;
    for (; i < ticks.size() && drawn(ticks[i]); ++i) values.push_back(1e3 * ticks[i].d_near_m);
    svg += curve(panel, times.subspan(begin, values.size()), values, "#000000", 1.4);
  }
  const double x = panel.left + panel.width + 14;
  svg += text_at(x, panel.top + 20, "distance to the nearest", "start", 12);
  svg += text_at(x, panel.top + 36, "C-face at the goal pose;", "start", 12);
  svg += text_at(x, panel.top + 52, "shaded: inside", "start", 12);
  if (top < high)
    svg += text_at(x, panel.top + 68, "not drawn above " + mark_label(panel.high, 0.1) + " mm",
                   "start", 12);
  return svg;
}

/// A coloured band; a pixel column shows its most frequent contact, so that short contacts stay
/// visible.
std::string situation_band(const Panel& panel, std::span<const TickRecord> ticks) {
  std::string svg = panel_frame(panel, "", true);  // grid first: white in the band means none
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
  svg += panel_box(panel);
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
  bool has_apart = false, has_depth = ticks.empty();
  for (const TickRecord& tick : ticks) {
    times.push_back(tick.t_s);
    contact += norm_of(tick.force_n) > kForceFloor_n ? 1u : 0u;
    has_apart = has_apart || 1e3 * tick.apart_m > kLengthFloor_mm;
    has_depth = has_depth || std::isfinite(tick.d_near_m);
  }
  double top = 62;
  const auto panel = [&](double height) {
    const Panel made = time_panel(times, kReplayLeft, top, kReplayPlotWidth, height);
    top += height + 18;
    return made;
  };
  const Panel first = panel(210);
  std::string svg = vector_panel(first, times, "force (N)", {"Fx", "Fy", "Fz", "|F|"}, ticks,
                                 &TickRecord::force_n, kForceFloor_n);
  svg += vector_panel(panel(170), times, "torque (N m)", {"Tx", "Ty", "Tz", "|T|"}, ticks,
                      &TickRecord::torque_nm, kTorqueFloor_nm);
  if (has_apart) svg += apart_panel(panel(110), times, ticks);
  if (has_depth) svg += depth_panel(panel(130), times, ticks);
  const std::vector<Release> releases = releases_of(ticks);
  svg += release_marks(first, top - 18, releases);
  const Panel band = panel(36);
  svg += situation_band(band, ticks);
  svg += text_at(kReplayLeft + kReplayPlotWidth / 2, top + 18, "time (s)", "middle", 13);
  std::string head = svg_head(kReplayWidth, top + 62);
  head += text_at(kReplayLeft, 28, title + ": reaction on the hand", "start", 18,
                  "font-weight=\"bold\"");
  std::string note =
      std::to_string(ticks.size()) + " ticks, " + std::to_string(contact) + " with force";
  if (!releases.empty()) note += "; release: the part slips off what held it";
  head += text_at(kReplayLeft, 48, note, "start", 13, "fill=\"#505050\"");
  return head + svg + "</svg>\n";
}

}  // namespace haptic::sim
