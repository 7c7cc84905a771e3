// SPDX-License-Identifier: Apache-2.0
#include "host_sim/faults/fault_run.hpp"
#include "host_sim/device/usbfs_carrier.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "host_sim/device/usbfs_carrier.hpp"
#include "host_sim/reproduction/shape_scene.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// The stack's bus is the one inside this process.
UsbfsCarrier& in_process_bus(DeviceStack& stack) {
  return dynamic_cast<UsbfsCarrier&>(stack.bus().carrier());
}

constexpr double kCubeHalf_m = 0.010, kWallHalf_m = 0.050;
constexpr double kSurface_m = kCubeHalf_m + kWallHalf_m;  ///< height of the grip point at touch
constexpr double kStiffness_n_per_m = 2000, kDamping_ns_per_m = 2;
// Heights of the hand's target about touch. Without force the handle goes where the hand wants it:
// from the light target the pull is within the limits, so that it can be armed there.
constexpr double kFree_m = 0.005, kLight_m = -0.004, kFirm_m = -0.0185;
constexpr double kAside_m = 0.03, kTurned_rad = 0.5;
constexpr double kBox_m = 0.02, kLargestAngle_rad = 0.3;

// Periods.
constexpr std::size_t kSettle = 40, kMove = 100, kRest = 150, kRampIn = 100;
constexpr std::size_t kHalfRampOut = 5, kClutch = 100, kLatch = 60, kReplug = 60, kRelease = 10,
                      kRecover = 300;

constexpr std::uint32_t kDeadman = 1u << 0, kClutchSwitch = 1u << 1;
constexpr Real kHuge_n = 1.0e6_r;
constexpr std::int64_t kOld_ns = 100'000'000;

HandTarget target_at(double height_m, double aside_m = 0, double turned_rad = 0) {
  return {Vector(0, aside_m, kSurface_m + height_m), rotation_of(Vector(0, 0, turned_rad))};
}

/// The hand goes from one target to the next and holds switches.
struct HandPlan {
  HandTarget from = target_at(kFree_m), to = from;
  double begin_s = 0, end_s = 0;
  std::uint32_t switches = 0;

  [[nodiscard]] HandTarget at(double t_s) const {
    if (t_s >= end_s) return to;
    const double u = std::max(0.0, (t_s - begin_s) / (end_s - begin_s));
    const double way = u * u * u * (10 + u * (6 * u - 15));  // minimum jerk
    return {from.x0_w + way * (to.x0_w - from.x0_w), from.q_wa.slerp(way, to.q_wa)};
  }
  [[nodiscard]] HandAction action(double t_s) const { return {at(t_s), switches}; }
};

StackSettings stack_settings(const FaultSettings& settings) {
  StackSettings stack = reference_stack(settings.carrier);
  stack.report_clocked = settings.report_clocked;
  stack.model.hand = *hand_named("firm");
  stack.limits.slew_n_per_s *= static_cast<Real>(settings.slew_factor);
  stack.limits.slew_nm_per_s *= static_cast<Real>(settings.slew_factor);
  stack.limits.ramp_in_s *= static_cast<Real>(settings.ramp_in_factor);
  stack.envelope.half_extent_m = Vec3(0, static_cast<Real>(kBox_m), 0);
  stack.envelope.max_angle_rad = static_cast<Real>(kLargestAngle_rad);
  return stack;
}

/// What a servo thread gone wrong says.
DeviceCommand spoiled(FaultCause cause, DeviceCommand command) {
  for (Real& force_n : command.wrench_d.force_n) {
    if (cause == FaultCause::kServoNotANumber) force_n = std::numeric_limits<Real>::quiet_NaN();
    if (cause == FaultCause::kServoHuge) force_n = kHuge_n;
    if (cause == FaultCause::kServoJump) force_n = -force_n;
  }
  if (cause == FaultCause::kServoOldStamp) command.stamp_ns -= kOld_ns;
  return command;
}

