// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_case.hpp"

#include <cstddef>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

using Kind = DeviceFaultKind;

constexpr DeviceFaultEvent on_bus(Kind kind, unsigned count = 1, double amount = 0,
                                  bool out_endpoint = false) {
  return {kind, 0, count, amount, out_endpoint};
}

/// Causes without a kind of bus fault carry a count alone.
constexpr DeviceFaultEvent times(unsigned count) { return {Kind::kLost, 0, count, 0, false}; }

constexpr unsigned kForLong = 100;  ///< reports, transfers or periods: longer than any limit
constexpr double kImpossible_m = 0.03, kPossible_m = 0.001;  // way of a hand within a period

constexpr Fault kFaults[] = {
    {"none", FaultCause::kNothing, {}},
    {"unplug in flight", FaultCause::kBus, on_bus(Kind::kUnplug)},
    {"unplug at resubmit", FaultCause::kBus, on_bus(Kind::kUnplugAtResubmit)},
    {"power lost", FaultCause::kPowerLost, {}},
    {"stall in 1", FaultCause::kBus, on_bus(Kind::kStall)},
    {"stall in 100", FaultCause::kBus, on_bus(Kind::kStall, kForLong)},
    {"stall out 1", FaultCause::kBus, on_bus(Kind::kStall, 1, 0, true)},
    {"stall out 100", FaultCause::kBus, on_bus(Kind::kStall, kForLong, 0, true)},
    {"babble 1", FaultCause::kBus, on_bus(Kind::kBabble)},
    {"babble 100", FaultCause::kBus, on_bus(Kind::kBabble, kForLong)},
    {"bus error in 1", FaultCause::kBus, on_bus(Kind::kBusError)},
    {"bus error in 100", FaultCause::kBus, on_bus(Kind::kBusError, kForLong)},
    {"bus error out 1", FaultCause::kBus, on_bus(Kind::kBusError, 1, 0, true)},
    {"bus error out 100", FaultCause::kBus, on_bus(Kind::kBusError, kForLong, 0, true)},
    {"submit refused in 1", FaultCause::kBus, on_bus(Kind::kSubmitRefused)},
    {"submit refused in 100", FaultCause::kBus, on_bus(Kind::kSubmitRefused, kForLong)},
    {"submit refused out 1", FaultCause::kBus, on_bus(Kind::kSubmitRefused, 1, 0, true)},
    {"submit refused out 100", FaultCause::kBus, on_bus(Kind::kSubmitRefused, kForLong, 0, true)},
    {"out never taken", FaultCause::kHoldOut, {}},
    {"short 1", FaultCause::kBus, on_bus(Kind::kShort)},
    {"short 10", FaultCause::kBus, on_bus(Kind::kShort, 10)},
    {"long 1", FaultCause::kBus, on_bus(Kind::kLong)},
    {"long 10", FaultCause::kBus, on_bus(Kind::kLong, 10)},
    {"corrupt 1", FaultCause::kBus, on_bus(Kind::kCorrupt)},
    {"corrupt 10", FaultCause::kBus, on_bus(Kind::kCorrupt, 10)},
    {"lost 1", FaultCause::kBus, on_bus(Kind::kLost)},
    {"lost 3", FaultCause::kBus, on_bus(Kind::kLost, 3)},
    {"lost 50", FaultCause::kBus, on_bus(Kind::kLost, 50)},
    {"doubled", FaultCause::kBus, on_bus(Kind::kDoubled)},
    {"reordered", FaultCause::kBus, on_bus(Kind::kReordered)},
    {"late by 1", FaultCause::kBus, on_bus(Kind::kLate, 1, 1)},
    {"late by 3", FaultCause::kBus, on_bus(Kind::kLate, 1, 3)},
    {"late by 10", FaultCause::kBus, on_bus(Kind::kLate, 1, 10)},
    {"late by 50", FaultCause::kBus, on_bus(Kind::kLate, 1, 50)},
    {"frozen 1", FaultCause::kBus, on_bus(Kind::kFrozen)},
    {"frozen 100", FaultCause::kBus, on_bus(Kind::kFrozen, kForLong)},
    {"encoder jump 1 mm", FaultCause::kBus, on_bus(Kind::kEncoderJump, 1, kPossible_m)},
    {"encoder jump 30 mm", FaultCause::kBus, on_bus(Kind::kEncoderJump, 1, kImpossible_m)},
    {"emergency stop of the device", FaultCause::kBus, on_bus(Kind::kEmergencyStop, kForLong)},
    {"emergency stop by call", FaultCause::kEmergencyCall, {}},
    {"device deaf", FaultCause::kBus, on_bus(Kind::kDeaf, kForLong)},
    {"overheated", FaultCause::kDeviceBits, times(kDeviceOverheated)},
    {"drive fault", FaultCause::kDeviceBits, times(kDeviceDriveFault)},
    {"calibration lost", FaultCause::kDeviceBits, times(kDeviceNotHomed)},
    {"servo stalled 1", FaultCause::kServoStalled, times(1)},
    {"servo stalled 3", FaultCause::kServoStalled, times(3)},
    {"servo stalled 10", FaultCause::kServoStalled, times(10)},
    {"servo stalled 100", FaultCause::kServoStalled, times(100)},
    {"servo says NaN", FaultCause::kServoNotANumber, times(kForLong)},
    {"servo says too much", FaultCause::kServoHuge, times(kForLong)},
    {"servo says a jump", FaultCause::kServoJump, times(1)},
    {"servo stamps old", FaultCause::kServoOldStamp, times(kForLong)},
    {"servo process lost", FaultCause::kServoLost, times(kForLong)},
    {"workspace left", FaultCause::kWorkspaceLeft, {}},
    {"envelope left", FaultCause::kEnvelopeLeft, {}},
    {"deadman released", FaultCause::kDeadmanReleased, {}}};

}  // namespace

const char* to_text(FaultState state) {
  static constexpr const char* kTexts[] = {"absent",   "starting",   "disarmed",
                                           "arming",   "armed free", "armed in contact",
                                           "clutched", "disarming",  "faulted"};
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) == static_cast<std::size_t>(FaultState::kCount));
  return state < FaultState::kCount ? kTexts[static_cast<std::size_t>(state)] : "invalid state";
}

std::span<const Fault> faults() { return kFaults; }

const Fault& stack_fault_named(const std::string& name) {
  for (const Fault& fault : kFaults) {
    if (name == fault.name) return fault;
  }
  throw tools::InputError("no fault is called '" + name + "'");
}

}  // namespace haptic::sim
