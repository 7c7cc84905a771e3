// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/feetech/feetech_device.hpp"

#include <algorithm>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

constexpr int kFeetechCycles = 20, kFeetechAttempts = 3;
constexpr std::int64_t kFeetechAnswer_ns = 34'000'000, kFeetechLost_ns = 100'000'000;
constexpr std::int64_t kFeetechMeasure_ns = 1'000'000'000, kFeetechFrame_ns = 1'000'000;
constexpr std::int64_t kFeetechLeastLate_ns = 4'000'000;
constexpr int kCounts = 4096;
constexpr unsigned kFeetechCleanPoses = 64;
constexpr std::size_t kFeetechAnswerLengths = 12;  // as DynamixelDevice has it

}  // namespace

bool FeetechDevice::open(std::string& why) {
  close();
  port_.set_tap(tap());
  if (!port_.open(settings_.port, settings_.baud, why)) return false;
  servos_ = {};
  for (std::size_t k = 0; k < joints(); ++k) servos_[k].id = settings_.ids[k];
  servo_count_ = joints() + (settings_.trigger.present ? 1 : 0);
  if (settings_.trigger.present) servos_[joints()].id = settings_.trigger.id;
  counts_ = {};
  if (!find_servos(why) || !measure_cycle(why)) {
    port_.close();
    return false;
  }
  why = outside_limits(settings_, angles_rad_);
  if (!why.empty()) {
    port_.close();
    return false;
  }
  state_facts();
  posed_ns_ = port_.now_ns();
  is_open_ = true;
  return true;
}

bool FeetechDevice::ask(std::uint8_t id, std::uint8_t address, std::span<std::uint8_t> data) {
  const std::array<std::uint8_t, 2> parameters = {address, static_cast<std::uint8_t>(data.size())};
  const FeetechOutput output(id, FeetechInstruction::kRead, parameters);
  for (int attempt = 0; attempt < kFeetechAttempts && !port_.is_lost(); ++attempt) {
    port_.drop_input();
    input_.clear();
    if (!port_.write(output.bytes())) continue;
    for (const std::int64_t end = port_.now_ns() + kFeetechAnswer_ns; port_.now_ns() < end;) {
      FeetechStatus status;
      const FeetechRead got = input_.next(status);
      if (got == FeetechRead::kStatus && status.id == id &&
          status.parameters.size() == data.size()) {
        std::ranges::copy(status.parameters, data.begin());
        return true;
      }
      if (got == FeetechRead::kWrongCheck || port_.is_lost()) break;
      if (got == FeetechRead::kStatus) continue;
      port_.wait(end - port_.now_ns());
      input_.added(port_.read(input_.room()));
    }
  }
  return false;
}

bool FeetechDevice::find_servos(std::string& why) {
  for (std::size_t k = 0; k < servo_count_; ++k) {
    const std::string who =
        "servo " + std::to_string(servos_[k].id) +
        (k < joints() ? " (joint '" + settings_.arm.joint_names[k] + "')" : " (trigger)");
    std::array<std::uint8_t, 1> torque{};
    if (!ask(servos_[k].id, feetech_register::kTorqueEnable, torque)) {
      why = who + " does not answer at " + std::to_string(settings_.baud) +
            " baud; check power, cable, ids and baud";
      return false;
    }
    if (torque[0] != 0) {
      why = who +
            " holds its position, and a leader arm must move freely: end the program that "
            "holds it, or unplug the arm's power for a moment";
      return false;
    }
  }
  return true;
}

