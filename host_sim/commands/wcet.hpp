// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Time of one tick, per input: the least of several runs from the same state, then figures over
/// the inputs.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/commands/core_session.hpp"

namespace haptic::sim {

struct TickTime {
  double core_ns = 0;        ///< least of the repeats
  double exhaustive_ns = 0;  ///< of the plain search of all pairs, least of the repeats
  bool contact = false;
  bool relocalised = false;
};

/// Figures over a set of inputs [ns].
struct TimeFigures {
  std::size_t count = 0;
  double median = 0, p99 = 0, p999 = 0, largest = 0;
};

struct WcetResult {
  std::vector<TickTime> ticks;
  TimeFigures core, core_contact, core_free, core_after_first, exhaustive;
  std::size_t worst_tick = 0;  ///< of the core, after the first tick
  double first_tick_ns = 0;
  TimeFigures
      noise;  ///< a repeat's time less the least one of its input: the machine, not the code
  double clock_empty_ns = 0;
  std::uint32_t repeats = 0;
};

[[nodiscard]] TimeFigures figures(std::vector<double> values);

/// Every repeat of a tick starts from a byte copy of the core's state put back at its address, so
/// all repeats do the same work. The exhaustive search evaluates every node of every pair in plain
/// double and returns D_near alone.
[[nodiscard]] WcetResult measure(CoreSession& session, std::span<const MotionSample> motion,
                                 std::uint32_t repeats);

}  // namespace haptic::sim
