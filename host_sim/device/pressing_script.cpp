// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/pressing_script.hpp"

#include <algorithm>
#include <limits>

#include "host_sim/reproduction/shapes.hpp"

namespace haptic::sim {
namespace {

constexpr double kPress_m = 0.003, kSlide_m = 0.005;
constexpr double kMarch_m = 0.0005;  ///< steps in which the way to a piece is searched
constexpr int kMarchSteps = 4000;

Vector vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// Centre of the fixed piece nearest to `from`, in W.
Vector nearest_piece(const SceneView& view, const Vector& from) {
  Vector nearest = from;
  double least = std::numeric_limits<double>::max();
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector centre =
        vector_of(view.bodies()[piece.body].reference_m) + vector_of(piece.centre_m);
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

MotionScript pressing_script(CoreSession& session, double rate_hz, double seconds) {
  const SceneParameters& parameters = session.view().parameters();
  const double* q = parameters.start_q_wa_xyzw;
  const Rotation turn = Rotation(q[3], q[0], q[1], q[2]).normalized();
  const Vector start = vector_of(parameters.start_p_wa_m);
  const Vector grip = turn * vector_of(session.view().bodies()[0].reference_m);
  const Vector way = nearest_piece(session.view(), start + grip) - (start + grip);
  const Vector along = way.norm() > 0 ? Vector(way.normalized()) : Vector(-Vector::UnitZ());
  double touch_m = -1;
  session.core().reset();
  for (int k = 0; k <= kMarchSteps && touch_m < 0; ++k) {
    StepInput input;
    input.pose_wa = pose_at(start + k * kMarch_m * along, turn);
    if (session.core().step(input).d_near_m <= 0) touch_m = k * kMarch_m;
  }
  session.core().reset();

  const Vector side = kSlide_m * along.unitOrthogonal();
  const Vector pressed = touch_m > 0 ? Vector(start + (touch_m + kPress_m) * along) : start;
  const Vector slid = touch_m > 0 ? Vector(pressed + side) : start;
  MotionScript script;
  script.rate_hz = rate_hz;
  const std::pair<const char*, Vector> stations[] = {
      {"start", start}, {"press", pressed}, {"rest", pressed}, {"slide", slid}, {"leave", start}};
  const double shares[] = {0, 0.4, 0.55, 0.75, 1};
  for (std::size_t k = 0; k < std::size(stations); ++k) {
    script.waypoints.push_back(
        way_point(stations[k].first, shares[k] * seconds, stations[k].second, turn));
  }
  return script;
}

}  // namespace haptic::sim
