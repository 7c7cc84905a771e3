// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_table.hpp"

#include <array>
#include <cstddef>
#include <utility>

#include "rt_core/safety/arming.hpp"
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
    {"another device plugged in", FaultCause::kOtherDevice, {}},
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
    {"emergency stop of the link", FaultCause::kLinkStop, {}},
    {"machine suspended", FaultCause::kSuspended, {}},
    {"firmware restarted", FaultCause::kFirmwareRestart, {}},
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

using Out = FaultOutput;

/// SafetyLimits::lost_periods, one to find it and one to act.
constexpr unsigned kStale_ms = 7;
constexpr unsigned kWatchdog_ms = 20;  ///< of the reference device
constexpr unsigned kHandMoves_ms = 100;
constexpr std::uint32_t kDeviceSays = 0xffff;  // of DeviceFault; the rest is the link's
constexpr std::uint32_t kGone = kFaultDeviceLost | kFaultDevice;
constexpr std::uint32_t kUnfed = kLinkLost | kDeviceWatchdogCut;

constexpr const char* kOneMissed = "one report or command missed; made good by the next";
constexpr const char* kShortGap = "age of state or command over held_periods";
constexpr const char* kStaleOnly = "age of the state over lost_periods";
constexpr const char* kTransfers = "age of the state; more than 10 failed transfers in a row";
constexpr const char* kSends = "sends that fail; more than 10 in a row";
constexpr const char* kCommandAge = "output guard: age of the command over lost_periods";

constexpr const char* kNothing = "-";
constexpr const char* kPlugged = "plugged in again";
constexpr const char* kReconnected = "the link reconnects by itself";
constexpr const char* kGoodReport = "a good report";
constexpr const char* kGoodCommand = "a good command";