bool FeetechDevice::measure_cycle(std::string& why) {
  turns_rad_ = {};
  any_pose_ = posed_ = false;
  late_ns_ = kFeetechAnswer_ns;
  std::array<std::int64_t, kFeetechCycles> durations{};
  int measured = 0;
  for (const std::int64_t end = port_.now_ns() + kFeetechMeasure_ns;
       measured < kFeetechCycles && port_.now_ns() < end && !port_.is_lost();) {
    start(port_.now_ns());
    while (is_asked_ && port_.now_ns() - started_ns_ < late_ns_) {
      port_.wait(late_ns_ - (port_.now_ns() - started_ns_));
      take_answers(port_.now_ns());
    }
    if (posed_) durations[static_cast<std::size_t>(measured++)] = port_.now_ns() - started_ns_;
    posed_ = false;
  }
  is_asked_ = false;
  std::ranges::sort(durations);
  const std::int64_t usual_ns = durations[kFeetechCycles / 4];
  // The request: 8 bytes and 1 a servo; the answers: 12 each.
  const std::int64_t line_ns = line_time_ns(8 + 13 * servo_count_, settings_.baud);
  const std::int64_t period_ns = period_for(std::max(line_ns + kFeetechFrame_ns, usual_ns));
  if (measured < kFeetechCycles || period_ns == 0) {
    why = measured < kFeetechCycles
              ? "the servos answer one by one and not together (sync read); check cables and baud"
              : "a cycle takes " + short_number(1e-6 * static_cast<double>(usual_ns), 3) +
                    " ms, which is too slow; raise the baud rate and set the servos' return delay "
                    "to 0";
    return false;
  }
  turns_rad_ = nearest_turns(settings_.arm.model, angles_rad_);
  for (std::size_t k = 0; k < joints(); ++k) angles_rad_[k] += turns_rad_[k];
  place_ = place_of(settings_.arm.model, angles_rad_);
  facts_.capabilities.report_period_ns = period_ns;
  cycle_ns_ = period_ns - period_ns / 16;
  late_ns_ = std::max(kFeetechLeastLate_ns, 2 * period_ns);
  next_ns_ = 0;
  return true;
}

void FeetechDevice::state_facts() {
  const ArmModel& model = settings_.arm.model;
  const double reach = lever_bounds(model)[0];
  hal::DeviceCapabilities& c = facts_.capabilities;
  const std::int64_t period_ns = c.report_period_ns;
  c = {};
  c.report_period_ns = period_ns;
  c.name = hal::device_text("Feetech arm");
  c.sensed_dof = hal::kDofAll;
  c.encoder_step_m = static_cast<Real>(kCountStep_rad * reach);
  c.encoder_step_rad = static_cast<Real>(kCountStep_rad);
  c.workspace_radius_m =
      static_cast<Real>(reach + (model.turn_db * model.joints[0].point_b + model.origin_d).norm());
  facts_.name = std::to_string(joints()) + " joints on Feetech servos at " + settings_.port + ", " +
                std::to_string(settings_.baud) + " baud";
  facts_.words =
      "Poses only: these servos have no current mode and no watchdog, so a force could neither be "
      "stated nor be taken away. A cycle takes " +
      short_number(1e-6 * static_cast<double>(counts_.mean_ns()), 2) + " ms, at most " +
      short_number(1e-6 * static_cast<double>(counts_.longest_ns), 2) + " of " +
      std::to_string(counts_.answered) + ".";
  const std::string advice = serial_advice(settings_.port);
  if (!advice.empty()) facts_.words += " " + advice;
}

hal::BridgeRead FeetechDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  if (!is_open_) return hal::BridgeRead::kLost;
  take_answers(now_ns);
  if (is_asked_ && now_ns - started_ns_ > late_ns_) miss();
  if (!is_asked_ && now_ns >= next_ns_) start(now_ns);
  if (port_.is_lost() || now_ns - posed_ns_ > kFeetechLost_ns) {
    is_open_ = false;
    return hal::BridgeRead::kLost;
  }
  if (!posed_) {
    const bool stands = any_pose_ && now_ns - posed_ns_ <= facts_.capabilities.report_period_ns;
    return stands ? hal::BridgeRead::kSame : hal::BridgeRead::kSilent;
  }
  posed_ = false;
  sample = {};
  sample.sampled_ns = posed_ns_;
  sample.pose_dh = record_of(pose_of(place_));
  sample.calibrated = true;
  sample.switches = trigger_pulled_ ? 1u : 0u;
  for (std::size_t k = 0; k < servo_count_; ++k) {
    if ((servos_[k].error & kFeetechHot) != 0) sample.faults |= kDeviceOverheated;
    if ((servos_[k].error & kFeetechSensor) != 0) sample.faults |= kDeviceDriveFault;
  }
  return hal::BridgeRead::kNew;
}

