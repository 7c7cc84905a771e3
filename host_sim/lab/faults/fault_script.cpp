// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_script.hpp"

#include <optional>
#include <string>
#include <utility>

#include "host_sim/device/usbfs_carrier.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// The stage's bus is the one inside this process.
UsbfsCarrier& in_process_bus(FaultStage& stage) {
  return dynamic_cast<UsbfsCarrier&>(stage.bus().carrier());
}

// Heights of the hand's target about touch. Without force the handle goes where the hand wants it:
// from the light target the pull is within the limits, so that it can be armed there.
constexpr double kFree_m = 0.005, kLight_m = -0.004, kFirm_m = -0.0185;
constexpr double kAside_m = 0.03, kTurned_rad = 0.5, kFarther_m = 0.02;

// Periods.
constexpr std::size_t kSettle = 40, kMove = 100, kRest = 150, kRampIn = 100;
constexpr std::size_t kHalfRampOut = 5, kClutch = 100, kLatch = 60, kReplug = 60, kRelease = 10,
                      kRecover = 300, kAway = 30;

constexpr std::uint32_t kDeadman = 1u << 0, kClutchSwitch = 1u << 1;
/// Samples of the longest script, with room.
constexpr std::size_t kMostSamples = 1500;

HandTarget target_at(double height_m, double aside_m = 0, double turned_rad = 0) {
  return {Vector(0, aside_m, kTouchHeight_m + height_m), rotation_of(Vector(0, 0, turned_rad))};
}

void move_hand(FaultStage& stage, const HandTarget& to, std::size_t periods) {
  const double now_s = stage.time_s();
  HandPlan& hand = stage.hand();
  hand.from = hand.at(now_s);
  hand.to = to;
  hand.begin_s = now_s;
  hand.end_s = now_s + static_cast<double>(periods) * stage.period_s();
}

class FaultScript {
 public:
  FaultScript(FaultStage& stage, const FaultCase& cell) : stage_(stage), cell_(cell) {
    trace_.period_s = stage.period_s();
    trace_.samples.reserve(kMostSamples);
  }

  FaultTrace play() {
    reach();
    stage_.leave_other();
    trace_.injected = trace_.samples.size();
    inject();
    trace_.cleared = trace_.samples.size();
    clear_fault();
    trace_.pressed = trace_.samples.size();
    press(kDeadman);
    recover();
    return std::move(trace_);
  }

 private:
  void pass(std::size_t periods);
  void move(const HandTarget& to, std::size_t periods) { move_hand(stage_, to, periods); }
  void press(std::uint32_t switches) { stage_.hand().switches = switches; }
  void expect(bool holds, const char* what) const;
  void arm_free();
  void press_firmly();
  void reach();
  void inject();
  void clear_fault();
  void recover();
  [[nodiscard]] ArmingState arming() const { return trace_.samples.back().arming; }

  FaultStage& stage_;
  FaultCase cell_;
  FaultTrace trace_;
};

void FaultScript::pass(std::size_t periods) {
  for (std::size_t k = 0; k < periods; ++k) {
    trace_.samples.push_back(stage_.step());
    if (const FaultSample* other = stage_.other()) trace_.others.push_back(*other);
  }
}

/// Beside another hand that is felt the part was left where it was, and is led from there.
void FaultScript::recover() {
  if (stage_.other() == nullptr) return pass(kRecover);
  pass(kRampIn + kSettle);
  move(target_at(kLight_m - kFarther_m), kMove);
  pass(kRecover - kRampIn - kSettle);
}

void FaultScript::expect(bool holds, const char* what) const {
  if (!holds) {
    throw tools::InputError("fault matrix, " + std::string(to_text(cell_.state)) +
                            ": the state is not reached: " + what);
  }
}

void FaultScript::arm_free() {
  press(kDeadman);
  pass(kRampIn + kSettle);
  expect(arming() == ArmingState::kArmed, "not armed");
}

void FaultScript::press_firmly() {
  arm_free();
  move(target_at(kFirm_m), kMove);
  pass(kMove + kRest);
  const SafetyLimits limits = reference_stack(StackCarrier::kDirect).limits;
  const double largest_n = static_cast<double>(limits.max_force_n);
  expect(trace_.samples.back().acting.force_w.norm() >= 0.8 * largest_n, "too little force");
}

void FaultScript::reach() {
  const FaultState state = cell_.state;
  if (state == FaultState::kAbsent) stage_.unplug();
  if (state == FaultState::kStarting) {
    stage_.bus().with_model([](auto& model) { model.set_faults(kDeviceNotHomed); });
  }
  pass(kSettle);
  switch (state) {
    case FaultState::kAbsent:
    case FaultState::kStarting:
      return;
    case FaultState::kDisarmed:
      move(target_at(kFirm_m), kMove);
      return pass(kMove + kRest);
    case FaultState::kArming:
      move(target_at(kLight_m), kMove);
      pass(kMove + kRest);
      press(kDeadman);
      pass(kRampIn / 2);
      return expect(arming() == ArmingState::kArming, "not arming");
    case FaultState::kArmedFree:
      return arm_free();
    default:
      break;
  }
  press_firmly();
  if (state == FaultState::kClutched) {
    press(kDeadman | kClutchSwitch);
    pass(kClutch);
    expect(arming() == ArmingState::kArmed, "not armed");
  }
  if (state == FaultState::kDisarming) {
    press(0);
    pass(kHalfRampOut);
    expect(arming() == ArmingState::kDisarming, "not disarming");
  }
  if (state == FaultState::kFaulted) {
    stage_.emergency_stop();
    pass(kLatch);
    expect(arming() == ArmingState::kFaulted, "not faulted");
  }
}

