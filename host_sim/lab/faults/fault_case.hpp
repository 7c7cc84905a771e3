// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One cell of the fault matrix: a state of the operator and the device, and what then fails.

#include <cstdint>
#include <span>
#include <string>

#include "host_sim/device/device_fault.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::sim {

/// Where the stack is when the fault comes. In all but the first three the device is calibrated and
/// the operator has armed once.
enum class FaultState : std::uint8_t {
  kAbsent = 0,    ///< not on the bus since the start
  kStarting,      ///< on the bus, not calibrated
  kDisarmed,      ///< pressed on the wall, never armed
  kArming,        ///< pressed lightly, half way of the ramp in
  kArmedFree,     ///< armed, away from the wall
  kArmedContact,  ///< armed, pressed close to the largest force
  kClutched,      ///< as before, then the clutch held
  kDisarming,     ///< as before without the clutch, then half way of the ramp out
  kFaulted,       ///< as before, then an emergency stop is latched
  kCount
};
[[nodiscard]] const char* to_text(FaultState state);

/// By what means a fault is brought about.
enum class FaultCause : std::uint8_t {
  kNothing = 0,      ///< the run that others are compared with
  kBus,              ///< Fault::event
  kHoldOut,          ///< OUT transfers are not taken
  kPowerLost,        ///< the drives go with the device, which is away until it is plugged in again
  kEmergencyCall,    ///< the call of the servo loop
  kDeviceBits,       ///< the device says so itself: Fault::event.count is its bits
  kServoStalled,     ///< no tick for Fault::event.count periods
  kServoLost,        ///< its process ends; another begins after Fault::event.count periods
  kServoNotANumber,  ///< its commands are wrong for Fault::event.count periods: NaN
  kServoHuge,        ///< a million newtons
  kServoJump,        ///< the wrench turned round
  kServoOldStamp,    ///< stamped 100 ms ago
  kWorkspaceLeft,    ///< the hand goes sideways out of the box
  kEnvelopeLeft,     ///< the hand turns too far
  kDeadmanReleased
};

/// What fails.
struct Fault {
  const char* name;  ///< of files, tables and the README; no comma
  FaultCause cause = FaultCause::kNothing;
  DeviceFaultEvent event;  ///< FaultCause::kBus; else only its count
  /// Whether it exists without a bus.
  [[nodiscard]] bool without_bus() const {
    return cause != FaultCause::kBus && cause != FaultCause::kHoldOut &&
           cause != FaultCause::kPowerLost;
  }
};

/// All faults; the first is none.
[[nodiscard]] std::span<const Fault> faults();
/// By name. @throws tools::InputError  there is none.
[[nodiscard]] const Fault& stack_fault_named(const std::string& name);

struct FaultCase {
  FaultState state = FaultState::kDisarmed;
  const Fault* fault = nullptr;
};

}  // namespace haptic::sim
