// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fits with friction in which a hand wanders about, for studies of what it feels on the way.

#include <string>
#include <vector>

#include "host_sim/lab/friction/fit_scenes.hpp"

namespace haptic::sim {

/// A fit and the hand in it: about a place, by so much along each axis and so much turn.
struct WanderScene {
  std::string name, text;  ///< of the scene file, up to [rendering]
  std::vector<OutputText> files;
  Vector home_m = Vector::Zero(), wander_m = Vector::Zero();
  double wander_rad = 0;
};

/// Eleven of them: grooves, slots, holes, open faces, a corner, tubes, a nut.
[[nodiscard]] std::vector<WanderScene> wander_scenes();

}  // namespace haptic::sim
