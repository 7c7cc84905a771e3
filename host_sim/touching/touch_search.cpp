// SPDX-License-Identifier: Apache-2.0
#include "host_sim/touching/touch_search.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {
namespace {

Vector triple_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

/// How far the ball can go along `along_w` before it has left all fixed pieces behind; 0: it meets
/// none of their balls.
double reach_along(const SceneView& view, const HeldPart& held, const Vector& along_w) {
  double reach = 0;
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector way =
        triple_of(view.bodies()[piece.body].reference_m) + triple_of(piece.centre_m) - held.grip_w;
    const double ahead = way.dot(along_w), both = piece.radius_m + held.radius_m;
    if ((way - ahead * along_w).norm() <= both) reach = std::max(reach, ahead + both);
  }
  return reach;
}

/// Vertices of the part at its pose, in W: all of them, or so many evenly drawn.
std::vector<Vector> corners_of(const SceneView& view, const HeldPart& held) {
  constexpr std::size_t kMostCorners = 4096;
  std::size_t count = 0;
  const std::uint32_t pieces = view.bodies()[0].piece_count;
  for (std::uint32_t k = 0; k < pieces; ++k) count += view.piece(k).vertex_count;
  const std::size_t every = count / kMostCorners + 1;
  std::vector<Vector> corners;
  for (std::size_t k = 0, at = 0; k < pieces; ++k) {
    const PieceView piece = view.piece(static_cast<std::uint32_t>(k));
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v, ++at)
      if (at % every == 0)
        corners.push_back(held.grip_w + held.q_wa * piece.vertex(v).cast<double>());
  }
  return corners;
}

/// The middle of the vertices of a fixed piece, in W: inside it.
Vector middle_of(const SceneView& view, std::uint32_t index) {
  const PieceView piece = view.piece(index);
  Vector sum = Vector::Zero();
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) sum += piece.vertex(v).cast<double>();
  return triple_of(view.bodies()[piece.record->body].reference_m) + sum / piece.vertex_count;
}

}  // namespace

Pose HeldPart::mesh_pose(const Vector& by_w) const {
  return pose_at(grip_w + by_w - q_wa * grip_a, q_wa);
}

HeldPart held_at(const SceneView& view, const tools::PlanPose& pose) {
  HeldPart held;
  held.grip_w = tools::place_of(pose);
  held.q_wa = tools::turn_of(pose);
  held.grip_a = triple_of(view.bodies()[0].reference_m);
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0)
      held.radius_m = std::max(held.radius_m, triple_of(piece.centre_m).norm() + piece.radius_m);
  }
  return held;
}

HeldPart held_at_start(const SceneView& view) {
  const SceneParameters& parameters = view.parameters();
  const double* q = parameters.start_q_wa_xyzw;
  const Rotation q_wa = Rotation(q[3], q[0], q[1], q[2]).normalized();
  const Vector grip_a = triple_of(view.bodies()[0].reference_m);
  return held_at(view, tools::plan_pose(triple_of(parameters.start_p_wa_m) + q_wa * grip_a, q_wa));
}

TouchVerdict touch_at(CoreSession& session, const Pose& pose_wa) {
  // A large scene may take many ticks to let the part follow, and some of them may not move it: it
  // touches where it stops before it is there and is felt to touch.
  constexpr int kMostTicks = 500, kStillTicks = 8, kWaitingTicks = 100;
  constexpr double kFollowed_m = 1.0e-6, kStill_m = 1.0e-8;
  StepInput input;
  input.pose_wa = pose_wa;
  if (session.view().parameters().law != LawId::kProxy) {
    const auto d_near_m = static_cast<double>(session.step(input).d_near_m);
    return {d_near_m <= 0, true, d_near_m, 0, 0};
  }
  const Vec3 grip_a = grip_in_part(session.view());
  double least_m = std::numeric_limits<double>::max();
  TickRecord tick;
  std::uint32_t why_not = 0;
  for (int k = 0, still = 0; k < kMostTicks && still < kWaitingTicks; ++k) {
    tick = record_of(0, 0, session.step(input), LawId::kProxy, grip_a);
    why_not |= tools::why_not(judged_tick(tick));
    if (tick.apart_m <= kFollowed_m) return {false, true, tick.proxy_gap_m, tick.apart_m, 0};
    still = tick.apart_m < least_m - kStill_m ? 0 : still + 1;
    least_m = std::min(least_m, tick.apart_m);
    if (tick.in_contact && still >= kStillTicks) break;
  }
  return {tick.in_contact != 0, false, 0, tick.apart_m, why_not};
}

