// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The cases of the cost of a tick of several bodies, run tick by tick: goals that press and slide,
/// the same in every build.

#include <cstdint>
#include <functional>
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
  std::function<std::vector<BodyPlace>(double t_s)> goals;
  std::uint32_t work_units = 0;  ///< budget of a tick; 0: none
  std::size_t contacts = 0;      ///< pairs of solids that touch while the bodies are pressed
};
/// All of them, without friction and then with it.
[[nodiscard]] std::vector<BodiesCostCase> bodies_cost_cases();
/// One to eight boxes, each drawn by a hand's spring: in the air, side by side on a table, one on
/// the other, and so in a corner; with the budget that a scene file has by default.
[[nodiscard]] std::vector<BodiesCostCase> bodies_size_cases();

/// Counters of a tick.
struct BodiesWork {
  std::uint64_t units = 0, dual_steps = 0, programs = 0, rows = 0;
  bool spent = false;  ///< it has ended for want of budget
};
struct BodiesCostRun {
  std::vector<BodiesWork> ticks;
  std::vector<double> ns;         ///< of each of them
  std::uint64_t units_bound = 0;  ///< of a tick; by the law of one part: 0
  std::uint64_t state_hash = 0;   ///< over the places in all ticks
};
/// Bodies press and slide from this tick on.
inline constexpr std::size_t kPressedTick = 150;
[[nodiscard]] inline std::size_t bodies_cost_ticks(bool is_short) { return is_short ? 250 : 750; }
[[nodiscard]] inline std::size_t bodies_size_ticks(bool is_short) { return is_short ? 200 : 450; }

/// @throws tools::InputError when a blob is refused.
[[nodiscard, gnu::noinline]] BodiesCostRun run_bodies_cost(const BodiesCostCase& of,
                                                           std::size_t ticks);
/// The case of this number, of the cases of cost and then of those of size, as a count of its
/// instructions runs it: prints ticks and hash. `peer`: the way of MuJoCo that it is given to
/// instead, by its name; empty: none.
void print_bodies_cost_run(std::size_t number, bool is_short, const std::string& peer);

}  // namespace haptic::sim
