// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/forcedimension/dhd_calls.hpp"

#include <array>

namespace haptic::tools {
namespace {

constexpr int kMajor = 3;
constexpr int kLargestNumber = 99'999;

/// Major, minor, release; -1 where the library has written nothing.
std::array<int, 3> numbers_of(const DhdCalls& calls) {
  std::array<int, 3> n = {-1, -1, -1};
  int revision = -1;
  calls.get_sdk_version(&n[0], &n[1], &n[2], &revision);
  return n;
}

}  // namespace

std::string dhd_version(const DhdCalls& calls) {
  const std::array<int, 3> n = numbers_of(calls);
  return std::to_string(n[0]) + "." + std::to_string(n[1]) + "." + std::to_string(n[2]);
}

bool bind_dhd(VendorLibrary& library, DhdCalls& calls, std::string& why) {
  library.bind(calls.get_sdk_version, "dhdGetSDKVersion");
  library.bind(calls.get_device_count, "dhdGetDeviceCount");
  library.bind(calls.open, "dhdOpen");
  library.bind(calls.open_id, "dhdOpenID");
  library.bind(calls.open_serial, "dhdOpenSerial");
  library.bind(calls.close, "dhdClose");
  library.bind(calls.stop, "dhdStop");
  library.bind(calls.get_system_type, "dhdGetSystemType");
  library.bind(calls.get_system_name, "dhdGetSystemName");
  library.bind(calls.get_serial_number, "dhdGetSerialNumber");
  library.bind(calls.has_base, "dhdHasBase");
  library.bind(calls.has_wrist, "dhdHasWrist");
  library.bind(calls.has_active_wrist, "dhdHasActiveWrist");
  library.bind(calls.has_gripper, "dhdHasGripper");
  library.bind(calls.get_status, "dhdGetStatus");
  library.bind(calls.get_pose, "dhdGetPositionAndOrientationFrame");
  library.bind(calls.get_linear_velocity, "dhdGetLinearVelocity");
  library.bind(calls.get_angular_velocity, "dhdGetAngularVelocityRad");
  library.bind(calls.get_button_mask, "dhdGetButtonMask");
  library.bind(calls.get_gripper_angle, "dhdGetGripperAngleRad");
  library.bind(calls.enable_force, "dhdEnableForce");
  library.bind(calls.set_wrench, "dhdSetForceAndTorqueAndGripperForce");
  library.bind(calls.set_gravity_compensation, "dhdSetGravityCompensation");
  library.bind(calls.set_watchdog, "dhdSetWatchdog");
  library.bind(calls.get_watchdog, "dhdGetWatchdog");
  library.bind(calls.enable_expert_mode, "dhdEnableExpertMode");
  library.bind(calls.disable_expert_mode, "dhdDisableExpertMode");
  library.bind(calls.error_get_last, "dhdErrorGetLast");
  library.bind(calls.error_get_last_str, "dhdErrorGetLastStr");
  library.bind_optional(calls.get_max_force, "dhdGetMaxForce");
  library.bind_optional(calls.get_max_torque, "dhdGetMaxTorque");
  why = library.defect();
  if (!why.empty()) return false;
  const std::array<int, 3> n = numbers_of(calls);
  const bool is_plain = n[1] >= 0 && n[1] <= kLargestNumber && n[2] >= 0 && n[2] <= kLargestNumber;
  if (n[0] == kMajor && is_plain) return true;
  why = library.file() + " says that it is version " + dhd_version(calls) +
        "; this bridge knows the calls of version 3: install an SDK 3.x of Force Dimension";
  return false;
}

}  // namespace haptic::tools
