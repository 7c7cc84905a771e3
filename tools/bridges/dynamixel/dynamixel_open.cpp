// SPDX-License-Identifier: Apache-2.0
/// Opening and closing of an arm on DYNAMIXEL servos: what may take a while.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/bridges/dynamixel/dynamixel_device.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

using namespace dynamixel_register;

constexpr int kMeasuredCycles = 20;
constexpr std::int64_t kMeasureLimit_ns = 1'000'000'000;
/// An adapter on USB hands answers on once in a frame.
constexpr std::int64_t kUsbFrame_ns = 1'000'000;
// The next cycle begins well before the watchdogs of the servos cut.
constexpr std::int64_t kLeastLate_ns = 4'000'000, kMostLate_ns = 12'000'000;
constexpr std::int64_t kCloseLimit_ns = 1'200'000'000;
constexpr double kShareOfCurrent = 1.0 / 3;
constexpr double kMilli = 1e-6;  // ns to ms

std::string servo_text(std::uint8_t id) { return "servo " + std::to_string(id); }

}  // namespace

DynamixelDevice::DynamixelDevice(DynamixelSettings settings) : settings_(std::move(settings)) {
  if (joints() < 3) settings_.pose_only = true;
}

bool DynamixelDevice::open(std::string& why) {
  close();
  const ArmSettings& arm = settings_.arm;
  port_.set_tap(tap());
  if (!port_.open(arm.port, arm.baud, why)) return false;
  servo_count_ = joints() + (arm.trigger.present ? 1 : 0);
  servos_ = {};
  for (std::size_t k = 0; k < joints(); ++k) servos_[k].id = arm.ids[k];
  if (arm.trigger.present) servos_[joints()].id = arm.trigger.id;
  counts_ = {};
  if (!find_servos(why) || !measure_cycle(why)) {
    give_back();
    port_.close();
    return false;
  }
  why = outside_limits(arm, angles_rad_);
  if (!why.empty()) {
    give_back();
    port_.close();
    return false;
  }
  settle_limits();
  state_facts();
  posed_ns_ = shares_ns_ = port_.now_ns();
  phase_ = settings_.pose_only ? Phase::kRunning : Phase::kSetup;
  return true;
}

bool DynamixelDevice::find_servos(std::string& why) {
  for (std::size_t k = 0; k < servo_count_; ++k) {
    Servo& servo = servos_[k];
    const bool is_joint = k < joints();
    const std::string who =
        servo_text(servo.id) +
        (is_joint ? " (joint '" + settings_.arm.arm.joint_names[k] + "')" : " (trigger)");
    DynamixelIdentity identity;
    if (bus_.ping(servo.id, identity) != DynamixelReply::kDone) {
      why = who + " does not answer at " + std::to_string(settings_.arm.baud) +
            " baud; check power, cable, ids and baud";
      return false;
    }
    const DynamixelModel* const model = find_model(identity.model);
    const bool drives = is_joint && !settings_.pose_only;
    if (drives && (model == nullptr || model->current_unit_a == 0)) {
      why = who +
            (model == nullptr ? ", model " + std::to_string(identity.model) + ", is not known here"
                              : ", " + std::string(model->name) + ", has no current mode") +
            "; set pose_only = true to use the arm without force";
      return false;
    }
    if (model != nullptr && identity.firmware < model->least_firmware) {
      why = who + " has firmware " + std::to_string(identity.firmware) +
            ", and fast sync read needs " + std::to_string(model->least_firmware) +
            "; update it by DYNAMIXEL Wizard 2.0";
      return false;
    }
    if (model != nullptr) {
      servo.model = model->name;
      servo.unit_a = model->current_unit_a;
      servo.nm_per_a = is_joint && settings_.torque_nm_per_a[k] > 0 ? settings_.torque_nm_per_a[k]
                                                                    : model->torque_nm_per_a;
    }
    std::string defect;
    if (!prepare(servo, is_joint, defect)) {
      why = who + defect;
      return false;
    }
  }
  return true;
}

