// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One cell of the fault matrix, run: the whole stack over a simulated device, a cube that a
/// simulated hand presses on a wall. The state is reached, the fault comes, its cause goes, and the
/// operator takes force again.

#include <cstddef>
#include <span>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/faults/fault_case.hpp"

namespace haptic::sim {

/// Watched from the fault on, before anything is mended [periods].
inline constexpr std::size_t kFaultWatch = 300;

struct FaultSettings {
  StackCarrier carrier = StackCarrier::kUsb;
  bool report_clocked = false;
  /// Of the stack; what is judged are the reference device's own (reference_stack).
  double slew_factor = 1;
  double ramp_in_factor = 1;
};

/// One period.
struct FaultSample {
  std::vector<StackSend> sent;
  Load acting;
  std::uint32_t accepted = 0;  ///< sequence of the command that the device has accepted last
  bool drives_on = false;
  std::uint32_t watchdog_cuts = 0;
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t safety = 0;  ///< SafetyFault, latched
  std::uint32_t device = 0;  ///< DeviceFault, as the servo tick was told
  LinkState link = LinkState::kAbsent;
};

/// A run; sample k is the k-th period of the device. Indices are of the first sample after the
/// action that they name.
struct FaultTrace {
  double period_s = 0;
  std::vector<FaultSample> samples;
  std::size_t injected = 0;  ///< the fault
  std::size_t mended = 0;    ///< its cause gone, plugged in again, the deadman let go
  std::size_t pressed = 0;   ///< the deadman, on the wall
};

/// Compiled scene of all cells: the cube and the wall.
[[nodiscard]] std::vector<std::byte> fault_scene();

/// Same arguments, same bits. `scene`: fault_scene(). @throws tools::InputError  the state is not
/// reached, or the fault needs a bus that the carrier is not.
[[nodiscard]] FaultTrace run_fault(std::span<const std::byte> scene, const FaultCase& cell,
                                   const FaultSettings& settings);

}  // namespace haptic::sim
