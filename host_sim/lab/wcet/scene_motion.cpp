// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/scene_motion.hpp"

#include <algorithm>

#include "host_sim/device/pressing_script.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {
namespace {

constexpr double kShiftShare = 0.2;                         // of A's radius
constexpr double kTurn_rad = 0.4;                           // far below what a segment may turn
constexpr double kStationEvery_s = 0.25;                    // a hand that searches
constexpr double kTremor_m = 0.0002, kTremor_rad = 0.0035;  // as in the scenes' own scripts

WayPoint station(double t_s, const Vector& p, const Rotation& q) {
  const MotionSample sample = sample_at(t_s, p, q);
  WayPoint point;
  point.phase = "wander";
  point.t_s = t_s;
  std::copy(sample.p, sample.p + 3, point.p);
  std::copy(sample.q_wxyz, sample.q_wxyz + 4, point.q_wxyz);
  return point;
}

}  // namespace

double moving_radius_m(const SceneView& view) {
  double radius = 0;
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) radius = std::max(radius, piece.radius_m);
  }
  return radius;
}

std::vector<MotionSample> scene_motion(CoreSession& session, double seconds, std::uint64_t seed) {
  const double half_s = seconds / 2;
  MotionScript script = pressing_script(session, session.view().parameters().rate_hz, half_s);
  script.seed = seed;
  script.tremor.position_m = kTremor_m;
  script.tremor.angle_rad = kTremor_rad;
  // The second station is the pressed pose; the last one is where the wander begins.
  const WayPoint pressed = script.waypoints[1];
  const Vector p(pressed.p[0], pressed.p[1], pressed.p[2]);
  const Rotation q(pressed.q_wxyz[0], pressed.q_wxyz[1], pressed.q_wxyz[2], pressed.q_wxyz[3]);
  const double shift_m = kShiftShare * moving_radius_m(session.view());
  Seeded random(seed);
  const int stations = std::max(1, static_cast<int>(half_s / kStationEvery_s));
  for (int k = 1; k <= stations; ++k) {
    const Vector to = p + random.uniform(0, shift_m) * random.direction();
    const Eigen::AngleAxisd turn(random.uniform(0, kTurn_rad), random.direction());
    script.waypoints.push_back(station(half_s + half_s * k / stations, to, turn * q));
  }
  return make_motion(script);
}

}  // namespace haptic::sim
