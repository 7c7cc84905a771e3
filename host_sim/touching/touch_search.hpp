// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Straight ways of the part in the hand, without a turn, and where it touches on them.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::sim {

/// Steps in which a touch is looked for, at the least [m].
inline constexpr double kTouchStep_m = 2.5e-4;

/// The part in the hand at a pose, and as a ball about its grip point.
struct HeldPart {
  Vector grip_w = Vector::Zero();
  Rotation q_wa = Rotation::Identity();
  Vector grip_a = Vector::Zero();  ///< grip point in the mesh frame
  double radius_m = 0;

  /// Pose of the mesh frame with the grip point at `grip_w` moved by `by_w` [m, W axes].
  [[nodiscard]] Pose mesh_pose(const Vector& by_w = Vector::Zero()) const;
};
[[nodiscard]] HeldPart held_at_start(const SceneView& view);
[[nodiscard]] HeldPart held_at(const SceneView& view, const tools::PlanPose& pose);

/// Says whether the part touches where it is led, and how far it may be led on without a touch.
struct TouchVerdict {
  bool touches = false;
  bool arrives = true;  ///< law kProxy: the felt part gets there
  double clear_m = 0;
  double apart_m = 0;         ///< of the felt part from where it is led
  std::uint32_t why_not = 0;  ///< tools::WhyNot of these ticks, a bit each
};
/// The core's own verdict after the tick or, under law kProxy, after the ticks (500 at most) in
/// which the felt part follows: it touches where it stops before it is there and is felt to touch.
[[nodiscard]] TouchVerdict touch_at(CoreSession& session, const Pose& pose_wa);

/// How exactly a touch is looked for: kTouchStep_m, of a part below 2 mm an eighth of its radius,
/// so that no step leads past a fixed part of its size.
[[nodiscard]] double touch_step_m(const HeldPart& held);

struct WayToTouch {
  std::optional<double> length_m;  ///< to touch_step_m; none: no touch
  bool held_back = false;          ///< the part stays behind and touches nothing: no touch
  std::uint32_t why_not = 0;       ///< tools::WhyNot bits of held_back
};
/// The straight way from `held` along the unit vector `along_w` to the touch; without one it ends
/// where the part has left all fixed pieces behind, after `most_m`, or where it is held back.
/// Leaves the core reset. Cost: some hundred ticks, thousands where the part is long in following.
[[nodiscard]] WayToTouch way_to_touch(CoreSession& session, const HeldPart& held,
                                      const Vector& along_w,
                                      double most_m = std::numeric_limits<double>::infinity());

/// Unit directions from `held` towards the nearest places of the fixed parts, nearest first, at
/// least 20 degrees apart, at most `most`. Each leads a vertex of the part to the middle of a fixed
/// piece, so the part meets that piece at the latest there, if nothing else holds it.
[[nodiscard]] std::vector<Vector> ways_to_nearest(const SceneView& view, const HeldPart& held,
                                                  std::size_t most);

}  // namespace haptic::sim
