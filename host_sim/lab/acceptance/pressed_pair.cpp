// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/acceptance/pressed_pair.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "host_sim/session/replay.hpp"
#include "host_sim/touching/touch_search.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

/// Of the stiffness times the depth of the press: on a slope a part without friction slides off.
constexpr double kLeastPressShare = 0.01;
constexpr std::size_t kMostWays = 6;

/// The grip point along `along_w`: by each of `ways_m`, a quarter of a second each.
std::vector<TickRecord> played(CoreSession& session, const HeldPart& held, const Vector& along_w,
                               std::initializer_list<double> ways_m) {
  constexpr double kLeg_s = 0.25;
  MotionScript script;
  for (const double way_m : ways_m) {
    const double t_s = kLeg_s * static_cast<double>(script.waypoints.size());
    const Vector mesh_w = held.grip_w + way_m * along_w - held.q_wa * held.grip_a;
    const MotionSample sample = sample_at(t_s, mesh_w, held.q_wa);
    WayPoint point;
    point.t_s = t_s;
    std::copy(sample.p, sample.p + 3, point.p);
    std::copy(sample.q_wxyz, sample.q_wxyz + 4, point.q_wxyz);
    script.waypoints.push_back(point);
  }
  return replay(session, make_motion(script), {}).ticks;
}

double largest_force_n(const std::vector<TickRecord>& ticks) {
  double force_n = 0;
  for (const TickRecord& tick : ticks) force_n = std::max(force_n, length_of(tick.force_n));
  return force_n;
}

}  // namespace

PressedPair press_pair(std::span<const std::byte> scene, const std::string& name) {
  CoreSession session(scene, name, GoalContact::kLeftOut);
  const HeldPart held = held_at_start(session.view());
  PressedPair pair;
  pair.air_force_n =
      largest_force_n(played(session, held, -Vector::UnitZ(), {0, kAirWay_m, kAirWay_m, 0}));
  const double k_f_n_per_m = session.view().parameters().k_f_n_per_m;
  if (pair.air_force_n > 0) {  // a free part arrives where the hand is, to the bit
    pair.fault = tools::formatted("%.3g mm through free air and back: up to %.3g N",
                                  1e3 * kAirWay_m, pair.air_force_n);
  }
  std::vector<Vector> ways{Vector::UnitZ()};
  for (const Vector& way : ways_to_nearest(session.view(), held, kMostWays)) ways.push_back(way);
  constexpr double kDeepest_m = 0.003, kForce_n = 3.0;
  const double depth_m = std::min({kDeepest_m, kForce_n / k_f_n_per_m, held.radius_m / 3});
  const double wanted_n = kLeastPressShare * k_f_n_per_m * depth_m;
  for (const Vector& along_w : ways) {
    const std::optional<double> way_m = way_to_touch(session, held, along_w).length_m;
    if (!way_m) continue;
    const double deep_m = *way_m + depth_m;
    const std::vector<TickRecord> ticks =
        played(session, held, along_w, {0, *way_m, deep_m, deep_m, *way_m, 0});
    pair.press_force_n = std::max(pair.press_force_n, largest_force_n(ticks));
    pair.touched = std::ranges::any_of(ticks, [&](const TickRecord& tick) {
      return tick.in_contact && length_of(tick.force_n) >= wanted_n;
    });
    if (pair.touched) break;
  }
  if (!pair.touched) {
    if (!pair.fault.empty()) pair.fault += "; ";
    pair.fault += tools::formatted(
        "cannot be touched: on %zu straight ways to the other part no contact and no force of "
        "%.3g N (up to %.3g N)",
        ways.size(), wanted_n, pair.press_force_n);
  }
  return pair;
}

}  // namespace haptic::sim
