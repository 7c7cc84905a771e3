// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/stack_stage.hpp"

#include <limits>

namespace haptic::sim {
namespace {

constexpr Real kHuge_n = 1.0e6_r;
constexpr std::int64_t kOld_ns = 100'000'000;

}  // namespace

DeviceCommand spoiled(FaultCause cause, DeviceCommand command) {
  for (Real& force_n : command.wrench_d.force_n) {
    if (cause == FaultCause::kServoNotANumber) force_n = std::numeric_limits<Real>::quiet_NaN();
    if (cause == FaultCause::kServoHuge) force_n = kHuge_n;
    if (cause == FaultCause::kServoJump) force_n = -force_n;
  }
  if (cause == FaultCause::kServoOldStamp) command.stamp_ns -= kOld_ns;
  return command;
}

StackStage::StackStage(std::span<const std::byte> scene, const StackSettings& stack)
    : FaultStage(1.0 / stack.model.report_rate_hz, hand_at_start()),
      session_(scene, "fault matrix"),
      carrier_(stack.carrier),
      stack_(session_, stack, [this](double t_s) { return hand().action(t_s); }) {}

// Without a bus closing does not wait for a ramp, for which the time of the device would have to
// pass.
StackStage::~StackStage() {
  if (carrier_ != StackCarrier::kUsb) return;
  stack_.unplug();
  static_cast<void>(stack_.step());
}

FaultSample StackStage::pass_period() {
  StackTick tick = stack_.step();
  FaultSample sample;
  sample.sent = std::move(tick.sent);
  sample.acting = tick.acting;
  sample.acts = accepted_;
  sample.accepted = accepted_ =
      stack_.bus().with_model([](const auto& model) { return model.accepted(); });
  sample.drives_on = tick.drives_on;
  sample.watchdog_cuts = tick.cuts;
  sample.arming = tick.servo.arming;
  sample.safety = tick.servo.faults;
  sample.device = tick.state.faults;
  sample.link = tick.link;
  return sample;
}

void StackStage::spoil_commands(FaultCause cause) {
  stack_.say_instead([cause](const DeviceCommand& command) { return spoiled(cause, command); });
}

void StackStage::lose_servo() {
  stack_.servo_lost();
  stack_.stall_servo(true);
}

void StackStage::release_servo() {
  stack_.stall_servo(false);
  stack_.say_instead(nullptr);
}

void StackStage::restart_servo() {
  stack_.stall_servo(false);
  stack_.restart_servo();
}

}  // namespace haptic::sim
