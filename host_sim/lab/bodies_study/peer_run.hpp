// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The cases of size by a physics engine in place of the law, with its bodies judged from vertices
/// alone as those of the law are.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_study/cost_cases.hpp"

namespace haptic::sim {

/// A way to use the engine: "default", "stiff", "fine". None where it was not found at the build.
struct BodiesPeerWay {
  std::string name, words;
  bool stiff = false;
  unsigned steps = 1;  ///< of its own in a tick
};
[[nodiscard]] const std::vector<BodiesPeerWay>& bodies_peer_ways();
/// "MuJoCo 2.2.2", or that it was not found and how to get it.
[[nodiscard]] std::string bodies_peer_words();

struct BodiesPeerRun {
  std::vector<double> ns;  ///< by tick: its steps, with the springs
  std::uint64_t state_hash = 0;
  std::vector<std::vector<BodyPlace>> places;  ///< by tick
};
/// @throws tools::UsageError for a way that there is not; what the engine refuses.
[[nodiscard, gnu::noinline]] BodiesPeerRun run_bodies_peer(const BodiesCostCase& of,
                                                           const std::string& way,
                                                           std::size_t ticks);

}  // namespace haptic::sim
