// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/pressing_script.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/shapes/shapes.hpp"
#include "host_sim/touching/touch_search.hpp"

namespace haptic::sim {
namespace {

constexpr double kPress_m = 0.003, kSlide_m = 0.005;
constexpr double kMarch_m = 0.0005;  ///< steps in which the way to a piece is searched
constexpr int kMarchSteps = 4000;

Vector point_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// Centre of the fixed piece nearest to `from`, in W.
Vector nearest_piece(const SceneView& view, const Vector& from) {
  Vector nearest = from;
  double least = std::numeric_limits<double>::max();
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector centre =
        point_of(view.bodies()[piece.body].reference_m) + point_of(piece.centre_m);
    const double gap = (centre - from).norm() - piece.radius_m;
    if (gap < least) {
      least = gap;
      nearest = centre;
    }
  }
  return nearest;
}

WayPoint way_point(const std::string& phase, double t_s, const Vector& p, const Rotation& q) {
  const MotionSample sample = sample_at(t_s, p, q);
  WayPoint point;
  point.phase = phase;
  point.t_s = t_s;
  std::copy(sample.p, sample.p + 3, point.p);
  std::copy(sample.q_wxyz, sample.q_wxyz + 4, point.q_wxyz);
  return point;
}

}  // namespace

PressedPoint touched_point(CoreSession& session) {
  const SceneParameters& parameters = session.view().parameters();
  const double* q = parameters.start_q_wa_xyzw;
  PressedPoint point;
  point.q_wa = Rotation(q[3], q[0], q[1], q[2]).normalized();
  point.start_w = point_of(parameters.start_p_wa_m);
  const Vector grip = point.q_wa * point_of(session.view().bodies()[0].reference_m);
  const Vector way = nearest_piece(session.view(), point.start_w + grip) - (point.start_w + grip);
  point.along_w = way.norm() > 0 ? Vector(way.normalized()) : Vector(-Vector::UnitZ());
  const bool searches_goal = has_goal_contact(parameters);
  session.reset();
  for (int k = 0; k <= kMarchSteps && point.way_m < 0; ++k) {
    StepInput input;
    input.report_goal_contact = true;
    input.pose_wa = pose_at(point.start_w + k * kMarch_m * point.along_w, point.q_wa);
    const bool touches = searches_goal ? session.step(input).d_near_m <= 0
                                       : touch_at(session, input.pose_wa).touches;
    if (touches) point.way_m = k * kMarch_m;
  }
  session.reset();
  point.grip_w = point.start_w + grip + std::max(point.way_m, 0.0) * point.along_w;
  return point;
}

MotionScript pressing_script(CoreSession& session, double rate_hz, double seconds) {
  const PressedPoint touch = touched_point(session);
  const Vector side = kSlide_m * touch.along_w.unitOrthogonal();
  const Vector start = touch.start_w;
  const bool touches = touch.way_m > 0;
  const Vector pressed = touches ? Vector(start + (touch.way_m + kPress_m) * touch.along_w) : start;
  const Vector slid = touches ? Vector(pressed + side) : start;
  MotionScript script;
  script.rate_hz = rate_hz;
  const std::pair<const char*, Vector> stations[] = {
      {"start", start}, {"press", pressed}, {"rest", pressed}, {"slide", slid}, {"leave", start}};
  const double shares[] = {0, 0.4, 0.55, 0.75, 1};
  for (std::size_t k = 0; k < std::size(stations); ++k) {
    script.waypoints.push_back(
        way_point(stations[k].first, shares[k] * seconds, stations[k].second, touch.q_wa));
  }
  return script;
}

}  // namespace haptic::sim
