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

}  // namespace haptic::sim