double touch_step_m(const HeldPart& held) { return std::min(kTouchStep_m, held.radius_m / 8); }

WayToTouch way_to_touch(CoreSession& session, const HeldPart& held, const Vector& along_w,
                        double most_m) {
  constexpr int kMostHeldBack = 8;  // steps
  const double reach = std::min(reach_along(session.view(), held, along_w), most_m);
  const double step_m = touch_step_m(held);
  WayToTouch way;
  session.reset();
  int held_back = 0;
  double free_m = 0, apart_m = 0;
  for (double s = 0; s <= reach && !way.length_m && !way.held_back;) {
    const TouchVerdict verdict = touch_at(session, held.mesh_pose(s * along_w));
    if (verdict.touches) {
      way.length_m = s;
      apart_m = verdict.apart_m;
    }
    held_back = verdict.arrives ? 0 : held_back + 1;
    way.held_back = !verdict.touches && held_back == kMostHeldBack;
    if (way.held_back) way.why_not = verdict.why_not;
    if (verdict.arrives && !verdict.touches) free_m = s;
    s += std::max(step_m, std::min(0.9 * verdict.clear_m, 0.25 * held.radius_m));
  }
  // The gap may be that of few of many pairs, and a step then leads far beyond the touch: back by
  // as much as the felt part stays behind.
  constexpr int kMostTries = 8;
  const double exact_m = 1.5 * step_m;
  for (int k = 0; k < kMostTries && way.length_m; ++k) {
    const double beyond_m = *way.length_m - free_m;
    if (beyond_m <= exact_m || apart_m <= exact_m) break;
    const double at_m = apart_m < beyond_m ? *way.length_m - apart_m : free_m + 0.5 * beyond_m;
    session.reset();
    if (!touch_at(session, held.mesh_pose(free_m * along_w)).arrives) break;
    const TouchVerdict verdict = touch_at(session, held.mesh_pose(at_m * along_w));
    if (verdict.touches) {
      way.length_m = at_m;
      apart_m = verdict.apart_m;
    } else {
      free_m = at_m;
    }
  }
  session.reset();
  return way;
}

std::vector<Vector> ways_to_nearest(const SceneView& view, const HeldPart& held, std::size_t most) {
  constexpr std::size_t kMostPieces = 256;
  constexpr double kApart_cosine = 0.9397;  // of 20 degrees
  struct Near {
    double gap_m;
    std::uint32_t piece;
  };
  std::vector<Near> near;
  for (std::uint32_t k = view.bodies()[0].piece_count; k < view.pieces().size(); ++k) {
    const PieceRecord& piece = view.pieces()[k];
    const Vector centre =
        triple_of(view.bodies()[piece.body].reference_m) + triple_of(piece.centre_m);
    near.push_back({(centre - held.grip_w).norm() - piece.radius_m, k});
  }
  const auto by_gap = [](const Near& a, const Near& b) {
    return a.gap_m != b.gap_m ? a.gap_m < b.gap_m : a.piece < b.piece;
  };
  // The nearest ones, and as many spread over all of them: the nearest may all lie on one side.
  std::ranges::sort(near, by_gap);
  std::vector<Near> looked_at;
  const std::size_t every = near.size() / kMostPieces + 1;
  for (std::size_t k = 0; k < near.size(); ++k)
    if (k < kMostPieces || k % every == 0) looked_at.push_back(near[k]);

  const std::vector<Vector> corners = corners_of(view, held);
  struct Way {
    double length_m;
    Vector along_w;
  };
  std::vector<Way> ways;
  for (const Near& piece : looked_at) {
    const Vector middle = middle_of(view, piece.piece);
    const Vector corner = *std::ranges::min_element(
        corners, {}, [&](const Vector& x) { return (middle - x).squaredNorm(); });
    const double length_m = (middle - corner).norm();
    if (length_m > 0) ways.push_back({length_m, (middle - corner) / length_m});
  }
  std::ranges::stable_sort(ways, {}, &Way::length_m);
  std::vector<Vector> chosen;
  for (const Way& way : ways) {
    const bool other = std::ranges::none_of(
        chosen, [&](const Vector& c) { return c.dot(way.along_w) > kApart_cosine; });
    if (other && chosen.size() < most) chosen.push_back(way.along_w);
  }
  return chosen;
}

}  // namespace haptic::sim
