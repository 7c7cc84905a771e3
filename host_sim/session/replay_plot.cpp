// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/replay_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "host_sim/report/picture.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

constexpr double kReplayWidth = 1200, kReplayLeft = 90, kRight = 190;
constexpr double kReplayPlotWidth = kReplayWidth - kReplayLeft - kRight;
// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 4> kCurveColours = {"#c0c0c0", "#d55e00", "#009e73", "#0072b2"};
// A quantity that stays below its floor is rounding noise: its axis reaches to the floor.
constexpr double kForceFloor_n = 1.0e-3, kTorqueFloor_nm = 1.0e-4, kLengthFloor_mm = 1.0e-3;
// Farther apart than this d_near would flatten what happens in contact, and is not drawn.
constexpr double kDepthTop_mm = 5.0;
// A release: the force falls by this share of the largest force, and by no less than this, within
// so many ticks. Two of them closer together than `kReleaseApart_s` are one.
constexpr double kReleaseShare = 0.2, kLeastRelease_n = 0.02, kReleaseApart_s = 0.1;
constexpr std::size_t kReleaseTicks = 3, kMostReleases = 6;
constexpr std::array<const char*, 7> kSituationColours = {
    "#ffffff", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#404040", "#cc79a7"};
static_assert(kSituationColours.size() == static_cast<std::size_t>(ContactSituation::kCount));

/// Norm and components; the norm behind its components.
std::string vector_panel(Panel panel, std::span<const double> times, const std::string& label,
                         const std::array<const char*, 4>& names, std::span<const TickRecord> ticks,
                         const double (TickRecord::*vector)[3], double floor) {
  std::vector<NamedCurve> series;
  for (std::size_t k = 0; k < 4; ++k) {
    NamedCurve& s =
        series.emplace_back(NamedCurve{names[k], kCurveColours[k], {}, k == 0 ? 4.0 : 1.4});
    for (const TickRecord& tick : ticks)
      s.values.push_back(k == 0 ? length_of(tick.*vector) : (tick.*vector)[k - 1]);
  }
  fit_range(panel, series, floor);
  return curve_panel(panel, label, times, series, false);
}

/// The flags that are marked, gravest last.
constexpr struct {
  std::uint32_t flags;
  BandValue value;
} kMarks[] = {{0, {"follows", "#ffffff"}},
              {kFlagRamping, {"force ramped", "#c8b400"}},
              {kFlagSaturated, {"pull at its limit", "#cc79a7"}},
              {kFlagBehind | kFlagHeld, {"behind", "#56b4e9"}},
              {kFlagListFull, {"list full", "#0072b2"}},
              {kFlagProxyStuck, {"stuck", "#d55e00"}},
              {kFlagRecovery, {"recovery", "#a0005a"}},
              {kFlagOutsideEnvelope, {"outside limits", "#404040"}},
              {kFlagBadPose, {"pose refused", "#000000"}}};

std::size_t mark_of(std::uint32_t flags) {
  for (std::size_t k = std::size(kMarks) - 1; k > 0; --k) {
    if ((flags & kMarks[k].flags) != 0) return k;
  }
  return 0;
}

/// True if something holds the part, and its force is not taken away by a ramp.
bool is_held(const TickRecord& tick) {
  return tick.in_contact && (tick.flags & (kFlagRamping | kFlagRecovery)) == 0;
}

/// A sudden fall of the force: the part slipped off what held it.
struct Release {
  double t_s = 0, fall_n = 0;
};

/// The largest releases of a run, in the order of time.
std::vector<Release> releases_of(std::span<const TickRecord> ticks) {
  double largest_n = 0;
  for (const TickRecord& tick : ticks) largest_n = std::max(largest_n, length_of(tick.force_n));
  const double least_n = std::max(kReleaseShare * largest_n, kLeastRelease_n);
  std::vector<Release> found;
  for (std::size_t i = kReleaseTicks; i < ticks.size(); ++i) {
    const double fall_n = length_of(ticks[i - kReleaseTicks].force_n) - length_of(ticks[i].force_n);
    if (!(fall_n >= least_n) || !is_held(ticks[i - kReleaseTicks])) continue;
    if ((ticks[i].flags & (kFlagRamping | kFlagRecovery)) != 0) continue;
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

/// From this share of a panel on a release is named on the left of its line.
constexpr double kWordsOnLeft = 0.85;

/// A dashed line through all panels at each release, named at the top.
std::string release_marks(const Panel& first, double bottom, std::span<const Release> releases) {
  std::string svg;
  for (const Release& release : releases) {
    const double x = first.x_of(release.t_s);
    svg += line_at({x, first.top}, {x, bottom}, "#a0005a", 1, "4 3");
    const bool on_left = x > first.left + kWordsOnLeft * first.width;
    svg += text_at(on_left ? x - 4 : x + 4, first.top + 13,
                   "release, -" + mark_label(release.fall_n, 0.01) + " N",
                   on_left ? "end" : "start", 11, "fill=\"#a0005a\"");
  }
  return svg;
}

}  // namespace

bool shows_apart(std::span<const double> apart_m) {
  return std::ranges::any_of(apart_m, [](double m) { return 1e3 * m > kLengthFloor_mm; });
}

std::string apart_panel(Panel panel, std::span<const double> times,
                        std::span<const double> apart_m) {
  std::vector<NamedCurve> apart{{"apart", kTorqueColour, {}}};
  for (const double m : apart_m) apart.front().values.push_back(1e3 * m);
  fit_range(panel, apart, kLengthFloor_mm);
  return panel_frame(panel, "apart (mm)", false) +
         curve(panel, times, apart.front().values, kTorqueColour, 1.4) +
         panel_note(panel,
                    std::vector<std::string>{"distance of the part from",
                                             "the pose of the device:", "the spring's length"});
}

bool shows_guide(std::span<const TickGuide> guides) {
  return std::ranges::any_of(guides, [](const TickGuide& of) {
    return of.state == GuideState::kOn || of.state == GuideState::kLost;
  });
}

std::string guide_panels(Panel pull, Panel station, std::span<const double> times,
                         std::span<const TickGuide> guides) {
  std::vector<NamedCurve> force{{"|F| of the guide", kForceColour, {}, 1.4}};
  std::vector<NamedCurve> passed{{"station passed", kRegionColour, {}, 1.4}};
  double torque_nm = 0;
  for (const TickGuide& of : guides) {
    force.front().values.push_back(length_of(of.force_n));
    torque_nm = std::max(torque_nm, length_of(of.torque_nm));
    passed.front().values.push_back(of.state == GuideState::kOn
                                        ? static_cast<double>(of.station)
                                        : std::numeric_limits<double>::quiet_NaN());
  }
  fit_range(pull, force, kForceFloor_n);
  fit_range(station, passed, 1.0);
  return panel_frame(pull, "guide (N)", false) +
         curve(pull, times, force.front().values, kForceColour, 1.4) +
         panel_note(
             pull,
             std::vector<std::string>{"pull of the guide, not in", "the force above; torque",
                                      "up to " + tools::short_number(torque_nm, 2) + " N m"}) +
         panel_frame(station, "station", false) +
         curve(station, times, passed.front().values, kRegionColour, 1.4) +
         panel_note(station, std::vector<std::string>{"of the plan, the last one",
                                                      "passed; "
                                                      "gaps: guide off or lost"});
}

double searched_depth_m(const TickRecord& tick, double exact_band_m) {
  // kFlagFarBand tells of any pair; a bound of one that is far is beyond the band.
  const bool far = (tick.flags & kFlagFarBand) != 0 && tick.d_near_m > exact_band_m;
  const bool searched = tick.status == RtStatus::kOk && !far &&
                        (tick.flags & (kFlagInexact | kFlagBudgetUsedUp)) == 0;
  return searched ? tick.d_near_m : std::numeric_limits<double>::quiet_NaN();
}

bool shows_depth(std::span<const double> d_near_m) {
  return d_near_m.empty() ||
         std::ranges::any_of(d_near_m, [](double m) { return std::isfinite(m); });
}

std::string depth_panel(Panel panel, std::span<const double> times,
                        std::span<const double> d_near_m) {
  double low = 0, high = 0;
  for (const double m : d_near_m) {
    if (!std::isfinite(m)) continue;
    low = std::min(low, 1e3 * m);
    high = std::max(high, 1e3 * m);
  }
  const double near = std::min(high, kDepthTop_mm);
  const double top = std::max(low < 0 ? std::min(near, -6 * low) : near, low + kLengthFloor_mm);
  panel.low = low - 0.08 * (top - low);
  panel.high = top < high ? top : top + 0.08 * (top - low);
  std::string svg = panel_frame(panel, "d_near (mm)", false);
  const double y_zero = panel.y_of(0.0);
  svg += rectangle_at({panel.left, y_zero}, panel.width, panel.top + panel.height - y_zero,
                      kForceColour, "fill-opacity=\"0.08\"");
  std::vector<double> drawn;
  for (const double m : d_near_m)
    drawn.push_back(1e3 * m <= panel.high ? 1e3 * m : std::numeric_limits<double>::quiet_NaN());
  svg += curve(panel, times, drawn, kPointColour, 1.4);
  std::vector<std::string> note{"distance to the nearest", "C-face at the goal pose;",
                                "shaded: inside"};
  if (top < high) note.push_back("not drawn above " + mark_label(panel.high, 0.1) + " mm");
  return svg + panel_note(panel, note);
}

std::string situation_band(const Panel& panel, std::span<const double> times,
                           std::span<const ContactSituation> situations, double key_y) {
  std::vector<BandValue> table;
  for (std::size_t c = 0; c < kSituationColours.size(); ++c)
    table.push_back({to_text(static_cast<ContactSituation>(c)), kSituationColours[c]});
  std::vector<std::size_t> values;
  for (const ContactSituation s : situations)
    values.push_back(std::min(static_cast<std::size_t>(s), table.size() - 1));
  return band(panel, "situation", true, times, values, table, BandColumn::kMostFrequent) +
         band_key(panel.left, key_y, values, table);
}

bool shows_marks(std::span<const std::uint32_t> flags) {
  return std::ranges::any_of(flags, [](std::uint32_t of) { return mark_of(of) > 0; });
}

std::string mark_band(const Panel& panel, std::span<const double> times,
                      std::span<const std::uint32_t> flags, double key_y) {
  std::vector<BandValue> table;
  for (const auto& mark : kMarks) table.push_back(mark.value);
  std::vector<std::size_t> values;
  for (const std::uint32_t of : flags) values.push_back(mark_of(of));
  return band(panel, "lags", false, times, values, table, BandColumn::kLastOfTable) +
         band_key(panel.left, key_y, values, table);
}

std::string replay_plot(std::span<const TickRecord> ticks, const std::string& title,
                        double exact_band_m) {
  std::vector<double> times;
  std::size_t contact = 0;
  std::vector<double> apart_m, d_near_m;
  std::vector<ContactSituation> situations;
  std::vector<std::uint32_t> flags;
  std::vector<TickGuide> guides;
  for (const TickRecord& tick : ticks) {
    flags.push_back(tick.flags);
    times.push_back(tick.t_s);
    contact += tick.in_contact ? 1u : 0u;
    guides.push_back(tick.guide);
    apart_m.push_back(tick.apart_m);
    d_near_m.push_back(searched_depth_m(tick, exact_band_m));
    situations.push_back(tick.situation);
  }
  double top = 62;
  const auto panel = [&](double height) {
    const Panel made = time_panel(times, kReplayLeft, top, kReplayPlotWidth, height);
    top += height + 18;
    return made;
  };
  const Panel first = panel(210);
  std::string svg = vector_panel(first, times, "force (N)", {"|F|", "Fx", "Fy", "Fz"}, ticks,
                                 &TickRecord::force_n, kForceFloor_n);
  svg += vector_panel(panel(170), times, "torque (N m)", {"|T|", "Tx", "Ty", "Tz"}, ticks,
                      &TickRecord::torque_nm, kTorqueFloor_nm);
  if (shows_guide(guides)) {
    const Panel pull = panel(110);
    svg += guide_panels(pull, panel(70), times, guides);
  }
  if (shows_apart(apart_m)) svg += apart_panel(panel(110), times, apart_m);
  if (shows_depth(d_near_m)) svg += depth_panel(panel(130), times, d_near_m);
  const std::vector<Release> releases = releases_of(ticks);
  svg += release_marks(first, top - 18, releases);
  const bool marks = shows_marks(flags);
  const double marks_top = top;
  if (marks) top += 32;
  const Panel strip = panel(36);
  if (marks) {
    svg += mark_band(time_panel(times, kReplayLeft, marks_top, kReplayPlotWidth, 14), times, flags,
                     strip.top + strip.height + 76);
  }
  svg += situation_band(strip, times, situations, strip.top + strip.height + 52);
  svg += text_at(kReplayLeft + kReplayPlotWidth / 2, top + 18, "time (s)", "middle", 13);
  svg += heading_at(kReplayLeft, 28, title + ": reaction on the hand");
  std::string note =
      std::to_string(ticks.size()) + " ticks, " + std::to_string(contact) + " in contact";
  if (!releases.empty()) note += "; release: the part slips off what held it";
  svg += text_at(kReplayLeft, 48, note, "start", 13, "fill=\"#505050\"");
  return svg_document(kReplayWidth, top + (marks ? 86 : 62), svg);
}

}  // namespace haptic::sim
