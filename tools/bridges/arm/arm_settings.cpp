// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/arm/arm_settings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

constexpr double kMostId = 252;  // 253 to 255 mean others, on both buses
constexpr double kFarOutside_rad = 0.2;
constexpr double kMostAngle_rad = 1000;

/// The text of a key that must be there.
bool read_text(const hal::DriverOptions& options, std::string_view key, const std::string& fix,
               std::string& text, hal::DriverDefect& defect) {
  const auto* const value = options.value<std::string>(key);
  if (value == nullptr || value->empty()) {
    defect = {key, "is missing; " + fix};
    return false;
  }
  text = *value;
  return true;
}

bool read_ids(const hal::DriverOptions& options, ArmSettings& settings, hal::DriverDefect& defect) {
  const std::size_t joints = settings.arm.model.joint_count;
  std::vector<double> numbers;
  if (!read_numbers(options, "ids", joints, 0, kMostId, numbers, defect)) return false;
  for (std::size_t k = 0; numbers.empty() && k < joints; ++k) {
    settings.ids.push_back(static_cast<std::uint8_t>(k + 1));
  }
  for (const double number : numbers) {
    const auto id = static_cast<std::uint8_t>(number);
    if (id != number || std::ranges::count(settings.ids, id) != 0) {
      defect = {"ids", "are whole numbers, each another one, from the base to the handle"};
      return false;
    }
    settings.ids.push_back(id);
  }
  return true;
}

bool read_trigger(const hal::DriverOptions& options, ArmSettings& settings,
                  hal::DriverDefect& defect) {
  const double* const id = options.value<double>("trigger_id");
  const bool has_angles = options.value<std::string>("trigger_rad") != nullptr;
  if (id == nullptr && !has_angles) return true;
  if (id == nullptr || !has_angles) {
    defect = {id == nullptr ? "trigger_id" : "trigger_rad",
              "is missing; a trigger has its servo's trigger_id and trigger_rad = \"OPEN CLOSED\""};
    return false;
  }
  std::vector<double> angles;
  if (!read_numbers(options, "trigger_rad", 2, -kMostAngle_rad, kMostAngle_rad, angles, defect)) {
    return false;
  }
  TriggerSettings& trigger = settings.trigger;
  trigger = {true, static_cast<std::uint8_t>(std::clamp(*id, 0.0, kMostId)), angles[0], angles[1]};
  if (trigger.id != *id || std::ranges::count(settings.ids, trigger.id) != 0) {
    defect = {"trigger_id", "is the whole number of a servo that is no joint's"};
    return false;
  }
  if (std::abs(trigger.open_rad - trigger.closed_rad) < 10 * kCountStep_rad) {
    defect = {"trigger_rad", "leaves the trigger no way; give the servo's angles open and closed"};
    return false;
  }
  return true;
}