void FeetechDevice::start(std::int64_t now_ns) noexcept {
  std::array<std::uint8_t, 2 + kMaxServos> parameters = {
      feetech_register::kPresentPosition, static_cast<std::uint8_t>(present_bytes())};
  for (std::size_t k = 0; k < servo_count_; ++k) parameters[2 + k] = servos_[k].id;
  const FeetechOutput output(kFeetechBroadcast, FeetechInstruction::kSyncRead,
                             std::span(parameters).first(2 + servo_count_));
  input_.clear();
  answered_ = 0;
  is_asked_ = true;
  started_ns_ = now_ns;
  next_ns_ = now_ns - next_ns_ < cycle_ns_ ? next_ns_ + cycle_ns_ : now_ns + cycle_ns_;
  if (!port_.write(output.bytes())) miss();
}

void FeetechDevice::take_answers(std::int64_t now_ns) noexcept {
  input_.added(port_.read(input_.room()));
  for (;;) {
    FeetechStatus status;
    const FeetechRead got = input_.next(status);
    if (got == FeetechRead::kNothing) return;
    if (got == FeetechRead::kWrongCheck) {
      ++counts_.wrong_check;
      if (is_asked_) miss();
    } else if (is_asked_) {
      take(status, now_ns);
    }
  }
}

void FeetechDevice::take(const FeetechStatus& status, std::int64_t now_ns) noexcept {
  Servo& servo = servos_[answered_];
  // The answer to a question before, which has been given up.
  if (status.parameters.size() != present_bytes()) return;
  if (status.id != servo.id) return miss();
  const int counts = feetech_number(status.parameters);
  // A joint turns by less than half a turn between two cycles.
  int step = (counts - servo.counts) % kCounts;
  if (step >= kCounts / 2) step -= kCounts;
  if (step < -kCounts / 2) step += kCounts;
  servo.turned = servo.is_known ? servo.turned + step : counts;
  servo.counts = counts;
  servo.is_known = true;
  servo.error = status.error;
  if (++answered_ == servo_count_) finish_cycle(now_ns);
}

void FeetechDevice::finish_cycle(std::int64_t now_ns) noexcept {
  is_asked_ = false;
  for (std::size_t k = 0; k < joints(); ++k) {
    angles_rad_[k] = joint_angle(settings_, k, servos_[k].turned, turns_rad_);
  }
  if (settings_.trigger.present) {
    trigger_pulled_ =
        is_pulled(settings_.trigger, servos_[joints()].turned * kCountStep_rad, trigger_pulled_);
  }
  place_ = place_of(settings_.arm.model, angles_rad_);
  counts_.count(now_ns - started_ns_);
  if (++clean_poses_ >= kFeetechCleanPoses) more_bytes_ = 0;
  posed_ns_ = started_ns_;
  posed_ = any_pose_ = true;
}

void FeetechDevice::miss() noexcept {
  is_asked_ = false;
  // Registers go on behind the load: the servos answer any number of bytes.
  more_bytes_ = (more_bytes_ + 1) % kFeetechAnswerLengths;
  clean_poses_ = 0;
  ++counts_.missed;
}

void FeetechDevice::close() noexcept {
  port_.close();
  is_open_ = is_asked_ = posed_ = any_pose_ = trigger_pulled_ = false;
}

std::unique_ptr<hal::BridgedDevice> make_feetech(const hal::DriverOptions& options,
                                                 hal::DriverDefect& defect) {
  ArmSettings settings;
  if (!read_arm_settings(options, settings, defect)) return nullptr;
  return std::make_unique<FeetechDevice>(std::move(settings));
}

}  // namespace haptic::tools
