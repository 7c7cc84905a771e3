// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/dynamixel/dynamixel_device.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::tools {
namespace {

using namespace dynamixel_register;

constexpr std::int64_t kStale_ns = 10'000'000;  // or two cycles and a half
constexpr std::int64_t kLost_ns = 100'000'000;
constexpr std::int64_t kSupportRamp_ns = 1'000'000'000;
constexpr std::int64_t kFeltDown_ns = 10'000'000, kFeltUp_ns = 50'000'000;
constexpr std::int64_t kLongestStep_ns = 20'000'000;  ///< of a share: a program that was stopped
constexpr std::int64_t kFaultShown_ns = 200'000'000;
constexpr unsigned kCyclesPerWatchdog = 16;
constexpr unsigned kCleanPoses = 64;  // then no answer is under way any more
constexpr std::size_t kAnswerLengths =
    12;  // an answer is given up for good before they are through

/// Torque and watchdog on, with goals of zero: each is written to all joints and read back.
struct SetupStep {
  std::uint16_t address;
  std::uint8_t value;
};
constexpr std::array kSetupSteps = {SetupStep{kBusWatchdog, 0}, SetupStep{kTorqueEnable, 1},
                                    SetupStep{kBusWatchdog, kWatchdogSet}};

double moved(double share, double target, std::int64_t step_ns, std::int64_t ramp_ns) {
  const double step = static_cast<double>(step_ns) / static_cast<double>(ramp_ns);
  return std::clamp(target, share - step, share + step);
}

}  // namespace

hal::BridgeRead DynamixelDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  if (phase_ == Phase::kClosed) return hal::BridgeRead::kLost;
  step(now_ns);
  if (phase_ == Phase::kLost) return hal::BridgeRead::kLost;
  if (!posed_) {
    const bool stands = any_pose_ && now_ns - posed_ns_ <= facts_.capabilities.report_period_ns;
    return stands ? hal::BridgeRead::kSame : hal::BridgeRead::kSilent;
  }
  posed_ = false;
  fill(sample, now_ns);
  return hal::BridgeRead::kNew;
}

bool DynamixelDevice::write(std::int64_t now_ns, const Wrench& wrench_d) {
  if (settings_.pose_only) return true;
  if (phase_ != Phase::kRunning) return false;
  felt_d_ = wrench_d;
  zero_to_be_written_ = zero_unanswered_ = false;
  is_driven_ = true;
  // The newest wrench goes out at once where half a period has passed.
  if (now_ns >= next_ns_ - cycle_ns_ / 2) {
    take_answers(now_ns);
    if (query_ == Query::kNone) start_cycle(now_ns);
  }
  return is_fresh(now_ns);
}

bool DynamixelDevice::release(std::int64_t now_ns) {
  const bool had_wrench = wrote_felt_ || !felt_d_.force_w.isZero() || !felt_d_.torque_w.isZero();
  felt_d_ = {};
  if (settings_.pose_only) return true;
  if (phase_ == Phase::kSetup) return setup_step_ > 0;  // zero goals went out with the first step
  if (phase_ != Phase::kRunning) return true;           // all goals are zero
  zero_to_be_written_ = zero_to_be_written_ || had_wrench;
  step(now_ns);
  if (zero_to_be_written_ && query_ == Query::kNone) start(Query::kPose, now_ns);
  return (!zero_to_be_written_ && !zero_unanswered_) || phase_ == Phase::kLost;
}

void DynamixelDevice::step(std::int64_t now_ns) noexcept {
  take_answers(now_ns);
  if (query_ != Query::kNone && now_ns - started_ns_ > late_ns_) miss();
  if (query_ == Query::kNone) start_next(now_ns);
  if (port_.is_lost() || now_ns - posed_ns_ > kLost_ns) {
    if (!is_closing_ || port_.is_lost()) phase_ = Phase::kLost;
  }
}

void DynamixelDevice::take_answers(std::int64_t now_ns) noexcept {
  input_.added(port_.read(input_.room()));
  for (;;) {
    DynamixelStatus status;
    const DynamixelRead got = input_.next(status);
    if (got == DynamixelRead::kNothing) return;
    if (got == DynamixelRead::kWrongCheck) {
      ++counts_.wrong_check;
      if (query_ != Query::kNone) miss();
    } else if (query_ != Query::kNone) {
      take(status, now_ns);
    }
  }
}

