// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Time of one tick, per input: the least of several runs from the same state, then figures over
/// the inputs.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

struct TickTime {
  double core_ns = 0;        ///< least of the repeats
  double exhaustive_ns = 0;  ///< of the plain search of all pairs, least of the repeats
  bool contact = false;
  bool relocalised = false;
  ContactSituation situation = ContactSituation::kNone;
  double d_near_m = 0;
  std::uint32_t flags = 0;  ///< StepFlag
  StepCounters counters;    ///< its work
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
      noise;        ///< a repeat's time less the least one of its input: the machine, not the code
  TimeFigures raw;  ///< every repeat of every tick as it was
  std::vector<double> raw_ns;  ///< those, tick by tick
  double clock_empty_ns = 0;
  std::uint32_t repeats = 0;
  /// The same poses met with every bound stale, as after a jump there: the worst miss.
  TimeFigures stale;
  StepCounters peaks;          ///< largest counts over all these ticks
  double dearest_unit_ns = 0;  ///< of the stale ticks with much work: time over work
  /// Largest time over proxy_units of the ticks with much work of the proxy. Both charge the whole
  /// time of a tick to their own units and are too large rather than too small.
  double dearest_proxy_unit_ns = 0;
};

[[nodiscard]] TimeFigures figures(std::vector<double> values);

/// `goal`: what the timed ticks search; D_near of each comes from a run of its own that asks for
/// it. Every repeat is a whole run from the reset core; the same input gives the same state, so the
/// repeats of a tick do the same work. The exhaustive search evaluates every node of every pair in
/// plain double and returns D_near alone; without `exhaustive_too` it is left out and its figures
/// stay empty. @throws tools::InputError: no ticks or no repeats.
[[nodiscard]] WcetResult measure(CoreSession& session, std::span<const MotionSample> motion,
                                 std::uint32_t repeats, bool exhaustive_too = true,
                                 GoalContact goal = GoalContact::kLeftOut);

}  // namespace haptic::sim