void FaultScript::inject() {
  const Fault& fault = *cell_.fault;
  std::size_t lasts = kFaultWatch;  ///< of what the script itself ends
  switch (fault.cause) {
    case FaultCause::kNothing:
      break;
    case FaultCause::kBus:
      stage_.bus().add(fault.event);
      break;
    case FaultCause::kHoldOut:
      in_process_bus(stage_).hold_out(true);
      break;
    case FaultCause::kPowerLost:
      stage_.bus().with_model([](auto& model) { model.drives_off(); });
      stage_.unplug();
      break;
    case FaultCause::kOtherDevice:
      stage_.bus().with_model([](auto& model) {
        model.drives_off();
        model.state_block(weaker_block());
      });
      stage_.unplug();
      pass(kAway);
      stage_.plug(true);
      return pass(kFaultWatch - kAway);
    case FaultCause::kEmergencyCall:
      stage_.emergency_stop();
      break;
    case FaultCause::kLinkStop:
      stage_.stop_link();
      break;
    case FaultCause::kSuspended:
      stage_.suspend();
      break;
    case FaultCause::kFirmwareRestart:
      stage_.bus().with_model([&](auto& model) {
        model.power_up();
        if (cell_.state == FaultState::kStarting) model.set_faults(kDeviceNotHomed);
      });
      break;
    case FaultCause::kDeviceBits:
      stage_.bus().with_model([&](auto& model) {
        const bool starting = cell_.state == FaultState::kStarting;
        model.set_faults(fault.event.count | (starting ? kDeviceNotHomed : 0u));
      });
      break;
    case FaultCause::kServoLost:
      stage_.lose_servo();
      lasts = fault.event.count;
      break;
    case FaultCause::kServoStalled:
      stage_.stall_servo(fault.event.count);
      lasts = fault.event.count;
      break;
    case FaultCause::kServoNotANumber:
    case FaultCause::kServoHuge:
    case FaultCause::kServoJump:
    case FaultCause::kServoOldStamp:
      stage_.spoil_commands(fault.cause);
      lasts = fault.event.count;
      break;
    case FaultCause::kWorkspaceLeft:
      move({stage_.hand().to.x0_w + Vector(0, kAside_m, 0), stage_.hand().to.q_wa}, kMove);
      break;
    case FaultCause::kEnvelopeLeft:
      move({stage_.hand().to.x0_w, rotation_of(Vector(0, 0, kTurned_rad))}, kMove);
      break;
    case FaultCause::kDeadmanReleased:
      press(0);
      break;
  }
  pass(lasts);
  if (lasts == kFaultWatch) return;
  if (fault.cause == FaultCause::kServoLost) {
    stage_.restart_servo();
  } else {
    stage_.release_servo();
  }
  pass(kFaultWatch - lasts);
}

/// The cause goes; the operator releases the switch and comes to where force can be taken.
void FaultScript::clear_fault() {
  const Fault& fault = *cell_.fault;
  // The clutch is held on the way: the goal stays where it was pressed in.
  press(cell_.state == FaultState::kClutched ? kClutchSwitch : 0);
  if (fault.cause == FaultCause::kHoldOut) in_process_bus(stage_).hold_out(false);
  if (fault.cause == FaultCause::kDeviceBits || cell_.state == FaultState::kStarting)
    stage_.bus().with_model([](auto& model) { model.set_faults(0); });
  const bool away =
      !trace_.samples.empty() && fault.without_bus() == false && !stage_.bus().carrier().plugged();
  if (away || cell_.state == FaultState::kAbsent)
    stage_.plug(fault.cause == FaultCause::kPowerLost);
  move(target_at(kLight_m), kMove);
  pass(kMove + kReplug);
  press(0);
  pass(kRelease);
}

}  // namespace

hal::ReferenceBlock weaker_block() {
  hal::ReferenceBlock block;
  block.max_force = 500'000;
  block.max_torque = 1'000'000;
  block.max_force_rate_mn_per_s = 500'000;
  block.max_torque_rate_mnm_per_s = 20'000;
  return block;
}

HandPlan hand_at_start() {
  HandPlan hand;
  hand.from = hand.to = target_at(kFree_m);
  return hand;
}

FaultTrace play_fault(FaultStage& stage, const FaultCase& cell) {
  return FaultScript(stage, cell).play();
}

void rest_after(FaultStage& stage, const FaultCase& cell) {
  const auto pass = [&stage](std::size_t periods) {
    for (std::size_t k = 0; k < periods; ++k) static_cast<void>(stage.step());
  };
  stage.hand().switches = 0;
  pass(kRelease);
  move_hand(stage, target_at(kFree_m), kMove);
  pass(kMove + kRest);
  // The clutch has moved the map.
  if (cell.fault != nullptr && cell.state == FaultState::kClutched) {
    stage.restart_servo();
    pass(kSettle);
  }
  const bool other = cell.fault != nullptr && cell.fault->cause == FaultCause::kOtherDevice;
  if (other) stage.bus().with_model([](auto& model) { model.state_block(std::nullopt); });
  const bool jumped = cell.fault != nullptr && cell.fault->cause == FaultCause::kBus &&
                      cell.fault->event.kind == DeviceFaultKind::kEncoderJump;
  if (!jumped && !other) return;
  stage.unplug();
  pass(kRelease);
  stage.plug(true);
  pass(kReplug);
}

void take_force(FaultStage& stage) {
  move_hand(stage, target_at(kLight_m), kMove);
  for (std::size_t k = 0; k < kMove + kReplug; ++k) static_cast<void>(stage.step());
  stage.hand().switches = kDeadman;
}

}  // namespace haptic::sim
