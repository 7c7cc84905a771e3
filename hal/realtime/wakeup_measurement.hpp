// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The machine's own wake-up latency, measured the way the servo loop sleeps: absolute deadlines in
/// a thread of that priority on that core, memory locked, idle states held off, and nothing done in
/// the tick.

#include <atomic>
#include <cstdint>

#include "hal/clock/linux_process.hpp"
#include "hal/realtime/histograms.hpp"

namespace haptic::hal {

struct WakeupQuestion {
  std::int64_t period_ns = 1'000'000;
  std::int64_t duration_ns = 2'000'000'000;
  int priority = 80;  ///< SCHED_FIFO asked for; 0: ordinary
  int cpu = -1;       ///< negative: any
};

struct WakeupMeasurement {
  int error = 0;  ///< errno of what kept it from running to its end: no thread, a sleep that failed
  int priority = 0;            ///< SCHED_FIFO that the thread had; 0: it was an ordinary one
  int cpu = -1;                ///< that it was tied to; negative: any
  bool memory_locked = false;  ///< page faults could not come from paging
  bool idle_states_held = false;
  WakeupHistogram lateness;
  std::uint64_t late_ticks = 0;      ///< woken a whole period late or more
  std::uint64_t missed_periods = 0;  ///< deadlines without a tick
  PageFaults faults;                 ///< of the thread, within the loop
};

/// Blocks for the duration. Starts one thread; locks the process's memory meanwhile and unlocks it
/// then, so not for a process that has locked it already.
void measure_wakeups(const WakeupQuestion& question, WakeupMeasurement& measurement) noexcept;

/// The same on the calling thread as it is: neither priority nor core of `question` is asked for,
/// nor is memory locked. Ends early once `stop` is set.
void count_wakeups(const WakeupQuestion& question, const std::atomic<bool>& stop,
                   WakeupMeasurement& measurement) noexcept;

}  // namespace haptic::hal