void DynamixelDevice::take(const DynamixelStatus& status, std::int64_t now_ns) noexcept {
  const Query query = query_;
  const bool is_single = query == Query::kError;
  if (status.id != (is_single ? servos_[error_servo_].id : kDynamixelBroadcast)) return;
  // The answer to a question before, which has been given up.
  if (!is_single && status.parameters.size() != answer_bytes()) return;
  query_ = Query::kNone;
  switch (query) {
    case Query::kPose:
      take_pose(status, now_ns);
      break;
    case Query::kWatchdog:
      take_watchdogs(status, now_ns);
      break;
    case Query::kSetup:
      take_setup(status);
      break;
    case Query::kError:
      if (status.parameters.size() == 1) {
        servos_[error_servo_].hardware_error = status.parameters[0];
      }
      break;
    case Query::kNone:
      break;
  }
}

void DynamixelDevice::take_pose(const DynamixelStatus& status, std::int64_t now_ns) noexcept {
  for (std::size_t k = 0; k < servo_count_; ++k) {
    const DynamixelBlock block = block_of(status, k, present_bytes());
    if (block.id != servos_[k].id || (block.error & ~kAlertBit) != 0) return miss();
  }
  for (std::size_t k = 0; k < servo_count_; ++k) {
    const DynamixelBlock block = block_of(status, k, present_bytes());
    Servo& servo = servos_[k];
    servo.alert = (block.error & kAlertBit) != 0;
    if (!servo.alert) servo.hardware_error = 0, servo.asked = false;
    const double counts = int32_at(block.data.subspan(6));
    if (k >= joints()) {
      trigger_pulled_ = is_pulled(settings_.arm.trigger, counts * kCountStep_rad, trigger_pulled_);
      continue;
    }
    angles_rad_[k] = joint_angle(settings_.arm, k, counts, turns_rad_);
    rates_rad_per_s_[k] =
        settings_.arm.signs[k] * kVelocityUnit_rad_per_s * int32_at(block.data.subspan(2));
  }
  place_ = place_of(settings_.arm.arm.model, angles_rad_);
  counts_.count(now_ns - started_ns_);
  zero_unanswered_ = false;
  if (++clean_poses_ >= kCleanPoses) more_bytes_ = 0;
  posed_ns_ = started_ns_;  // a servo samples when it is asked
  posed_ = any_pose_ = true;
}

void DynamixelDevice::take_watchdogs(const DynamixelStatus& status, std::int64_t now_ns) noexcept {
  bool cut = false, restarted = false;
  for (std::size_t k = 0; k < joints(); ++k) {
    const DynamixelBlock block = block_of(status, k, 1);
    if (block.id != servos_[k].id) return miss();
    cut = cut || block.data[0] == kWatchdogCut;
    restarted = restarted || (block.data[0] != kWatchdogCut && block.data[0] != kWatchdogSet);
  }
  if (restarted && !is_closing_) phase_ = Phase::kLost;
  if (!cut || restarted) return;
  ++counts_.cuts;
  phase_ = Phase::kSetup;
  setup_step_ = 0;
  support_share_ = felt_share_ = 0;
  fault_until_ns_ = now_ns + kFaultShown_ns;
}

void DynamixelDevice::take_setup(const DynamixelStatus& status) noexcept {
  for (std::size_t k = 0; k < joints(); ++k) {
    const DynamixelBlock block = block_of(status, k, 1);
    if (block.id != servos_[k].id || block.data[0] != kSetupSteps[setup_step_].value) {
      setup_step_ = 0;
      return miss();
    }
  }
  if (++setup_step_ == kSetupSteps.size()) phase_ = Phase::kRunning;
}

void DynamixelDevice::miss() noexcept {
  if (query_ == Query::kError) servos_[error_servo_].asked = false;
  query_ = Query::kNone;
  // Registers go on behind the position: the servos answer any number of bytes.
  more_bytes_ = (more_bytes_ + 1) % kAnswerLengths;
  clean_poses_ = 0;
  ++counts_.missed;
}