bool DynamixelDevice::prepare(Servo& servo, bool is_joint, std::string& why) {
  std::array<std::uint8_t, 1> mode{}, torque{}, watchdog{};
  std::array<std::uint8_t, 2> limit{};
  if (bus_.read(servo.id, kOperatingMode, mode) != DynamixelReply::kDone ||
      bus_.read(servo.id, kTorqueEnable, torque) != DynamixelReply::kDone ||
      bus_.read(servo.id, kBusWatchdog, watchdog) != DynamixelReply::kDone) {
    why = " answers a ping and no read; set its Status Return Level to 1 or 2";
    return false;
  }
  servo.found_mode = mode[0];
  // One in current mode, or one whose watchdog has cut, lets go of nothing when its torque goes
  // off.
  const bool holds = torque[0] != 0 && mode[0] != kCurrentMode && watchdog[0] != kWatchdogCut;
  if (is_joint && holds) {
    why =
        " holds its position, and the arm would fall if it were let go: end the program that "
        "holds it, or hold the arm and unplug its power for a moment";
    return false;
  }
  if (!is_joint || settings_.pose_only) return true;
  servo.is_ours = true;
  if (bus_.read(servo.id, kCurrentLimit, limit) != DynamixelReply::kDone) {
    why = " does not tell its current limit; check cable and power";
    return false;
  }
  servo.most_counts = std::max<int>(int16_at(limit), 0);
  if (bus_.set(servo.id, kTorqueEnable, 0) != DynamixelReply::kDone ||
      bus_.set(servo.id, kBusWatchdog, 0) != DynamixelReply::kDone) {
    why = " does not take its torque off; check cable and power";
    return false;
  }
  servo.mode_changed = mode[0] != kCurrentMode;
  if (servo.mode_changed &&
      bus_.set(servo.id, kOperatingMode, kCurrentMode) != DynamixelReply::kDone) {
    why = " does not go to current mode; set its Operating Mode to 0 by DYNAMIXEL Wizard 2.0";
    return false;
  }
  return true;
}

bool DynamixelDevice::measure_cycle(std::string& why) {
  phase_ = Phase::kClosed;
  turns_rad_ = {};
  any_pose_ = posed_ = false;
  late_ns_ = kAnswer_ns;
  cycle_ns_ = 0;
  std::array<std::int64_t, kMeasuredCycles> durations{};
  int measured = 0;
  for (const std::int64_t end = port_.now_ns() + kMeasureLimit_ns;
       measured < kMeasuredCycles && port_.now_ns() < end && !port_.is_lost();) {
    start(Query::kPose, port_.now_ns());
    while (query_ != Query::kNone && port_.now_ns() - started_ns_ < late_ns_) {
      port_.wait(late_ns_ - (port_.now_ns() - started_ns_));
      take_answers(port_.now_ns());
    }
    if (posed_) durations[static_cast<std::size_t>(measured++)] = port_.now_ns() - started_ns_;
    posed_ = false;
  }
  query_ = Query::kNone;
  if (measured < kMeasuredCycles) {
    why = "the servos answer one by one and not together (fast sync read): " +
          std::to_string(counts_.missed) + " of " +
          std::to_string(counts_.missed + counts_.answered) +
          " answers were late or damaged; check cables and the baud rate";
    return false;
  }
  turns_rad_ = nearest_turns(settings_.arm.arm.model, angles_rad_);
  for (std::size_t k = 0; k < joints(); ++k) angles_rad_[k] += turns_rad_[k];
  place_ = place_of(settings_.arm.arm.model, angles_rad_);
  std::ranges::sort(durations);
  // Instructions: 14 bytes and 3 a joint, 14 and 1 a servo; the answer: 8 and 14 a servo.
  const std::int64_t line_ns =
      line_time_ns(36 + 3 * joints() + 15 * servo_count_, settings_.arm.baud);
  // This machine's own delays lengthen some of them, nothing shortens one.
  const std::int64_t usual_ns = durations[kMeasuredCycles / 4];
  const std::int64_t period_ns = period_for(std::max(line_ns + kUsbFrame_ns, usual_ns));
  if (period_ns == 0) {
    why = "a cycle takes " + short_number(kMilli * static_cast<double>(usual_ns), 3) +
          " ms, which is too slow; raise the baud rate of servos and adapter, set Return Delay "
          "Time to 0 and the adapter's latency timer to 1 ms";
    return false;
  }
  facts_.capabilities.report_period_ns = period_ns;
  cycle_ns_ = period_ns - period_ns / 16;
  late_ns_ = std::clamp(2 * period_ns, kLeastLate_ns, kMostLate_ns);
  next_ns_ = 0;
  return true;
}

