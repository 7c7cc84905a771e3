// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion of the hand for a scene that comes without a script.

#include "host_sim/commands/core_session.hpp"
#include "host_sim/motion/motion_script.hpp"

namespace haptic::sim {

/// A hand motion for a scene without a script: from the start pose of A straight towards the
/// nearest fixed piece until A touches it, 3 mm on, 5 mm sideways, and back. Rests at the start
/// pose when A touches at once or the way is free.
[[nodiscard]] MotionScript pressing_script(CoreSession& session, double rate_hz, double seconds);

}  // namespace haptic::sim
