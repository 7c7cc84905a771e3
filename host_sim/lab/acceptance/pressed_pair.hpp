// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a hand feels of a compiled pair: nothing on a way through free air, and a force when it
/// presses the part against the other one.

#include <cstddef>
#include <span>
#include <string>

namespace haptic::sim {

/// The way through free air, and back [m].
inline constexpr double kAirWay_m = 0.05;

struct PressedPair {
  double air_force_n = 0;    ///< largest on the way through free air; 0 is right
  double press_force_n = 0;  ///< largest while it is pressed
  bool touched = false;      ///< felt to touch while it is pressed
  std::string fault;         ///< what is wrong, a sentence; empty: nothing
};

/// Moves the part from its start by kAirWay_m against z of W and back, where nothing may be; then
/// to the fixed part, along z or to its nearest place, presses it once and comes back. `scene`: an
/// aligned compiled scene whose fixed parts all lie above the part; `name` is for messages.
/// Cost: about 2000 ticks, and those of the search for the touch.
[[nodiscard]] PressedPair press_pair(std::span<const std::byte> scene, const std::string& name);

}  // namespace haptic::sim