void DynamixelDevice::settle_limits() {
  for (std::size_t k = 0; k < joints(); ++k) {
    const Servo& servo = servos_[k];
    const double most = servo.most_counts * servo.unit_a * servo.nm_per_a;
    const double asked = settings_.torque_limits_nm[k];
    limits_nm_[k] = asked > 0 ? std::min(asked, most) : kShareOfCurrent * most;
  }
  stated_ = stated_force(settings_.arm.arm.model, limits_nm_, settings_.gravity_share);
}

void DynamixelDevice::state_facts() {
  const ArmModel& model = settings_.arm.arm.model;
  hal::DeviceCapabilities c;
  c.sensed_dof = hal::kDofAll;
  const double reach = lever_bounds(model)[0];
  c.encoder_step_m = static_cast<Real>(kCountStep_rad * reach);
  c.encoder_step_rad = static_cast<Real>(kCountStep_rad);
  c.workspace_radius_m =
      static_cast<Real>(reach + (model.turn_db * model.joints[0].point_b + model.origin_d).norm());
  c.report_period_ns = facts_.capabilities.report_period_ns;
  std::string words;
  if (settings_.pose_only) {
    words = "Poses only: no servo is given torque.";
  } else {
    const double force = settings_.max_force_n > 0 ? settings_.max_force_n : stated_.force_n;
    c.driven_dof = hal::kDofTranslation | (stated_.torque_nm > 0 ? hal::kDofRotation : 0u);
    c.max_force_n = static_cast<Real>(force);
    c.max_torque_nm = static_cast<Real>(stated_.torque_nm);
    words =
        "Gears, backlash and 1 to 2 ms of bus: a cue, not a surface. In every pose it can push "
        "with " +
        short_number(stated_.force_n, 2) + " N (joint '" +
        settings_.arm.arm.joint_names[stated_.weakest] +
        "': " + short_number(limits_nm_[stated_.weakest], 2) + " N m, of which its weight takes " +
        short_number(stated_.weight_nm, 2) + ", over " + short_number(stated_.lever_m, 2) + " m)";
    if (stated_.force_n == 0) words += ": raise torque_limits_nm or lower gravity_share";
    if (settings_.max_force_n > stated_.force_n) {
      words +=
          "; max_force_n says " + short_number(force, 2) + " N, which it has in some poses alone";
    }
    words += ". The arm carries " + short_number(100 * settings_.gravity_share, 3) +
             " % of its weight by its URDF, from the first force on until the end, and lets it go "
             "over 1 s. If this program or the machine dies, the servos cut after 20 ms and the "
             "arm falls: give it a rest to fall on.";
    if (settings_.arm.arm.mass_kg == 0 && settings_.gravity_share > 0) {
      words += " The URDF states no mass, so no weight is carried.";
    }
  }
  words += " A cycle takes " + short_number(kMilli * static_cast<double>(counts_.mean_ns()), 2) +
           " ms, at most " + short_number(kMilli * static_cast<double>(counts_.longest_ns), 2) +
           " of " + std::to_string(counts_.answered) + ".";
  for (std::size_t k = 0; k < servo_count_; ++k) {
    std::array<std::uint8_t, 1> delay{};
    if (bus_.read(servos_[k].id, kReturnDelay, delay) != DynamixelReply::kDone || delay[0] == 0) {
      continue;
    }
    words += " The Return Delay Time of " + servo_text(servos_[k].id) + " is " +
             std::to_string(2 * delay[0]) + " us: 0 is faster (DYNAMIXEL Wizard 2.0).";
    break;
  }
  const std::string advice = serial_advice(settings_.arm.port);
  if (!advice.empty()) words += " " + advice;
  c.name = hal::device_text("DYNAMIXEL arm");
  facts_.capabilities = c;
  facts_.name = std::to_string(joints()) + " joints on DYNAMIXEL servos (";
  for (std::size_t k = 0; k < joints(); ++k) {
    facts_.name +=
        (k == 0 ? "" : " ") + std::string(servos_[k].model.empty() ? "unknown" : servos_[k].model);
  }
  facts_.name += ") at " + settings_.arm.port + ", " + std::to_string(settings_.arm.baud) + " baud";
  facts_.words = words;
}

