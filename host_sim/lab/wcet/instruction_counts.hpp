// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Instructions that a tick executes, counted exactly by running the motion once more under
/// valgrind's callgrind. They belong to the program and its input: no clock, no cache and no other
/// program of the machine has a say, and a second count gives the same numbers.

#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

// Reads the profile that valgrind's callgrind writes of a run, one part per tick: instructions of
// every function, exact and the same in every run.

/// Instructions of one function: its own, and with all that it calls.
struct FunctionCost {
  std::string name;  ///< demangled, parameters left out
  std::uint64_t self = 0, inclusive = 0;
};

struct CallgrindProfile {
  std::vector<std::uint64_t> per_tick;  ///< instructions, in the order of the ticks
  std::vector<FunctionCost> whole;      ///< of all ticks, by decreasing self cost
  std::vector<FunctionCost> dearest;    ///< of the tick with most instructions
  std::size_t dearest_tick = 0;         ///< the first of them
  std::uint64_t total = 0;
};

/// Parts that `--dump-after=FUNCTION` made are ticks; others must have cost nothing. What comes
/// before a part that `--dump-before=FUNCTION` made is dropped: ticks that prepare. Functions
/// without own instructions (callers of the tick) are left out.
/// @throws tools::InputError: no such part, or a part whose functions do not add up to its total.
/// Cost: one pass, memory of one part.
[[nodiscard]] CallgrindProfile read_callgrind(std::istream& stream, const std::string& name);

/// Runs a motion from the reset core. @return the state hash after it. The count begins with its
/// call: a program may have used its core before, to make the motion.
[[gnu::noinline]] std::uint64_t run_once(CoreSession& session, std::span<const MotionSample> motion,
                                         GoalContact goal = GoalContact::kLeftOut);

/// A program that gives the motion to run_once, or to a function of its own, and prints its ticks
/// and hash, as `host_sim wcet --once` does.
struct InstructionQuestion {
  std::string program;                 ///< path of it; empty: not to be counted
  std::vector<std::string> arguments;  ///< e.g. wcet --once --scene S --motion M
  std::uint64_t state_hash = 0;        ///< that the run must end in
  std::size_t ticks = 0;               ///< that it must have
  /// Demangled and in full, as callgrind has it.
  std::string tick = "haptic::HapticCore::step(haptic::StepInput const&)";
  std::string run = "haptic::sim::run_once(*";  ///< nothing before its call is counted
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
