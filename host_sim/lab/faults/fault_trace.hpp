// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What is kept of a cell of the fault matrix while it is played: one sample per period of the
/// device.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host_sim/device/device_stack.hpp"

namespace haptic::sim {

/// One period.
struct FaultSample {
  std::vector<StackSend> sent;
  Load acting;
  std::uint32_t acts = 0;      ///< sequence of the command that the device had when this began
  std::uint32_t accepted = 0;  ///< sequence of the command that the device has accepted last
  bool drives_on = false;
  std::uint32_t watchdog_cuts = 0;
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t safety = 0;  ///< SafetyFault, latched
  std::uint32_t device = 0;  ///< DeviceFault, as the servo tick got
  LinkState link = LinkState::kAbsent;
  /// How late the machine let the slowest of device, USB thread and servo thread be in this period
  /// [ns]; in virtual time 0. Delays that the fault itself brings about do not count.
  std::int64_t late_ns = 0;
};

/// A run; sample k is the k-th period of the device. Indices are of the first sample after the
/// action that they name.
struct FaultTrace {
  double period_s = 0;
  std::vector<FaultSample> samples;
  std::size_t injected = 0;  ///< the fault
  std::size_t mended = 0;    ///< its cause gone, plugged in again, the deadman switch released
  std::size_t pressed = 0;   ///< the deadman, on the wall
};

}  // namespace haptic::sim