class FaultRun {
 public:
  FaultRun(std::span<const std::byte> scene, const FaultCase& cell, const FaultSettings& settings)
      : session_(scene, "fault matrix"),
        cell_(cell),
        settings_(settings),
        stack_(session_, stack_settings(settings),
               [this](double t_s) { return hand_.action(t_s); }) {
    trace_.period_s = stack_.period_s();
  }

  FaultTrace run() {
    reach();
    trace_.injected = trace_.samples.size();
    inject();
    trace_.mended = trace_.samples.size();
    mend();
    trace_.pressed = trace_.samples.size();
    press(kDeadman);
    pass(kRecover);
    if (settings_.carrier == StackCarrier::kUsb) {
      stack_.unplug();  // else closing waits for a ramp, and the time of the device stands still
      static_cast<void>(stack_.step());
    }
    return std::move(trace_);
  }

 private:
  void pass(std::size_t periods);
  void move(const HandTarget& to, std::size_t periods);
  void press(std::uint32_t switches) { hand_.switches = switches; }
  void expect(bool holds, const char* what) const;
  void arm_free();
  void press_firmly();
  void reach();
  void inject();
  void mend();
  [[nodiscard]] ArmingState arming() const { return trace_.samples.back().arming; }

  CoreSession session_;
  FaultCase cell_;
  FaultSettings settings_;
  HandPlan hand_;
  DeviceStack stack_;
  FaultTrace trace_;
};

void FaultRun::pass(std::size_t periods) {
  for (std::size_t k = 0; k < periods; ++k) {
    StackTick tick = stack_.step();
    FaultSample& sample = trace_.samples.emplace_back();
    sample.sent = std::move(tick.sent);
    sample.acting = tick.acting;
    sample.accepted = stack_.bus().with_model([](const auto& model) { return model.accepted(); });
    sample.drives_on = tick.drives_on;
    sample.watchdog_cuts = tick.cuts;
    sample.arming = tick.servo.arming;
    sample.safety = tick.servo.faults;
    sample.device = tick.state.faults;
    sample.link = tick.link;
  }
}

void FaultRun::move(const HandTarget& to, std::size_t periods) {
  const double now_s = static_cast<double>(trace_.samples.size()) * trace_.period_s;
  hand_.from = hand_.at(now_s);
  hand_.to = to;
  hand_.begin_s = now_s;
  hand_.end_s = now_s + static_cast<double>(periods) * trace_.period_s;
}

void FaultRun::expect(bool holds, const char* what) const {
  if (!holds) {
    throw tools::InputError("fault matrix, " + std::string(to_text(cell_.state)) +
                            ": the state is not reached: " + what);
  }
}

void FaultRun::arm_free() {
  press(kDeadman);
  pass(kRampIn + kSettle);
  expect(arming() == ArmingState::kArmed, "not armed");
}

void FaultRun::press_firmly() {
  arm_free();
  move(target_at(kFirm_m), kMove);
  pass(kMove + kRest);
  const SafetyLimits limits = reference_stack(StackCarrier::kDirect).limits;
  const double largest_n = static_cast<double>(limits.max_force_n);
  expect(trace_.samples.back().acting.force_w.norm() >= 0.8 * largest_n, "too little force");
}

void FaultRun::reach() {
  const FaultState state = cell_.state;
  if (state == FaultState::kAbsent) stack_.unplug();
  if (state == FaultState::kStarting) {
    stack_.bus().with_model([](auto& model) { model.set_faults(kDeviceNotHomed); });
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
    stack_.emergency_stop();
    pass(kLatch);
    expect(arming() == ArmingState::kFaulted, "not faulted");
  }
}

