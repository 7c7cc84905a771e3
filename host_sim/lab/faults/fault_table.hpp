// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must happen at each fault in each state: the stated failure semantics of the device side.

#include <cstdint>
#include <span>
#include <string>

#include "host_sim/device/device_fault.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/safety/safety_limits.hpp"

namespace haptic::sim {

// One cell of the fault matrix: a state of the operator and the device, and what then fails.

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
  kOtherDevice,      ///< power lost, then plugged in again with weaker_block()
  kEmergencyCall,    ///< the call of the servo loop
  kLinkStop,         ///< the call of the link
  kSuspended,        ///< the machine sleeps and wakes
  kFirmwareRestart,  ///< the device's counters start again, it does not leave the bus
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
  [[nodiscard]] bool moves_hand() const {
    return cause == FaultCause::kWorkspaceLeft || cause == FaultCause::kEnvelopeLeft;
  }
  /// Whether it exists without a bus.
  [[nodiscard]] bool without_bus() const {
    return cause != FaultCause::kBus && cause != FaultCause::kHoldOut &&
           cause != FaultCause::kPowerLost && cause != FaultCause::kOtherDevice &&
           cause != FaultCause::kLinkStop && cause != FaultCause::kSuspended &&
           cause != FaultCause::kFirmwareRestart;
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

/// What the hand feels of a fault at full force.
enum class FaultOutput : std::uint8_t {
  kUnchanged = 0,  ///< except for an output that is missed or comes late
  kDips,           ///< then comes back within the slew limit
  kBounded,        ///< follows what is asked, within force and slew limits
  kRampsToZero,    ///< and stays there until armed again
  kCut             ///< the device takes its drives off itself; zero until armed again
};
[[nodiscard]] const char* to_text(FaultOutput output);

/// Failure semantics of one fault, as it is with the device calibrated and reporting.
struct FaultRule {
  const char* fault;  ///< Fault::name
  const char* noticed_by;
  FaultOutput output = FaultOutput::kUnchanged;
  std::uint32_t safety = 0;  ///< SafetyFault that latch
  std::uint32_t device = 0;  ///< DeviceFault that the servo tick gets, at any time
  unsigned noticed_ms = 0;   ///< from the fault to the begin of the ramp, or to the device's cut
  const char* cleared_by;    ///< apart from releasing the deadman switch and pressing it again
};
/// One rule for each of faults(), in their order.
[[nodiscard]] std::span<const FaultRule> fault_rules();

/// What a cell must show.
struct FaultExpectation {
  FaultOutput output = FaultOutput::kUnchanged;
  std::uint32_t safety = 0;      ///< latched at the end of the watch
  std::uint32_t safety_may = 0;  ///< and these too, or not
  std::uint32_t device = 0;      ///< reported during the watch
  double zero_within_s = 0;      ///< of what acts at the device; outputs that end at zero
};
/// `linked`: there is a bus, and a link that tells of its own faults.
[[nodiscard]] FaultExpectation expectation_of(const FaultCase& cell, const SafetyLimits& limits,
                                              bool linked);

/// Names of the bits, joined by " + "; "-" for none.
[[nodiscard]] std::string safety_fault_names(std::uint32_t faults);
[[nodiscard]] std::string device_fault_names(std::uint32_t faults);

/// fault_rules() as a Markdown table; faults with equal rules share a row. Latched: SafetyFault, in
/// brackets what the servo tick gets (DeviceFault).
[[nodiscard]] std::string failure_semantics();

}  // namespace haptic::sim
