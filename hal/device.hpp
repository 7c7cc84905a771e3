// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The capabilities of a haptic device, apart from the state and the command that it exchanges with
/// the servo thread (rt_core/exchange/device_exchange.hpp). Fixed size, copied by value. SI units;
/// frame D is the device's base frame, H the handle.

#include <array>
#include <cstdint>
#include <string_view>

#include "rt_core/base/pose.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::hal {

/// Groups of degrees of freedom, as bits.
enum DofBit : std::uint32_t {
  kDofX = 1u << 0,
  kDofY = 1u << 1,
  kDofZ = 1u << 2,
  kDofRotX = 1u << 3,
  kDofRotY = 1u << 4,
  kDofRotZ = 1u << 5,
  kDofTranslation = kDofX | kDofY | kDofZ,
  kDofRotation = kDofRotX | kDofRotY | kDofRotZ,
  kDofAll = kDofTranslation | kDofRotation
};

/// A name of a device: printable ASCII, zeros behind it, at least one.
using DeviceText = std::array<char, 24>;

/// Abilities and limits of the device; constant while it is open. A limit of 0 means "not known".
struct DeviceCapabilities {
  std::uint32_t sensed_dof = 0;  ///< DofBit
  std::uint32_t driven_dof = 0;  ///< DofBit; the rest of a wrench is dropped by project_wrench
  Real max_force_n = 0;          ///< norm
  Real max_torque_nm = 0;
  Vec3 max_axis_force_n = Vec3::Zero();  ///< per axis of D
  Vec3 max_axis_torque_nm = Vec3::Zero();
  Real max_force_rate_n_per_s = 0;
  Real max_torque_rate_nm_per_s = 0;
  Real max_stiffness_n_per_m = 0;
  Real max_damping_ns_per_m = 0;
  Real mass_kg = 0;
  Real damping_ns_per_m = 0;
  Real coulomb_friction_n = 0;
  Real encoder_step_m = 0;
  Real encoder_step_rad = 0;
  Real workspace_radius_m = 0;
  std::int64_t watchdog_ns =
      0;  ///< the device drops its drives when no command came for this long; 0: none
  std::int64_t report_period_ns = 0;
  /// Own delay of the device, from a sample to the begin of the wrench that answers it: of its
  /// filters, its bus, a service between. The host's own delay comes on top.
  std::int64_t latency_ns = 0;
  Real largest_gap_m = 0;  ///< of its gripper; 0: it measures none
  /// It measures a displacement, and its pose is the integral of that.
  bool is_displacement = false;
  DeviceText name{}, serial{};  ///< empty: it states none
  /// Between two looks of the bus for a report: bInterval. 0: it has none (bulk, no bus), or it is
  /// not known. The link's, where a device is to be accepted (LinkSettings::accept); no driver
  /// states it.
  std::int64_t bus_interval_ns = 0;
  Quat q_wd = Quat::Identity();         ///< D axes to x right, y away from the operator, z up
  Vec3 handle_offset_h = Vec3::Zero();  ///< handle point about the sensed point [m]

  friend bool operator==(const DeviceCapabilities&, const DeviceCapabilities&) noexcept = default;
};

enum class HalStatus : std::uint8_t {
  kOk = 0,
  kBadCapabilities,  ///< a number is negative or not finite, or a driven degree of freedom is not
                     ///< sensed
  kUsbUnavailable,   ///< libusb could not be initialised
  kDeviceNotFound,   ///< no device of that identity on any bus
  kDeviceDenied,     ///< found, but this user may not open it
  kDeviceBusy,       ///< another program or driver holds its interface
  kDeviceGone,       ///< unplugged
  kDeviceUnfit,      ///< it lacks the interface or the endpoints of its driver
  kTransferFailed,   ///< stall, babble or protocol error that did not clear
  kTimeout,          ///< no answer within the stated time
  kStartFailed,      ///< firmware, homing or calibration failed
  kBadFirmwareFile,  ///< the named image cannot be read or is not one
  kNoMemory,
  kOsRefused,            ///< a call of the operating system failed
  kNotAccepted,          ///< what the device states does not fit what it is to be used for
  kUnknownFirmwareFile,  ///< its hash is not one that the user has stated; nothing was sent
  kCount
};

[[nodiscard]] const char* to_text(HalStatus status) noexcept;

/// `text` as far as it fits; what is not printable becomes a question mark.
[[nodiscard]] DeviceText device_text(std::string_view text) noexcept;
[[nodiscard]] std::string_view text_of(const DeviceText& text) noexcept;
[[nodiscard]] bool is_text(const DeviceText& text) noexcept;

/// Capabilities that a renderer can rely on: finite, non-negative, a unit q_wd, and no degree of
/// freedom driven blindly.
[[nodiscard]] HalStatus check_capabilities(const DeviceCapabilities& capabilities) noexcept;

/// Between two reports that can arrive [ns]: what the device states, or the bus where that is
/// slower. 0: not known.
[[nodiscard]] std::int64_t report_interval_ns(const DeviceCapabilities& capabilities) noexcept;

/// The part of `wrench` that the device can exert: components of undriven degrees of freedom become
/// zero.
[[nodiscard]] Wrench project_wrench(const Wrench& wrench_d, std::uint32_t driven_dof) noexcept;

}  // namespace haptic::hal
