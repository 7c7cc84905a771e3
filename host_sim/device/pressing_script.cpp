// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/pressing_script.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "host_sim/session/tick_record.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

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

/// The part in the hand at the start, as a ball about its grip point.
struct HeldBall {
  Vector start_w, grip_w;
  Rotation q_wa;
  double radius_m = 0;
};

HeldBall held_ball(const SceneView& view) {
  const SceneParameters& parameters = view.parameters();
  const double* q = parameters.start_q_wa_xyzw;
  HeldBall held;
  held.q_wa = Rotation(q[3], q[0], q[1], q[2]).normalized();
  held.start_w = point_of(parameters.start_p_wa_m);
  held.grip_w = held.start_w + held.q_wa * point_of(view.bodies()[0].reference_m);
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0)
      held.radius_m = std::max(held.radius_m, point_of(piece.centre_m).norm() + piece.radius_m);
  }
  return held;
}

/// How far the ball can go along `along` before it has left all fixed pieces behind; 0: it meets
/// none of their balls.
double reach_along(const SceneView& view, const HeldBall& held, const Vector& along) {
  double reach = 0;
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector way =
        point_of(view.bodies()[piece.body].reference_m) + point_of(piece.centre_m) - held.grip_w;
    const double ahead = way.dot(along), both = piece.radius_m + held.radius_m;
    if ((way - ahead * along).norm() <= both) reach = std::max(reach, ahead + both);
  }
  return reach;
}

/// Whether the part touches where it is led, and how far it may be led on without a touch.
struct TouchVerdict {
  bool touches = false;
  double clear_m = 0;
};

TouchVerdict touch_at(CoreSession& session, const Pose& pose) {
  // A large scene may take many ticks to let the part follow, and some of them may not move it: it
  // touches where it stops before it is there and is felt to touch.
  constexpr int kMostTicks = 500, kStillTicks = 8, kWaitingTicks = 100;
  constexpr double kFollowed_m = 1.0e-6, kStill_m = 1.0e-8;
  StepInput input;
  input.pose_wa = pose;
  if (session.view().parameters().law != LawId::kProxy) {
    const auto d_near_m = static_cast<double>(session.core().step(input).d_near_m);
    return {d_near_m <= 0, d_near_m};
  }
  const Vec3 grip_a = grip_in_part(session.view());
  double least_m = std::numeric_limits<double>::max();
  TickRecord tick;
  for (int k = 0, still = 0; k < kMostTicks && still < kWaitingTicks; ++k) {
    tick = record_of(0, 0, session.core().step(input), LawId::kProxy, grip_a);
    if (tick.apart_m <= kFollowed_m) return {false, tick.proxy_gap_m};
    still = tick.apart_m < least_m - kStill_m ? 0 : still + 1;
    least_m = std::min(least_m, tick.apart_m);
    if (tick.in_contact && still >= kStillTicks) break;
  }
  return {tick.in_contact, 0};
}