void DynamixelDevice::give_back() noexcept {
  if (settings_.pose_only || port_.is_lost()) return;
  int silent = 0;
  for (std::size_t k = 0; k < joints() && silent < 2; ++k) {
    Servo& servo = servos_[k];
    // One that holds its position for another program is left alone.
    if (!servo.is_ours) continue;
    if (bus_.set(servo.id, kTorqueEnable, 0) != DynamixelReply::kDone) {
      ++silent;
      continue;
    }
    static_cast<void>(bus_.set(servo.id, kBusWatchdog, 0));
    if (servo.mode_changed) {
      static_cast<void>(bus_.set(servo.id, kOperatingMode, servo.found_mode));
    }
  }
}

void DynamixelDevice::close() noexcept {
  if (phase_ != Phase::kClosed && !settings_.pose_only && !port_.is_lost()) {
    felt_d_ = {};
    is_closing_ = true;
    if (phase_ == Phase::kLost) phase_ = Phase::kRunning;
    const std::int64_t end = port_.now_ns() + kCloseLimit_ns;
    for (std::int64_t now = port_.now_ns();
         now < end && phase_ == Phase::kRunning && support_share_ > 0 && !port_.is_lost();
         now = port_.now_ns()) {
      step(now);
      const std::int64_t until = query_ != Query::kNone ? started_ns_ + late_ns_ + 1 : next_ns_;
      port_.wait(std::min(until, end) - port_.now_ns());
    }
    output_.clear();
    add_to_all(kTorqueEnable, 0);
    static_cast<void>(port_.write(output_.bytes()));
    give_back();
  }
  port_.close();
  phase_ = Phase::kClosed;
  query_ = Query::kNone;
  is_closing_ = is_driven_ = posed_ = any_pose_ = trigger_pulled_ = zero_to_be_written_ =
      zero_unanswered_ = false;
  support_share_ = felt_share_ = 0;
  setup_step_ = cycles_to_watchdog_ = 0;
  next_ns_ = fault_until_ns_ = 0;
  torques_nm_ = {};
}

std::unique_ptr<hal::BridgedDevice> make_dynamixel(const hal::DriverOptions& options,
                                                   hal::DriverDefect& defect) {
  constexpr double kMostTorque_nm = 20, kMostConstant = 20;
  DynamixelSettings settings;
  if (!read_arm_settings(options, settings.arm, defect)) return nullptr;
  const std::size_t joints = settings.arm.arm.model.joint_count;
  if (!read_joint_numbers(options, "torque_limits_nm", joints, 0, kMostTorque_nm,
                          settings.torque_limits_nm, defect) ||
      !read_joint_numbers(options, "torque_nm_per_a", joints, 0.01, kMostConstant,
                          settings.torque_nm_per_a, defect)) {
    return nullptr;
  }
  if (const bool* const flag = options.value<bool>("pose_only")) settings.pose_only = *flag;
  if (const double* const force = options.value<double>("max_force_n")) {
    settings.max_force_n = *force;
  }
  if (const double* const share = options.value<double>("gravity_share")) {
    settings.gravity_share = *share;
  }
  return std::make_unique<DynamixelDevice>(std::move(settings));
}

}  // namespace haptic::tools
