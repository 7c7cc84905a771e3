// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Functions of Force Dimension's libdhd, by our own declarations.
///
/// Names, parameters and constants are facts of the DHD reference (forcedimension.com, SDK 3.17).
/// The right-hand column of each was compared with the argument types of forcedimension_core
/// (github.com/EmDash00, MIT, for SDK 3.16), the function pointers of CHAI3D's CDeltaDevices.cpp
/// (BSD) agree where it has them:
///
/// | function | result | parameters |
/// |---|---|---|
/// | dhdGetSDKVersion | none | int* major, minor, release, revision |
/// | dhdGetDeviceCount, dhdOpen | int | none |
/// | dhdOpenID | int | char index |
/// | dhdOpenSerial | int | int serial |
/// | dhdClose, dhdStop, dhdGetSystemType | int | char id |
/// | dhdGetSystemName | const char* | char id |
/// | dhdGetSerialNumber | int | unsigned short*, char id |
/// | dhdHasBase, dhdHasWrist, dhdHasActiveWrist, dhdHasGripper | bool | char id |
/// | dhdGetStatus | int | int[32 at most], char id |
/// | dhdGetPositionAndOrientationFrame | int | double* px, py, pz, double[3][3], char id |
/// | dhdGetLinearVelocity, dhdGetAngularVelocityRad | int | double* x, y, z, char id |
/// | dhdGetButtonMask | unsigned int | char id |
/// | dhdGetGripperAngleRad | int | double*, char id |
/// | dhdEnableForce | int | unsigned char (bool in later ones: the same register), char id |
/// | dhdSetForceAndTorqueAndGripperForce | int | double fx fy fz tx ty tz fg, char id |
/// | dhdSetGravityCompensation | int | int (bool in later ones), char id |
/// | dhdSetWatchdog | int | unsigned char, in 125 us, char id |
/// | dhdGetWatchdog | int | unsigned char*, char id |
/// | dhdEnableExpertMode, dhdDisableExpertMode | int | none |
/// | dhdErrorGetLast | int | none |
/// | dhdErrorGetLastStr | const char* | none |
/// | dhdGetMaxForce, dhdGetMaxTorque | double, below 0: none | char id |

#include <string>

#include "tools/bridges/vendor/vendor_library.hpp"

namespace haptic::tools {

struct DhdCalls {
  void (*get_sdk_version)(int*, int*, int*, int*) = nullptr;
  int (*get_device_count)() = nullptr;
  int (*open)() = nullptr;
  int (*open_id)(char) = nullptr;
  int (*open_serial)(int) = nullptr;
  int (*close)(char) = nullptr;
  int (*stop)(char) = nullptr;
  int (*get_system_type)(char) = nullptr;
  const char* (*get_system_name)(char) = nullptr;
  int (*get_serial_number)(unsigned short*, char) = nullptr;
  bool (*has_base)(char) = nullptr;
  bool (*has_wrist)(char) = nullptr;
  bool (*has_active_wrist)(char) = nullptr;
  bool (*has_gripper)(char) = nullptr;
  int (*get_status)(int*, char) = nullptr;
  int (*get_pose)(double*, double*, double*, double (*)[3], char) = nullptr;
  int (*get_linear_velocity)(double*, double*, double*, char) = nullptr;
  int (*get_angular_velocity)(double*, double*, double*, char) = nullptr;
  unsigned (*get_button_mask)(char) = nullptr;
  int (*get_gripper_angle)(double*, char) = nullptr;
  int (*enable_force)(unsigned char, char) = nullptr;
  int (*set_wrench)(double, double, double, double, double, double, double, char) = nullptr;
  int (*set_gravity_compensation)(int, char) = nullptr;
  int (*set_watchdog)(unsigned char, char) = nullptr;
  int (*get_watchdog)(unsigned char*, char) = nullptr;
  int (*enable_expert_mode)() = nullptr;
  int (*disable_expert_mode)() = nullptr;
  int (*error_get_last)() = nullptr;
  const char* (*error_get_last_str)() = nullptr;
  double (*get_max_force)(char) = nullptr;   ///< null in older libraries
  double (*get_max_torque)(char) = nullptr;  ///< the same
};

/// Room of a status array: the reference has 15 to 17 entries, by the version.
inline constexpr int kDhdStatusRoom = 32;
enum DhdStatus : int {
  kDhdPower = 0,
  kDhdReset = 3,  ///< waits to be calibrated
  kDhdForce = 5,
  kDhdWristInit = 12,
  kDhdForceOffCause = 14
};
/// Errors of dhdErrorGetLast after which the device is gone.
enum DhdError : int { kDhdErrorCom = 2, kDhdErrorNoDevice = 5, kDhdErrorNotReady = 12 };

/// Fills `calls` from `library`. False: `why` says what is missing or which version it is. The
/// declarations are those of 3.x.
[[nodiscard]] bool bind_dhd(VendorLibrary& library, DhdCalls& calls, std::string& why);

/// Version in words, for people: "3.17.6".
[[nodiscard]] std::string dhd_version(const DhdCalls& calls);

}  // namespace haptic::tools
