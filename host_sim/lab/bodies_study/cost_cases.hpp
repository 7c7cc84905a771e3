// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The cases of the cost of a tick of several bodies, run tick by tick: goals that press and slide,
/// the same in every build.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_motion.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"

namespace haptic::sim {

struct BodiesCostCase {
  std::string name;
  bool of_one_part = false;  ///< by the law of one part: the first pair
  double friction = 0;
  BodiesScene scene;
  std::vector<BodyPlace> (*goals)(double t_s) = nullptr;
};
/// All of them, without friction and then with it.
[[nodiscard]] std::vector<BodiesCostCase> bodies_cost_cases();

/// Counters of a tick.
struct BodiesWork {
  std::uint64_t units = 0, dual_steps = 0, programs = 0, rows = 0;
};
struct BodiesCostRun {
  std::vector<BodiesWork> ticks;
  std::uint64_t state_hash = 0;  ///< over the places in all ticks
};
/// Bodies press and slide from this tick on.
inline constexpr std::size_t kPressedTick = 150;
[[nodiscard]] inline std::size_t bodies_cost_ticks(bool is_short) { return is_short ? 250 : 750; }

/// @throws tools::InputError when a blob is refused.
[[nodiscard, gnu::noinline]] BodiesCostRun run_bodies_cost(const BodiesCostCase& of,
                                                           std::size_t ticks);
/// The case of this number, as a count of its instructions runs it: prints ticks and hash.
void print_bodies_cost_run(std::size_t number, bool is_short);

}  // namespace haptic::sim
