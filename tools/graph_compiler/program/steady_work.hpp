// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The speed certificate of a scene: how many faces and edges of a pair the loop has to look at in
/// a tick while the hand keeps within the motion limits. A figure from sampled poses, never a
/// proof: the proof is the count of all faces and edges, which the bounds of a tick hold. It is of
/// the contact search alone: what law kProxy adds is bounded by its passes, however slow the hand.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

/// Bounds of faces and edges that the loop renews in every tick, in turn.
inline constexpr std::uint32_t kRenewedPerTick = 16;

/// One pair in contact, over the sampled poses.
struct PairSteadyWork {
  std::uint32_t features = 0;   ///< faces and edges of both pieces
  std::uint32_t age_ticks = 0;  ///< oldest bound when all features are renewed in turn alone
  double motion_m = 0.0;        ///< of any point of the piece of A in one tick
  /// Features whose bounds, if all were of that age, could not be passed over.
  std::uint32_t median = 0, largest = 0;
  /// Renewals per tick when a bound is renewed only once motion has used up its distance from the
  /// best: the sum over the features of 2 motion over that distance, at most 1 each.
  double renewed_median = 0.0, renewed_largest = 0.0;
};

struct SteadyWork {
  std::uint64_t seed = 0;
  std::uint32_t samples = 0;  ///< poses per pair
  std::vector<PairSteadyWork> pairs;
};

/// Samples random orientations with the pieces of each pair in contact, half of them vertex on
/// vertex, half on a random point of a random face. In every pose it counts the faces and edges
/// whose best plane lies within relaxation + 2 age motion of the best of all. Same scene, same
/// figures. Empty when the scene has no motion limits, or its part never turns: then a tick goes
/// over the planes of a pair, all of them. Cost: seconds at most for pieces of hundreds of
/// vertices, O(samples E V) per pair.
std::optional<SteadyWork> steady_work(const SceneView& scene);

}  // namespace haptic::tools
