// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/stack_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "host_sim/report/picture.hpp"
#include "host_sim/session/replay_plot.hpp"

namespace haptic::sim {
namespace {

constexpr double kStackWidth = 1200, kStackLeft = 90, kStackRight = 200;
constexpr double kStackPlotWidth = kStackWidth - kStackLeft - kStackRight;

/// The stages of a wrench; where they agree the finer curves lie within the wider ones.
struct Stage {
  const char* name;
  const char* colour;
  double width;
};
constexpr std::array<Stage, 3> kStages = {Stage{"rendered by the core", "#c0c0c0", 8.0},
                                          Stage{"handed over to the bus", "#56b4e9", 4.2},
                                          Stage{"acting on the handle", "#d55e00", 1.2}};

// What is rare stands last: it shows where several values fall into one pixel column.
constexpr std::array<BandValue, 5> kArmings = {
    BandValue{"armed", "#009e73"}, BandValue{"disarmed", "#ffffff"}, BandValue{"arming", "#f0e442"},
    BandValue{"disarming", "#56b4e9"}, BandValue{"faulted", "#d55e00"}};
constexpr std::array<ArmingState, 5> kArmingOrder = {ArmingState::kArmed, ArmingState::kDisarmed,
                                                     ArmingState::kArming, ArmingState::kDisarming,
                                                     ArmingState::kFaulted};
constexpr std::array<BandValue, 3> kLinks = {BandValue{"ready", "#009e73"},
                                             BandValue{"starting", "#f0e442"},
                                             BandValue{"absent", "#d55e00"}};
constexpr std::array<LinkState, 3> kLinkOrder = {LinkState::kReady, LinkState::kStarting,
                                                 LinkState::kAbsent};

template <typename Order, typename State>
std::size_t place_in(const Order& order, State state) {
  const auto found = std::find(order.begin(), order.end(), state);
  return found == order.end() ? 0 : static_cast<std::size_t>(found - order.begin());
}

using StageValues = std::array<std::vector<double>, kStages.size()>;

/// `floor`: what stays below it is rounding noise.
std::string stage_panel(Panel panel, std::span<const double> times, const char* label,
                        const StageValues& stages, double floor) {
  std::vector<NamedCurve> curves;
  for (std::size_t k = 0; k < kStages.size(); ++k)
    curves.push_back({kStages[k].name, kStages[k].colour, stages[k], kStages[k].width});
  fit_range(panel, curves, floor);
  return curve_panel(panel, label, times, curves, false);
}

}  // namespace

std::string stack_plot(std::span<const StackRecord> records, const std::string& title) {
  std::vector<double> times;
  StageValues force, torque;
  for (const StackRecord& r : records) {
    times.push_back(r.loop.tick.t_s);
    force[0].push_back(length_of(r.loop.tick.force_n));
    // Without a device nothing is handed over, with any last command.
    const Wrench handed_d = r.link == LinkState::kAbsent ? Wrench{} : r.handed_d;
    force[1].push_back(static_cast<double>(handed_d.force_w.norm()));
    force[2].push_back(r.acting_w.force_w.norm());
    torque[0].push_back(length_of(r.loop.tick.torque_nm));
    torque[1].push_back(static_cast<double>(handed_d.torque_w.norm()));
    torque[2].push_back(r.acting_w.torque_w.norm());
  }
  std::vector<std::size_t> armings, links;
  std::vector<ContactSituation> situations;
  std::vector<double> apart_m, d_near_m;
  std::size_t contact = 0;
  for (const StackRecord& r : records) {
    armings.push_back(place_in(kArmingOrder, r.arming));
    links.push_back(place_in(kLinkOrder, r.link));
    situations.push_back(r.loop.tick.situation);
    apart_m.push_back(r.loop.tick.apart_m);
    d_near_m.push_back(r.loop.tick.d_near_m);
    contact += r.loop.tick.situation != ContactSituation::kNone ? 1u : 0u;
  }
  std::string svg = heading_at(kStackLeft, 28, title);
  svg += text_at(kStackLeft, 48,
                 std::to_string(records.size()) + " periods, " + std::to_string(contact) +
                     " in contact; from the core to the handle",
                 "start", 13, "fill=\"#505050\"");
  double top = 62;
  const auto panel = [&](double height, double gap = 18) {
    const Panel made = time_panel(times, kStackLeft, top, kStackPlotWidth, height);
    top += height + gap;
    return made;
  };
  svg += stage_panel(panel(210), times, "|force| (N)", force, 1.0e-3);
  svg += stage_panel(panel(190), times, "|torque| (N m)", torque, 1.0e-4);
  if (shows_apart(apart_m)) svg += apart_panel(panel(110), times, apart_m);
  if (shows_depth(d_near_m)) svg += depth_panel(panel(130), times, d_near_m);
  const Panel arming = panel(24, 10), link = panel(24, 10), situation = panel(24, 0);
  svg += band(arming, "arming", false, times, armings, kArmings, BandColumn::kLastOfTable);
  svg += band(link, "link", false, times, links, kLinks, BandColumn::kLastOfTable);
  svg += situation_band(situation, times, situations, top + 98);
  svg += text_at(kStackLeft + kStackPlotWidth / 2, top + 36, "time (s)", "middle", 13);
  svg += band_key(kStackLeft, top + 50, armings, kArmings);
  svg += band_key(kStackLeft, top + 74, links, kLinks);
  const char* const names[] = {"arming", "link", "situation"};
  for (std::size_t k = 0; k < 3; ++k)
    svg += text_at(kStackLeft - 8, top + 61 + 24 * static_cast<double>(k), names[k], "end", 13);
  return svg_document(kStackWidth, top + 126, svg);
}

}  // namespace haptic::sim