std::size_t DynamixelDevice::answer_bytes() const noexcept {
  constexpr std::size_t kBlockBytes = 4;  // error, id, check sum
  return query_ == Query::kPose ? servo_count_ * (present_bytes() + kBlockBytes)
                                : joints() * (1 + kBlockBytes);
}

void DynamixelDevice::start_next(std::int64_t now_ns) noexcept {
  if (phase_ == Phase::kLost || port_.is_lost()) return;
  if (now_ns < next_ns_ - cycle_ns_ / 4) {
    // Between two cycles: why a servo is in alarm.
    for (std::size_t k = 0; k < servo_count_ && query_ == Query::kNone; ++k) {
      if (!servos_[k].alert || servos_[k].asked) continue;
      servos_[k].asked = true;
      error_servo_ = k;
      start(Query::kError, now_ns);
    }
    return;
  }
  if (now_ns >= next_ns_) start_cycle(now_ns);
}

/// The query of the next cycle, whoever begins it: goals go out with each.
void DynamixelDevice::start_cycle(std::int64_t now_ns) noexcept {
  // In turn with poses, so that these go on while the watchdogs are asked or set.
  const bool is_odd = ++cycles_to_watchdog_ % 2 != 0;
  if (phase_ == Phase::kSetup && is_odd) return start(Query::kSetup, now_ns);
  if (phase_ == Phase::kRunning && cycles_to_watchdog_ >= kCyclesPerWatchdog) {
    cycles_to_watchdog_ = 0;
    for (Servo& servo : servos_) servo.asked = false;  // an alarm may have got another reason
    if (!settings_.pose_only) return start(Query::kWatchdog, now_ns);
  }
  start(Query::kPose, now_ns);
}

void DynamixelDevice::start(Query query, std::int64_t now_ns) noexcept {
  output_.clear();
  input_.clear();
  if (phase_ == Phase::kRunning && !settings_.pose_only) add_goals(now_ns);
  switch (query) {
    case Query::kPose:
      add_fast_read(kPresentCurrent, present_bytes(), servo_count_);
      break;
    case Query::kWatchdog:
      add_fast_read(kBusWatchdog, 1, joints());
      break;
    case Query::kSetup:
      add_to_all(kSetupSteps[setup_step_].address, kSetupSteps[setup_step_].value);
      torques_nm_ = {};
      add_goals(now_ns);
      add_fast_read(kSetupSteps[setup_step_].address, 1, joints());
      break;
    case Query::kError: {
      const std::array<std::uint8_t, 4> parameters = {low_byte(kHardwareError),
                                                      high_byte(kHardwareError), 1, 0};
      static_cast<void>(
          output_.add(servos_[error_servo_].id, DynamixelInstruction::kRead, parameters));
      break;
    }
    case Query::kNone:
      break;
  }
  query_ = query;
  started_ns_ = now_ns;
  if (query != Query::kError) {
    // On the grid, or from now on where that has been left.
    next_ns_ = now_ns - next_ns_ < cycle_ns_ ? next_ns_ + cycle_ns_ : now_ns + cycle_ns_;
  }
  if (!port_.write(output_.bytes())) return miss();
  zero_unanswered_ = zero_unanswered_ || zero_to_be_written_;
  zero_to_be_written_ = false;
}

bool DynamixelDevice::is_fresh(std::int64_t now_ns) const noexcept {
  return any_pose_ && now_ns - posed_ns_ <= std::max(kStale_ns, cycle_ns_ * 5 / 2);
}

void DynamixelDevice::move_shares(std::int64_t now_ns) noexcept {
  const std::int64_t since_ns = std::clamp<std::int64_t>(now_ns - shares_ns_, 0, kLongestStep_ns);
  shares_ns_ = now_ns;
  const bool carries = is_driven_ && !is_closing_ && phase_ == Phase::kRunning;
  support_share_ = moved(support_share_, carries ? 1 : 0, since_ns, kSupportRamp_ns);
  const bool fresh = is_fresh(now_ns) && !is_closing_;
  felt_share_ = moved(felt_share_, fresh ? 1 : 0, since_ns, fresh ? kFeltUp_ns : kFeltDown_ns);
}