/// Length of the way to the touch.
std::optional<double> way_to_touch(CoreSession& session, const HeldBall& held,
                                   const Vector& along) {
  const double reach = reach_along(session.view(), held, along);
  std::optional<double> way;
  session.core().reset();
  for (double s = 0; s <= reach && !way;) {
    const TouchVerdict verdict = touch_at(session, pose_at(held.start_w + s * along, held.q_wa));
    if (verdict.touches) way = s;
    s += std::max(kTouchStep_m, std::min(0.9 * verdict.clear_m, 0.25 * held.radius_m));
  }
  session.core().reset();
  return way;
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
  session.core().reset();
  for (int k = 0; k <= kMarchSteps && point.way_m < 0; ++k) {
    StepInput input;
    input.report_goal_contact = true;
    input.pose_wa = pose_at(point.start_w + k * kMarch_m * point.along_w, point.q_wa);
    const bool touches = searches_goal ? session.core().step(input).d_near_m <= 0
                                       : touch_at(session, input.pose_wa).touches;
    if (touches) point.way_m = k * kMarch_m;
  }
  session.core().reset();
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

TouchingScript touching_script(CoreSession& session, const std::string& name) {
  constexpr double kPressForce_n = 3.0, kLeastPress_m = 2.0e-4;
  constexpr double kTilt_rad = 0.03, kApproachSpeed_m_per_s = 0.06, kLongestWay_m = 2.0;
  const HeldBall held = held_ball(session.view());
  std::optional<double> way;
  TouchingScript touching;
  const auto try_along = [&](const Vector& along) {
    const std::optional<double> found = way_to_touch(session, held, along);
    if (!found || (way && *found >= *way)) return;
    way = found;
    touching.along_w = along;
  };
  for (const int axis : {2, 0, 1}) {
    try_along(-Vector::Unit(axis));
    try_along(Vector::Unit(axis));
  }
  const Vector nearest = nearest_piece(session.view(), held.grip_w) - held.grip_w;
  if (!way && nearest.norm() > 0) try_along(nearest.normalized());
  if (!way) {
    throw tools::InputError(name +
                            ": the part meets no fixed part on a straight way along an axis, nor "
                            "towards the nearest one; give [moving] position_m a place beside "
                            "them, or write way points (MOTION.md)");
  }
  if (*way > kLongestWay_m) {
    throw tools::InputError(name + ": the part starts " + tools::short_number(*way, 3) +
                            " m away from the first touch; give [moving] position_m in metres, "
                            "and scale_to_m the metres per unit of the mesh");
  }
  touching.way_m = *way;
  const double third_m = held.radius_m / 3;
  touching.press_m =
      std::min({std::max(kLeastPress_m, kPressForce_n / session.view().parameters().k_f_n_per_m),
                kPress_m, third_m});
  touching.slide_m = std::min(kSlide_m, third_m);
  touching.tilt_rad = kTilt_rad;

  const Vector u = touching.along_w.unitOrthogonal(), v = touching.along_w.cross(u);
  const Vector touch = held.grip_w + touching.way_m * touching.along_w;
  const Vector pressed = touch + touching.press_m * touching.along_w;
  const double travel_s = std::max(1.0, touching.way_m / kApproachSpeed_m_per_s);
  const double slide_m = touching.slide_m;
  struct Station {
    const char* phase;
    double seconds;
    Vector grip_w;
    double tilt_rad;
  };
  const Station stations[] = {{"start", 0, held.grip_w, 0},
                              {"approach", travel_s, touch, 0},
                              {"press", 0.6, pressed, 0},
                              {"rest", 0.4, pressed, 0},
                              {"slide", 0.8, pressed + slide_m * u, 0},
                              {"slide", 1.2, pressed - slide_m * u, 0},
                              {"slide", 1.0, pressed + slide_m * v, 0},
                              {"slide", 1.2, pressed - slide_m * v, 0},
                              {"centre", 0.8, pressed, 0},
                              {"tilt", 0.6, pressed, touching.tilt_rad},
                              {"level", 0.6, pressed, 0},
                              {"lift", 0.6, touch, 0},
                              {"leave", travel_s, held.grip_w, 0}};
  const Vector grip_a = point_of(session.view().bodies()[0].reference_m);
  double t_s = 0;
  for (const Station& station : stations) {
    t_s += station.seconds;
    const Rotation q = Rotation(Eigen::AngleAxisd(station.tilt_rad, u)) * held.q_wa;
    touching.script.waypoints.push_back(
        way_point(station.phase, t_s, station.grip_w - q * grip_a, q));
  }
  return touching;
}

std::string way_text(const Vector& along_w) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (std::abs(along_w[k]) == 1.0) return (along_w[k] > 0 ? "+" : "-") + std::string(kAxes[k]);
  }
  return tools::formatted("(%.3g, %.3g, %.3g)", along_w.x(), along_w.y(), along_w.z());
}

}  // namespace haptic::sim
