// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene as the measurements in real time use it: the reference device in a firm hand, which
/// presses the part on the nearest fixed one at any rate.

#include <functional>

#include "host_sim/device/device_stack.hpp"

namespace haptic::sim {

struct PressedScene {
  StackSettings stack;
  std::function<HandAction(double t_s)> hand;
  double rest_s = 0;  ///< the hand rests in contact then
};

/// The hand's motion lasts `seconds`, then it rests off the wall; deadman as in scripted_hand.
/// @throws tools::InputError  the scene's device table is out of range.
[[nodiscard]] PressedScene pressed_scene(CoreSession& session, double rate_hz, double seconds);

}  // namespace haptic::sim
