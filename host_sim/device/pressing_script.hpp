// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion of the hand for a scene that comes without a script.

#include <string>

#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Where A, moved straight from the start pose towards the nearest fixed piece, touches first.
struct PressedPoint {
  Vector start_w = Vector::Zero();                           ///< A's origin at the start
  Vector grip_w = Vector::Zero(), along_w = Vector::Zero();  ///< grip point at touch; unit, the way
  Rotation q_wa = Rotation::Identity();
  double way_m = -1;  ///< from the start; 0: it touches there; negative: the way is free
};
/// To half a millimetre; in a scene that does not search the contact at the device's pose, as one
/// with surfaces, a touch is a part that cannot follow. Leaves the core reset. Cost: up to 4001
/// ticks, and some hundred more for a part that is held.
[[nodiscard]] PressedPoint touched_point(CoreSession& session);

/// A hand motion for a scene without a script: from the start pose of A straight towards the
/// nearest fixed piece until A touches it, 3 mm on, 5 mm sideways, and back. Rests at the start
/// pose when A touches at once or the way is free.
[[nodiscard]] MotionScript pressing_script(CoreSession& session, double rate_hz, double seconds);

/// A longer one, to see a scene at work: approach along an axis, press, slide to four sides, tilt,
/// leave. Its lengths go with the part and the stiffness.
struct TouchingScript {
  MotionScript script;
  Vector along_w = Vector::Zero();  ///< unit: the way of the approach
  double way_m = 0;                 ///< from the start pose to the touch, to kTouchStep_m
  double press_m = 0, slide_m = 0;  ///< beyond the touch; to each side
  double tilt_rad = 0;
};
inline constexpr double kTouchStep_m = 2.5e-4;

/// The approach goes along the axis of W on which the part touches soonest; where it touches on
/// none, towards the nearest fixed piece. Under law proxy a touch is a part that cannot follow, so
/// surfaces are touched too. Leaves the core reset. Cost: some thousand ticks.
/// @throws tools::InputError  the part touches nothing there; `name` is the scene's.
[[nodiscard]] TouchingScript touching_script(CoreSession& session, const std::string& name);

/// "-z", "+x", or three numbers.
[[nodiscard]] std::string way_text(const Vector& along_w);

}  // namespace haptic::sim
