// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Instructions that a tick executes, counted exactly by running the motion once more under
/// valgrind's callgrind. They belong to the program and its input: no clock, no cache and no other
/// program of the machine has a say, and a second count gives the same numbers.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/wcet/callgrind_profile.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// Runs a motion from the reset core. @return the state hash after it. The count begins with its
/// call: a program may have used its core before, to make the motion.
[[gnu::noinline]] std::uint64_t run_once(CoreSession& session, std::span<const MotionSample> motion,
                                         GoalContact goal = GoalContact::kLeftOut);

/// A program that gives the motion to run_once and prints its ticks and hash, as `host_sim wcet
/// --once` does.
struct InstructionQuestion {
  std::string program;                 ///< path of it; empty: not to be counted
  std::vector<std::string> arguments;  ///< e.g. wcet --once --scene S --motion M
  std::uint64_t state_hash = 0;        ///< that the run must end in
  std::size_t ticks = 0;               ///< that it must have
};

struct InstructionCounts {
  bool measured = false;
  std::string why_not;  ///< in words, where not measured
  CallgrindProfile profile;
  std::uint64_t median = 0, largest = 0;
};

/// Runs the program under valgrind, its profile in a folder of its own under the temporary one that
/// is removed. Where valgrind is missing or fails, or the run does not end in the state asked for,
/// the result says why instead. Cost: some fifty times the time of the ticks, and 10 kB of
/// temporary file per tick.
[[nodiscard]] InstructionCounts count_instructions(const InstructionQuestion& question);

/// Lines of the report: median and largest, and by function of the whole run and of the most
/// expensive tick, the functions with the largest share first. Or why they were not measured.
[[nodiscard]] std::string instruction_table(const InstructionCounts& counts);

}  // namespace haptic::sim
