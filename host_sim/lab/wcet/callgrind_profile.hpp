// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reads the profile that valgrind's callgrind writes of a run, one part per tick: instructions of
/// every function, exact and the same in every run.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace haptic::sim {

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

}  // namespace haptic::sim
