// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fits with friction in which a hand wanders about, for studies of what it feels on the way.

#include <cstdint>
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

/// A cell for each scene, friction and seed, the seeds of one scene together.
template <typename Cell>
[[nodiscard]] std::vector<Cell> cells_of(const std::vector<WanderScene>& scenes,
                                         const std::vector<double>& frictions,
                                         const std::vector<std::uint64_t>& seeds) {
  std::vector<Cell> cells;
  for (const WanderScene& scene : scenes) {
    for (const double friction : frictions) {
      for (const std::uint64_t seed : seeds) {
        Cell cell;
        cell.scene = scene.name;
        cell.friction = friction;
        cell.seed = seed;
        cells.push_back(cell);
      }
    }
  }
  return cells;
}

}  // namespace haptic::sim
