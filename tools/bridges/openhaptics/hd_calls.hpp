// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Functions of 3D Systems' libHD (HDAPI of OpenHaptics 3.x), by our own declarations.
///
/// Names, parameters and constants are facts of the OpenHaptics API Reference Guide (3D Systems,
/// 3.5.0). The widths were compared with ManagedPhantom's declarations (github.com/kirurobo, MIT)
/// and with how the ROS drivers of the Touch use them; `unsigned long` has 64 bits on Linux:
///
/// | function | result | parameters |
/// |---|---|---|
/// | hdInitDevice | unsigned int: handle | const char* name; null: the default device |
/// | hdDisableDevice, hdMakeCurrentDevice, hdBeginFrame, hdEndFrame | none | unsigned int handle |
/// | hdEnable, hdDisable | none | unsigned int capability |
/// | hdIsEnabled | unsigned char | unsigned int capability |
/// | hdGetError | HdErrorInfo by value | none |
/// | hdGetErrorString | const char* | unsigned int error |
/// | hdGetString | const char* | unsigned int parameter |
/// | hdGetIntegerv | none | unsigned int parameter, int* |
/// | hdGetDoublev | none | unsigned int parameter, double* |
/// | hdSetDoublev | none | unsigned int parameter, const double* |
/// | hdCheckCalibration | unsigned int | none |
/// | hdUpdateCalibration | none | unsigned int style |
/// | hdSetSchedulerRate | none | unsigned long |
/// | hdScheduleAsynchronous | unsigned long: handle | callback, void*, unsigned short priority |
/// | hdUnschedule | none | unsigned long handle |
/// | hdStartScheduler, hdStopScheduler | none | none |

#include <string>

#include "tools/bridges/vendor/vendor_library.hpp"

namespace haptic::tools {

struct HdErrorInfo {
  unsigned code = 0;
  int internal = 0;
  unsigned handle = 0;
};

using HdCallback = unsigned (*)(void*);

struct HdCalls {
  unsigned (*init_device)(const char*) = nullptr;
  void (*disable_device)(unsigned) = nullptr;
  void (*make_current)(unsigned) = nullptr;
  void (*begin_frame)(unsigned) = nullptr;
  void (*end_frame)(unsigned) = nullptr;
  void (*enable)(unsigned) = nullptr;
  void (*disable)(unsigned) = nullptr;
  unsigned char (*is_enabled)(unsigned) = nullptr;
  HdErrorInfo (*get_error)() = nullptr;
  const char* (*get_error_string)(unsigned) = nullptr;
  const char* (*get_string)(unsigned) = nullptr;
  void (*get_integer)(unsigned, int*) = nullptr;
  void (*get_double)(unsigned, double*) = nullptr;
  void (*set_double)(unsigned, const double*) = nullptr;
  unsigned (*check_calibration)() = nullptr;
  void (*update_calibration)(unsigned) = nullptr;
  void (*set_scheduler_rate)(unsigned long) = nullptr;
  unsigned long (*schedule)(HdCallback, void*, unsigned short) = nullptr;
  void (*unschedule)(unsigned long) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
};

enum HdParameter : unsigned {
  kHdButtons = 0x2000,
  kHdVelocity = 0x2051,         ///< mm/s
  kHdTransform = 0x2052,        ///< 4 x 4 by columns, mm
  kHdAngularVelocity = 0x2053,  ///< rad/s
  kHdVersion = 0x2500,
  kHdModel = 0x2501,
  kHdDriverVersion = 0x2502,
  kHdSerial = 0x2504,
  kHdUsableWorkspace = 0x2551,  ///< least x y z, largest x y z; mm
  kHdInputDof = 0x2553,
  kHdOutputDof = 0x2554,
  kHdCalibrationStyle = 0x2555,
  kHdMaxStiffness = 0x2602,        ///< N/mm
  kHdMaxForce = 0x2603,            ///< N
  kHdMaxContinuousForce = 0x2604,  ///< N
  kHdMaxDamping = 0x2609,          ///< N s/mm
  kHdMaxTorque = 0x2622,           ///< mN m
  kHdForce = 0x2700,               ///< N
  kHdTorque = 0x2701               ///< mN m, about the axes of the base
};
enum HdCapability : unsigned {
  kHdForceOutput = 0x4000,
  kHdMaxForceClamping = 0x4001,
  kHdForceRamping = 0x4002
};
enum HdCalibration : unsigned {
  kHdCalibrated = 0x5000,
  kHdNeedsUpdate = 0x5001,
  kHdNeedsManualInput = 0x5002
};
enum HdCalibrationStyle : int { kHdEncoderReset = 1, kHdAuto = 2, kHdInkwell = 4 };
enum HdError : unsigned {
  kHdSuccess = 0,
  kHdInvalidValue = 0x0101,
  kHdWarmMotors = 0x0200,
  kHdExceededMaxForce = 0x0201,
  kHdForceError = 0x0204,  ///< from kHdExceededMaxForce to here it has taken its force away
  kHdDeviceFault = 0x0300,
  kHdAlreadyInitiated = 0x0301,
  kHdCommError = 0x0302,
  kHdCommConfigError = 0x0303,
  kHdTimerError = 0x0304,
  kHdInvalidLicense = 0x0600
};
inline constexpr unsigned kHdNoHandle = 0xffffffff;
inline constexpr unsigned short kHdHighestPriority = 0xffff;
inline constexpr unsigned kHdCallbackDone = 0, kHdCallbackContinue = 1;
/// Errors are on a stack; so many are taken at most from one that does not empty.
inline constexpr int kMostHdErrors = 16;

/// Fills `calls` from `library`. False: `why` says what is missing.
[[nodiscard]] bool bind_hd(VendorLibrary& library, HdCalls& calls, std::string& why);

/// Takes all errors off the stack. @return the oldest of them, which is the cause; code 0: none.
[[nodiscard]] HdErrorInfo take_hd_errors(const HdCalls& calls) noexcept;

/// "HD_COMM_ERROR (0x0302, internal 7)" by the library's own words.
[[nodiscard]] std::string hd_error_text(const HdCalls& calls, const HdErrorInfo& error);

}  // namespace haptic::tools