void FaultRun::inject() {
  const Fault& fault = *cell_.fault;
  std::size_t lasts = kFaultWatch;  ///< of what the script itself ends
  switch (fault.cause) {
    case FaultCause::kNothing:
      break;
    case FaultCause::kBus:
      stack_.bus().add(fault.event);
      break;
    case FaultCause::kHoldOut:
      in_process_bus(stack_).hold_out(true);
      break;
    case FaultCause::kPowerLost:
      stack_.bus().with_model([](auto& model) { model.drives_off(); });
      stack_.unplug();
      break;
    case FaultCause::kEmergencyCall:
      stack_.emergency_stop();
      break;
    case FaultCause::kDeviceBits:
      stack_.bus().with_model([&](auto& model) {
        const bool starting = cell_.state == FaultState::kStarting;
        model.set_faults(fault.event.count | (starting ? kDeviceNotHomed : 0u));
      });
      break;
    case FaultCause::kServoLost:
      stack_.servo_lost();
      [[fallthrough]];
    case FaultCause::kServoStalled:
      stack_.stall_servo(true);
      lasts = fault.event.count;
      break;
    case FaultCause::kServoNotANumber:
    case FaultCause::kServoHuge:
    case FaultCause::kServoJump:
    case FaultCause::kServoOldStamp:
      stack_.say_instead(
          [cause = fault.cause](const DeviceCommand& command) { return spoiled(cause, command); });
      lasts = fault.event.count;
      break;
    case FaultCause::kWorkspaceLeft:
      move({hand_.to.x0_w + Vector(0, kAside_m, 0), hand_.to.q_wa}, kMove);
      break;
    case FaultCause::kEnvelopeLeft:
      move({hand_.to.x0_w, rotation_of(Vector(0, 0, kTurned_rad))}, kMove);
      break;
    case FaultCause::kDeadmanReleased:
      press(0);
      break;
  }
  pass(lasts);
  if (lasts == kFaultWatch) return;
  stack_.stall_servo(false);
  stack_.say_instead(nullptr);
  if (fault.cause == FaultCause::kServoLost) stack_.restart_servo();
  pass(kFaultWatch - lasts);
}

/// The cause goes, whatever it was; the operator lets go and comes to where force can be taken.
void FaultRun::mend() {
  const Fault& fault = *cell_.fault;
  // The clutch is held on the way: the goal stays where it was pressed in.
  press(cell_.state == FaultState::kClutched ? kClutchSwitch : 0);
  if (fault.cause == FaultCause::kHoldOut) in_process_bus(stack_).hold_out(false);
  if (fault.cause == FaultCause::kDeviceBits || cell_.state == FaultState::kStarting)
    stack_.bus().with_model([](auto& model) { model.set_faults(0); });
  const bool away =
      !trace_.samples.empty() && fault.without_bus() == false && !stack_.bus().carrier().plugged();
  if (away || cell_.state == FaultState::kAbsent)
    stack_.plug(fault.cause == FaultCause::kPowerLost);
  move(target_at(kLight_m), kMove);
  pass(kMove + kReplug);
  press(0);
  pass(kRelease);
}

}  // namespace

std::vector<std::byte> fault_scene() {
  SceneParameters p = tools::default_parameters();
  p.k_f_n_per_m = kStiffness_n_per_m;
  p.rate_hz = 1000;
  p.coupling.k_t_n_per_m = kStiffness_n_per_m;
  p.coupling.k_r_nm_per_rad = kStiffness_n_per_m * kGripRadius_m * kGripRadius_m;
  p.coupling.damping_ns_per_m = kDamping_ns_per_m;
  p.coupling.damping_share = 1.0;
  p.coupling.max_rotation_error_rad = 0.3;
  p.coupling.max_window_s = 0.02;
  const Solid cube = centred_box("cube", kCubeHalf_m, kCubeHalf_m, kCubeHalf_m);
  const Solid wall = centred_box("wall", 0.1, 0.1, kWallHalf_m);
  return scene_with(cube, {&wall, 1}, p);
}

FaultTrace run_fault(std::span<const std::byte> scene, const FaultCase& cell,
                     const FaultSettings& settings) {
  const bool usb = settings.carrier == StackCarrier::kUsb;
  if (!usb && (!cell.fault->without_bus() || cell.state == FaultState::kAbsent))
    throw tools::InputError(std::string(cell.fault->name) + ", " + to_text(cell.state) +
                            ": there is no bus; use the carrier usb");
  return FaultRun(scene, cell, settings).run();
}

}  // namespace haptic::sim