constexpr FaultRule kRules[] = {
    {"none", kNothing, Out::kUnchanged, 0, 0, 0, kNothing},
    {"unplug in flight", "a transfer that ends without a device", Out::kCut, kGone, kLinkLost,
     kWatchdog_ms, kPlugged},
    {"unplug at resubmit", "the code of the next submit", Out::kCut, kGone, kLinkLost, kWatchdog_ms,
     kPlugged},
    {"power lost", "a transfer that ends without a device", Out::kCut, kGone, kLinkLost, 0,
     kPlugged},
    {"another device plugged in", "what it states of itself", Out::kCut, kGone,
     kLinkLost | kLinkOtherDevice, 0, kNothing},
    {"stall in 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"stall in 100", kTransfers, Out::kRampsToZero, kFaultStaleState | kGone, kUnfed, kStale_ms,
     kReconnected},
    {"stall out 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"stall out 100", kSends, Out::kCut, kGone, kUnfed | kLinkSendFailed | kLinkDeaf, kWatchdog_ms,
     kReconnected},
    {"babble 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"babble 100", kTransfers, Out::kRampsToZero, kFaultStaleState | kGone, kUnfed, kStale_ms,
     kReconnected},
    {"bus error in 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"bus error in 100", kTransfers, Out::kRampsToZero, kFaultStaleState | kGone, kUnfed, kStale_ms,
     kReconnected},
    {"bus error out 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"bus error out 100", kSends, Out::kCut, kGone, kUnfed | kLinkSendFailed | kLinkDeaf,
     kWatchdog_ms, kReconnected},
    {"submit refused in 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"submit refused in 100", kTransfers, Out::kRampsToZero, kFaultStaleState | kGone, kUnfed,
     kStale_ms + 3, kReconnected},  // first those that are queued already
    {"submit refused out 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"submit refused out 100", kSends, Out::kCut, kGone, kUnfed | kLinkSendFailed | kLinkDeaf,
     kWatchdog_ms, kReconnected},
    {"out never taken", "a send in flight for longer than silence_ns", Out::kCut, kGone,
     kUnfed | kLinkSendFailed | kLinkDeaf, kWatchdog_ms, kReconnected},
    {"short 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"short 10", "five bad reports in a row; age of the state", Out::kRampsToZero,
     kFaultStaleState | kFaultDevice, kLinkCorrupt, kStale_ms, kGoodReport},
    {"long 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"long 10", kStaleOnly, Out::kRampsToZero, kFaultStaleState, 0, kStale_ms, kGoodReport},
    {"corrupt 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"corrupt 10", "five bad reports in a row; age of the state", Out::kRampsToZero,
     kFaultStaleState | kFaultDevice, kLinkCorrupt, kStale_ms, kGoodReport},
    {"lost 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"lost 3", kShortGap, Out::kDips, 0, 0, 0, kNothing},
    {"lost 50", "age of the state; silence", Out::kRampsToZero, kFaultStaleState | kFaultDevice,
     kLinkSilent, kStale_ms, kGoodReport},
    {"doubled", "a sequence that is not newer: dropped", Out::kUnchanged, 0, 0, 0, kNothing},
    {"reordered", "a sequence that is not newer: dropped", Out::kUnchanged, 0, 0, 0, kNothing},
    {"late by 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"late by 3", kShortGap, Out::kDips, 0, 0, 0, kNothing},
    {"late by 10", kStaleOnly, Out::kRampsToZero, kFaultStaleState, 0, kStale_ms, kGoodReport},
    {"late by 50", "age of the state; silence", Out::kRampsToZero, kFaultStaleState | kFaultDevice,
     kLinkSilent, kStale_ms, kGoodReport},
    {"frozen 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"frozen 100", "age of the state; ten reports that are not newer", Out::kRampsToZero,
     kFaultStaleState | kFaultDevice, kLinkFrozen, kStale_ms, kGoodReport},
    {"encoder jump 1 mm", "nothing: a hand can be as fast", Out::kUnchanged, 0, 0, 0, kNothing},
    {"encoder jump 30 mm", "no hand is as fast", Out::kRampsToZero, kFaultJump, 0, 0, kGoodReport},
    {"emergency stop of the device", "the device; its report", Out::kCut, kFaultEmergencyStop,
     kDeviceEmergencyStop, 0, "the button released"},
    {"emergency stop by call", "the servo tick", Out::kRampsToZero, kFaultEmergencyStop, 0, 0,
     kNothing},
    {"emergency stop of the link", "DeviceLink::emergency_stop", Out::kRampsToZero,
     kFaultEmergencyStop, kLinkStopCalled, 0, kNothing},
    {"machine suspended", "CLOCK_BOOTTIME against CLOCK_MONOTONIC", Out::kRampsToZero, kFaultDevice,
     kLinkSuspended, 0, kNothing},
    {"firmware restarted", "five reports that advance behind the last one", Out::kCut, kFaultDevice,
     kDeviceDriveFault, 0, kGoodReport},
    {"device deaf", "ten reports by which it has accepted nothing; its own watchdog", Out::kCut,
     kFaultDevice, kDeviceWatchdogCut | kLinkDeaf, kWatchdog_ms, "a command that it hears"},
    {"overheated", "the device's report", Out::kRampsToZero, kFaultDevice, kDeviceOverheated, 0,
     "the device"},
    {"drive fault", "the device; its report", Out::kCut, kFaultDevice, kDeviceDriveFault, 0,
     "the device"},
    {"calibration lost", "the device; its report", Out::kCut, kGone, kDeviceNotHomed, 0,
     "calibrated again"},
    {"servo stalled 1", kOneMissed, Out::kUnchanged, 0, 0, 0, kNothing},
    {"servo stalled 3", kShortGap, Out::kDips, 0, 0, 0, kNothing},
    {"servo stalled 10", "output guard: age of the command; the late tick itself",
     Out::kRampsToZero, kFaultLateTick | kFaultDevice, kLinkStaleCommand, kStale_ms, kGoodCommand},
    {"servo stalled 100", "output guard: age of the command; the late tick itself",
     Out::kRampsToZero, kFaultLateTick | kFaultDevice, kLinkStaleCommand, kStale_ms, kGoodCommand},
    {"servo says NaN", kCommandAge, Out::kRampsToZero, kFaultDevice, kLinkStaleCommand, kStale_ms,
     kGoodCommand},
    {"servo says too much", "output guard: limits alone", Out::kBounded, 0, 0, 0, kNothing},
    {"servo says a jump", "output guard: slew limit alone", Out::kDips, 0, 0, 0, kNothing},
    {"servo stamps old", kCommandAge, Out::kRampsToZero, kFaultDevice, kLinkStaleCommand, kStale_ms,
     kGoodCommand},
    {"servo process lost", "UsbLink::servo_lost; its successor's start inside an obstacle",
     Out::kRampsToZero, kFaultDevice | kFaultScene, kLinkStaleCommand | kLinkServoLost, 0,
     "another servo process"},
    {"workspace left", "the servo tick, one tick ahead", Out::kRampsToZero, kFaultWorkspace, 0,
     kHandMoves_ms, "the hand comes back"},
    {"envelope left", "the servo tick, one tick ahead", Out::kRampsToZero, kFaultEnvelope, 0,
     kHandMoves_ms, "the hand comes back"},
    {"deadman released", "the servo tick", Out::kRampsToZero, 0, 0, 0, kNothing}};

using Names = std::span<const std::pair<std::uint32_t, const char*>>;

constexpr std::pair<std::uint32_t, const char*> kSafetyNames[] = {
    {kFaultNotFinite, "kFaultNotFinite"},         {kFaultBadPose, "kFaultBadPose"},
    {kFaultStaleState, "kFaultStaleState"},       {kFaultLateTick, "kFaultLateTick"},
    {kFaultDeviceLost, "kFaultDeviceLost"},       {kFaultDevice, "kFaultDevice"},
    {kFaultEmergencyStop, "kFaultEmergencyStop"}, {kFaultScene, "kFaultScene"},
    {kFaultInternal, "kFaultInternal"},           {kFaultEnvelope, "kFaultEnvelope"},
    {kFaultWorkspace, "kFaultWorkspace"},         {kFaultJump, "kFaultJump"},
    {kFaultSequence, "kFaultSequence"},           {kFaultFrame, "kFaultFrame"}};

constexpr std::pair<std::uint32_t, const char*> kDeviceNames[] = {
    {kDeviceEmergencyStop, "kDeviceEmergencyStop"},
    {kDeviceWatchdogCut, "kDeviceWatchdogCut"},
    {kDeviceOverheated, "kDeviceOverheated"},
    {kDeviceDriveFault, "kDeviceDriveFault"},
    {kDeviceNotHomed, "kDeviceNotHomed"},
    {kDeviceRefused, "kDeviceRefused"},
    {kLinkLost, "kLinkLost"},
    {kLinkSilent, "kLinkSilent"},
    {kLinkCorrupt, "kLinkCorrupt"},
    {kLinkFrozen, "kLinkFrozen"},
    {kLinkStaleCommand, "kLinkStaleCommand"},
    {kLinkServoLost, "kLinkServoLost"},
    {kLinkSendFailed, "kLinkSendFailed"},
    {kLinkOtherDevice, "kLinkOtherDevice"},
    {kLinkStopCalled, "kLinkStopCalled"},
    {kLinkSuspended, "kLinkSuspended"},
    {kLinkDeaf, "kLinkDeaf"}};

std::string names_of(std::uint32_t faults, Names names) {
  std::string text;
  for (const auto& [bit, name] : names) {
    if ((faults & bit) != 0) text += (text.empty() ? "" : " + ") + std::string(name);
    faults &= ~bit;
  }
  if (faults != 0) text += (text.empty() ? "" : " + ") + std::string("unnamed bits");
  return text.empty() ? "-" : text;
}

const FaultRule& rule_of(const Fault& fault) {
  for (const FaultRule& rule : kRules) {
    if (std::string(rule.fault) == fault.name) return rule;
  }
  throw tools::InputError(std::string(fault.name) + ": no rule says what must happen");
}

bool takes_device_away(const Fault& fault) {
  const DeviceFaultKind kind = fault.event.kind;
  const bool unplugs =
      kind == DeviceFaultKind::kUnplug || kind == DeviceFaultKind::kUnplugAtResubmit;
  return fault.cause == FaultCause::kPowerLost || fault.cause == FaultCause::kOtherDevice ||
         (fault.cause == FaultCause::kBus && unplugs);
}

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

const char* to_text(FaultOutput output) {
  static constexpr std::array<const char*, 5> kTexts = {"unchanged", "dips and comes back",
                                                        "within force and slew limits",
                                                        "ramps to zero", "cut by the device"};
  return kTexts[static_cast<std::size_t>(output)];
}

std::span<const FaultRule> fault_rules() { return kRules; }

FaultExpectation expectation_of(const FaultCase& cell, const SafetyLimits& limits, bool linked) {
  const FaultRule& rule = rule_of(*cell.fault);
  const FaultCause cause = cell.fault->cause;
  FaultExpectation e{rule.output, rule.safety, 0, rule.device, 0};
  // The newest report may follow at once on one that is tens of periods old: the hand has moved.
  if (std::string(rule.fault) == "late by 50") e.safety_may = kFaultJump;
  if (!linked) {
    e.device &= kDeviceSays;
    if (e.device == 0) e.safety &= ~kFaultDevice;
  }
  switch (cell.state) {
    case FaultState::kAbsent:  // there is neither device nor bus that could be at fault
      e.safety &= kFaultEmergencyStop | kFaultLateTick;
      if (cause == FaultCause::kBus || cause == FaultCause::kLinkStop) e.safety = 0;
      // Told as soon as there is a device.
      e.device = 0;
      break;
    case FaultState::kStarting:  // its poses mean nothing yet, its drives are off
      e.safety = (e.safety & (kFaultEmergencyStop | kFaultLateTick)) | kFaultDevice;
      e.device &= ~kDeviceWatchdogCut;
      if (!takes_device_away(*cell.fault)) e.device |= kDeviceNotHomed;
      break;
    case FaultState::kArmedFree:
      e.safety &= ~kFaultScene;
      break;
    case FaultState::kClutched:  // the part stays where it is, wherever the hand goes
      if (cell.fault->moves_hand()) e = {};
      break;
    case FaultState::kFaulted:
      // What was latched before went with the process that held it.
      if (cause != FaultCause::kServoLost) e.safety |= kFaultEmergencyStop;
      break;
    default:
      break;
  }
  // Never armed, the guard lets nothing pass.
  const bool never_armed = cell.state == FaultState::kAbsent ||
                           cell.state == FaultState::kStarting ||
                           cell.state == FaultState::kDisarmed;
  if (never_armed && e.output == FaultOutput::kBounded) e.output = FaultOutput::kUnchanged;
  const double period_s = 1e-9 * static_cast<double>(limits.period_ns);
  e.zero_within_s = 1e-3 * rule.noticed_ms + 2 * period_s;
  if (e.output == FaultOutput::kRampsToZero)
    e.zero_within_s += static_cast<double>(longest_ramp_s(limits));
  return e;
}

std::string safety_fault_names(std::uint32_t faults) { return names_of(faults, kSafetyNames); }
std::string device_fault_names(std::uint32_t faults) { return names_of(faults, kDeviceNames); }

std::string failure_semantics() {
  std::string table =
      "| fault | noticed by | output | latched as | cleared by |\n|---|---|---|---|---|\n";
  std::array<bool, std::size(kRules)> written{};
  for (std::size_t k = 1; k < std::size(kRules); ++k) {
    if (written[k]) continue;
    const FaultRule& rule = kRules[k];
    const auto row = [](const FaultRule& r) {
      std::string latched = safety_fault_names(r.safety);
      if (r.device != 0) latched += " (" + device_fault_names(r.device) + ")";
      return " | " + std::string(r.noticed_by) + " | " + to_text(r.output) + " | " + latched +
             " | " + r.cleared_by + " |\n";
    };
    std::string names = rule.fault;
    for (std::size_t other = k + 1; other < std::size(kRules); ++other) {
      if (written[other] || row(kRules[other]) != row(rule)) continue;
      names += ", " + std::string(kRules[other].fault);
      written[other] = true;
    }
    table += "| " + names + row(rule);
  }
  return table;
}

}  // namespace haptic::sim