/// Turns about the fixed axes x, y, z in this order, and the place of B's origin in D.
bool place_base(const hal::DriverOptions& options, ArmModel& model, hal::DriverDefect& defect) {
  std::vector<double> turns_deg{0, 0, 90}, origin_m{0, 0, 0};
  if (!read_numbers(options, "base_rpy_deg", 3, -360, 360, turns_deg, defect) ||
      !read_numbers(options, "origin_m", 3, -10, 10, origin_m, defect)) {
    return false;
  }
  using Axis = Eigen::AngleAxis<double>;
  const double degree = kTurn_rad / 360;
  model.turn_db = (Axis(turns_deg[2] * degree, Eigen::Vector3d::UnitZ()) *
                   Axis(turns_deg[1] * degree, Eigen::Vector3d::UnitY()) *
                   Axis(turns_deg[0] * degree, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  // The key says where D's origin is in B.
  model.origin_d = -(model.turn_db * Column3(origin_m[0], origin_m[1], origin_m[2]));
  return true;
}

}  // namespace

bool read_numbers(const hal::DriverOptions& options, std::string_view key, std::size_t count,
                  double least, double most, std::vector<double>& numbers,
                  hal::DriverDefect& defect) {
  const auto* const text = options.value<std::string>(key);
  if (text == nullptr) return true;
  std::vector<double> found;
  const char* at = text->data();
  const char* const end = at + text->size();
  const auto is_gap = [](char c) { return c == ' ' || c == ',' || c == '\t' || c == '\n'; };
  for (;;) {
    while (at != end && is_gap(*at)) ++at;
    if (at == end) break;
    double number = 0;
    const char* const digits = *at == '+' && end - at > 1 && at[1] != '-' ? at + 1 : at;
    const auto [after, error] = std::from_chars(digits, end, number);
    if (error != std::errc() || (after != end && !is_gap(*after)) || !(number >= least) ||
        !(number <= most)) {
      const char* const word_end = std::find_if(at, end, is_gap);
      defect = {key, "'" + std::string(at, std::min(word_end, at + 20)) + "' is no number from " +
                         short_number(least, 4) + " to " + short_number(most, 4)};
      return false;
    }
    found.push_back(number);
    at = after;
  }
  if (found.size() != count) {
    defect = {key, "has " + std::to_string(found.size()) + " numbers; give " +
                       std::to_string(count) + ", separated by blanks"};
    return false;
  }
  numbers = std::move(found);
  return true;
}

bool read_joint_numbers(const hal::DriverOptions& options, std::string_view key, std::size_t count,
                        double least, double most, JointNumbers& numbers,
                        hal::DriverDefect& defect) {
  std::vector<double> found;
  if (!read_numbers(options, key, count, least, most, found, defect)) return false;
  std::ranges::copy(found, numbers.begin());
  return true;
}

bool read_arm_settings(const hal::DriverOptions& options, ArmSettings& settings,
                       hal::DriverDefect& defect) {
  settings = {};
  std::string urdf, base, tip;
  if (!read_text(options, "port", "name the adapter, as /dev/serial/by-id/usb-...", settings.port,
                 defect) ||
      !read_text(options, "urdf", "name the description of the arm, as arm.urdf", urdf, defect) ||
      !read_text(options, "base_link", "name the link that stands still", base, defect) ||
      !read_text(options, "tip_link", "name the link that the hand holds", tip, defect)) {
    return false;
  }
  if (const double* const baud = options.value<double>("baud")) {
    if (*baud != std::floor(*baud)) {
      defect = {"baud", "is a whole number, as 1000000"};
      return false;
    }
    settings.baud = static_cast<std::uint32_t>(*baud);
  }
  try {
    settings.arm = read_arm(urdf, base, tip);
  } catch (const InputError& error) {
    defect = {"urdf", error.what()};
    return false;
  }
  const std::size_t joints = settings.arm.model.joint_count;
  settings.signs.fill(1);
  if (!read_ids(options, settings, defect) || !read_trigger(options, settings, defect) ||
      !read_joint_numbers(options, "offsets_rad", joints, -kMostAngle_rad, kMostAngle_rad,
                          settings.offsets_rad, defect) ||
      !read_joint_numbers(options, "signs", joints, -1, 1, settings.signs, defect) ||
      !place_base(options, settings.arm.model, defect)) {
    return false;
  }
  for (const double sign : settings.signs) {
    if (std::abs(sign) == 1) continue;
    defect = {"signs", "are 1 or -1"};
    return false;
  }
  return true;
}

JointNumbers nearest_turns(const ArmModel& model, const JointNumbers& angles_rad) {
  JointNumbers turns{};
  for (std::size_t k = 0; k < model.joint_count; ++k) {
    const ArmJoint& joint = model.joints[k];
    const double middle = joint.limited ? (joint.lower_rad + joint.upper_rad) / 2 : 0;
    turns[k] = kTurn_rad * std::round((middle - angles_rad[k]) / kTurn_rad);
  }
  return turns;
}

std::string outside_limits(const ArmSettings& settings, const JointNumbers& angles_rad) {
  for (std::size_t k = 0; k < settings.arm.model.joint_count; ++k) {
    const ArmJoint& joint = settings.arm.model.joints[k];
    const double angle = angles_rad[k];
    if (!joint.limited ||
        (angle > joint.lower_rad - kFarOutside_rad && angle < joint.upper_rad + kFarOutside_rad)) {
      continue;
    }
    return "joint '" + settings.arm.joint_names[k] + "' (servo " + std::to_string(settings.ids[k]) +
           ") stands at " + short_number(angle, 3) + " rad, outside its limits " +
           short_number(joint.lower_rad, 3) + " to " + short_number(joint.upper_rad, 3) +
           "; correct offsets_rad or signs, or move the arm";
  }
  return {};
}

bool is_pulled(const TriggerSettings& trigger, double servo_rad, bool was_pulled) noexcept {
  const double way = (servo_rad - trigger.open_rad) / (trigger.closed_rad - trigger.open_rad);
  return way > (was_pulled ? 0.4 : 0.6);
}

}  // namespace haptic::tools
