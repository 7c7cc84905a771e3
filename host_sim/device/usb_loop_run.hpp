// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop on a device found on this machine's USB, in two threads and in real time, with
/// what its ticks and reports cost: whether the machine can do it, and what it does when a device
/// comes and goes.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/usb/usb_link.hpp"
#include "host_sim/commands/core_session.hpp"

namespace haptic::sim {

struct UsbLoopSettings {
  hal::UsbAddress address;
  std::uint64_t ticks = 3000;                  ///< measured, from the first armed one on
  std::int64_t period_ns = 0;                  ///< 0: the device's report period
  int servo_priority = 80, usb_priority = 79;  ///< SCHED_FIFO; 0: ordinary
  double patience_s = 20;                      ///< until the first armed tick
};

/// In the order of size: p50, p99, p99.9 and the largest [ns]. All 0 when nothing was measured.
struct Quantiles {
  std::uint64_t count = 0;
  std::array<std::int64_t, 4> at_ns{};
};
[[nodiscard]] Quantiles quantiles_of(std::vector<std::int64_t> values_ns);

struct UsbLoopAccount {
  std::uint64_t ticks = 0;
  /// By whole periods missed: in time, 1, 2 to 5, more.
  std::array<std::uint64_t, 4> late{};
  std::uint64_t armed_ticks = 0, contact_ticks = 0;
  std::uint32_t armings = 0;        ///< of the whole run
  std::uint32_t safety_faults = 0;  ///< SafetyFault, all that were latched while measured
  std::uint32_t device_faults = 0;  ///< DeviceFault, all that were shown while measured
  double largest_force_n = 0;       ///< commanded
  Quantiles lateness, tick, report_interval, send_interval, answer;
  std::uint64_t minor_faults = 0, major_faults = 0;  ///< page faults of the process meanwhile
  hal::LinkCounters link;
  int servo_error = 0, servo_priority_error = 0, usb_priority_error = 0, lock_error = 0;
  bool realtime_kernel = false;  ///< PREEMPT_RT
  std::string trouble;           ///< of the link, where the loop never armed
};

/// Runs until the ticks are measured, or nothing armed within the patience. @throws
/// std::runtime_error  no thread could be made.
[[nodiscard]] UsbLoopAccount run_usb_loop(CoreSession& session, const UsbLoopSettings& settings);

}  // namespace haptic::sim
