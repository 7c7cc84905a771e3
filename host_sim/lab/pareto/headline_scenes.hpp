// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes and motions on which the default law is compared with what it could be replaced by: a
/// square peg, a round peg, pins among posts, a lid on a bin. The hand enters, presses, slides and
/// wobbles, with a tremor. Made here, without files.

#include <string>
#include <vector>

#include "host_sim/lab/peers/penalty_peer.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

/// Samples of the hand in one tick of 1 ms: the reference takes all, every other method the last.
inline constexpr std::uint32_t kHeadlineSubsteps = 4;
/// Of all scenes and methods: k_F of the laws that sum over contacts, k_t of the coupling, and what
/// each contact of a penalty pushes with.
inline constexpr double kHeadlineStiffness_n_per_m = 1000;

struct HeadlineScene {
  std::string name;                     ///< for files: letters, digits, underscores
  std::string title;                    ///< in words
  tools::SceneDescription description;  ///< law proxy, default coupling
  PenaltyBodies bodies;                 ///< the same pieces
  std::vector<MotionSample> goals;      ///< kHeadlineSubsteps per tick; the first is free

  [[nodiscard]] std::size_t pairs() const { return bodies.moving.size() * bodies.fixed.size(); }
  [[nodiscard]] std::size_t ticks() const { return (goals.size() - 1) / kHeadlineSubsteps + 1; }
};

/// All four, 5, 33, 625 and 361 pairs of pieces. `quick`: the same way in a sixth of the time.
[[nodiscard]] std::vector<HeadlineScene> headline_scenes(bool quick);

}  // namespace haptic::sim
