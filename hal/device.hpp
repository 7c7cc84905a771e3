// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a haptic device is to the servo loop: capabilities, one time-stamped state, one command.
/// Fixed size, copied by value between threads. SI units; frame D is the device's base frame.

#include <cstdint>

#include "rt_core/base/pose.hpp"

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

/// What the device can do; constant while it is open. A limit of 0 means "not known".
struct DeviceCapabilities {
  std::uint32_t sensed_dof = 0;  ///< DofBit
  std::uint32_t driven_dof = 0;  ///< DofBit; the rest of a wrench is dropped by project_wrench
  Real max_force_n = 0;
  Real max_torque_nm = 0;
  Real max_force_rate_n_per_s = 0;
  Real max_torque_rate_nm_per_s = 0;
  Real max_stiffness_n_per_m = 0;
  Real max_damping_ns_per_m = 0;
  Real mass_kg = 0;
  Real damping_ns_per_m = 0;
  Real coulomb_friction_n = 0;
  Real encoder_step_m = 0;
  std::int64_t watchdog_ns =
      0;  ///< the device drops its drives when no command came for this long; 0: none
  std::int64_t report_period_ns = 0;
  Vec3 handle_offset_d =
      Vec3::Zero();  ///< handle point about the sensed point, in the handle's frame [m]
};

/// One report of the device.
struct DeviceState {
  std::uint64_t sequence = 0;
  std::int64_t stamp_ns = 0;  ///< host monotonic clock at completion of the transfer
  Pose pose_dh;               ///< handle in D
  Twist twist_d;
  bool twist_valid = false;
  std::uint32_t switches = 0;  ///< bit set = pressed
  std::uint32_t faults = 0;    ///< bit set = present
};

/// One command to the device: force and torque at the handle point in D axes.
struct DeviceCommand {
  std::uint64_t tick = 0;  ///< servo tick that made it
  Wrench wrench_d;
};

enum class HalStatus : std::uint8_t {
  kOk = 0,
  kBadCapabilities,  ///< a number is negative or not finite, or a driven degree of freedom is not
                     ///< sensed
  kCount
};

[[nodiscard]] const char* to_text(HalStatus status) noexcept;

/// Capabilities that a renderer can rely on: finite, non-negative, and no degree of freedom driven
/// blindly.
[[nodiscard]] HalStatus check_capabilities(const DeviceCapabilities& capabilities) noexcept;

/// The part of `wrench` that the device can exert: components of undriven degrees of freedom become
/// zero.
[[nodiscard]] Wrench project_wrench(const Wrench& wrench_d, std::uint32_t driven_dof) noexcept;

}  // namespace haptic::hal
