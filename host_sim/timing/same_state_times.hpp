// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Wall time of ticks, each repeated from the very same bytes of state: at once after the last
/// repeat (warm), and with the caches flushed before each (flushed).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/timing/tick_times.hpp"

namespace haptic::sim {

/// Fewer repeats do not shake off the noise of a shared machine.
inline constexpr std::uint32_t kLeastRepeats = 7;

struct SameStateTick {
  std::size_t tick = 0;
  double warm_ns = 0, flushed_ns = 0;  ///< least of the repeats
};

struct SameStateTimes {
  std::vector<SameStateTick> ticks;   ///< ascending
  TimeFigures warm, flushed;          ///< over the least of each tick
  TimeFigures warm_raw, flushed_raw;  ///< over every repeat: the machine's noise is in its tail
  std::size_t worst_warm = 0, worst_flushed = 0;  ///< tick numbers
  std::uint32_t repeats = 0;
  std::size_t flushed_bytes = 0;
  bool same_result = true;  ///< every repeat of a tick ended in the same state hash
};

/// Runs `motion` from a reset core; `chosen` ticks (ascending, in range) are repeated `repeats`
/// times either way. Leaves the core after the last tick. Cost: ticks, and of each chosen one two
/// times `repeats` + 1 steps and as many copies of the state, `repeats` flushes.
/// @throws tools::InputError: fewer than kLeastRepeats repeats, or nothing chosen.
[[nodiscard]] SameStateTimes same_state_times(CoreSession& session,
                                              std::span<const MotionSample> motion,
                                              std::span<const std::size_t> chosen,
                                              std::uint32_t repeats,
                                              GoalContact goal = GoalContact::kLeftOut);

/// At most `most` of all ticks: the first, the `most / 4` slowest and the `most / 4` with most work
/// of an earlier measurement, and others evenly over the motion. Ascending.
[[nodiscard]] std::vector<std::size_t> telling_ticks(const WcetResult& times, std::size_t most);

}  // namespace haptic::sim