void DynamixelDevice::add_goals(std::int64_t now_ns) noexcept {
  torques_nm_ = {};
  wrote_felt_ = false;
  if (phase_ == Phase::kRunning) {
    move_shares(now_ns);
    wrote_felt_ = !felt_d_.force_w.isZero() || !felt_d_.torque_w.isZero();
    JointNumbers support = support_torques(settings_.arm.arm.model, place_, angles_rad_, limits_nm_,
                                           settings_.gravity_share);
    for (double& torque : support) torque *= support_share_;
    const Wrench felt{felt_d_.force_w * static_cast<Real>(felt_share_),
                      felt_d_.torque_w * static_cast<Real>(felt_share_)};
    double share = 0;
    torques_nm_ = limited_torques(place_, support, felt, limits_nm_, share);
  }
  std::array<std::uint8_t, 4 + 3 * kMaxJoints> parameters = {low_byte(kGoalCurrent),
                                                             high_byte(kGoalCurrent), 2, 0};
  for (std::size_t k = 0; k < joints(); ++k) {
    const Servo& servo = servos_[k];
    const double counts = settings_.arm.signs[k] * torques_nm_[k] / (servo.nm_per_a * servo.unit_a);
    const int goal =
        std::clamp(static_cast<int>(std::lround(counts)), -servo.most_counts, servo.most_counts);
    parameters[4 + 3 * k] = servo.id;
    parameters[5 + 3 * k] = static_cast<std::uint8_t>(goal & 0xff);
    parameters[6 + 3 * k] = static_cast<std::uint8_t>(goal >> 8 & 0xff);
  }
  static_cast<void>(output_.add(kDynamixelBroadcast, DynamixelInstruction::kSyncWrite,
                                std::span(parameters).first(4 + 3 * joints())));
}

void DynamixelDevice::add_to_all(std::uint16_t address, std::uint8_t value) noexcept {
  std::array<std::uint8_t, 4 + 2 * kMaxJoints> parameters = {low_byte(address), high_byte(address),
                                                             1, 0};
  for (std::size_t k = 0; k < joints(); ++k) {
    parameters[4 + 2 * k] = servos_[k].id;
    parameters[5 + 2 * k] = value;
  }
  static_cast<void>(output_.add(kDynamixelBroadcast, DynamixelInstruction::kSyncWrite,
                                std::span(parameters).first(4 + 2 * joints())));
}

void DynamixelDevice::add_fast_read(std::uint16_t address, std::size_t bytes,
                                    std::size_t servos) noexcept {
  std::array<std::uint8_t, 4 + kMaxServos> parameters = {low_byte(address), high_byte(address),
                                                         static_cast<std::uint8_t>(bytes), 0};
  for (std::size_t k = 0; k < servos; ++k) parameters[4 + k] = servos_[k].id;
  static_cast<void>(output_.add(kDynamixelBroadcast, DynamixelInstruction::kFastSyncRead,
                                std::span(parameters).first(4 + servos)));
}

std::uint32_t DynamixelDevice::faults(std::int64_t now_ns) const noexcept {
  std::uint32_t faults = now_ns < fault_until_ns_ ? std::uint32_t{kDeviceDriveFault} : 0u;
  for (std::size_t k = 0; k < servo_count_; ++k) {
    const Servo& servo = servos_[k];
    if (!servo.alert) continue;
    const bool is_hot = (servo.hardware_error & kErrorOverheating) != 0;
    if (is_hot) faults |= kDeviceOverheated;
    // An alarm whose reason has not come yet is taken for the worse one.
    if (!is_hot || (servo.hardware_error & ~kErrorOverheating) != 0) faults |= kDeviceDriveFault;
  }
  return faults;
}

void DynamixelDevice::fill(hal::BridgeSample& sample, std::int64_t now_ns) const noexcept {
  sample = {};
  sample.sampled_ns = posed_ns_;
  sample.pose_dh = record_of(pose_of(place_));
  sample.twist_d = record_of(twist_of(place_, rates_rad_per_s_));
  sample.twist_valid = true;
  sample.calibrated = phase_ == Phase::kRunning;
  sample.switches = trigger_pulled_ ? 1u : 0u;
  sample.faults = faults(now_ns);
}

}  // namespace haptic::tools
