// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the device side and the servo thread tell each other: one time-stamped state, one command.
/// Fixed size, copied by value between threads and processes. SI units; frame D is the device's
/// base frame, H the handle; a Wrench or Twist named `_d` has its components in D axes.

#include <cstdint>
#include <type_traits>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// How far the device can be relied upon.
enum class LinkState : std::uint8_t {
  kAbsent = 0,  ///< not found, unplugged or closed
  kStarting,    ///< found; firmware, homing or calibration not done: poses mean nothing
  kReady        ///< calibrated and reporting
};

/// Reasons why the device side can do no more. The lower half is what the device itself reports,
/// the upper half what the host side of the link found; bits stay set until the cause is gone.
enum DeviceFault : std::uint32_t {
  kDeviceEmergencyStop = 1u << 0,  ///< the e-stop input of the device
  kDeviceWatchdogCut = 1u << 1,    ///< the device dropped its drives: no command came
  kDeviceOverheated = 1u << 2,
  kDeviceDriveFault = 1u << 3,   ///< an amplifier or encoder says so
  kDeviceNotHomed = 1u << 4,     ///< lost its calibration
  kDeviceRefused = 1u << 5,      ///< it rejected a command: check sum or sequence
  kLinkLost = 1u << 16,          ///< unplugged, or a transfer failed for good
  kLinkSilent = 1u << 17,        ///< no valid report for longer than the limit
  kLinkCorrupt = 1u << 18,       ///< too many reports in a row with a wrong length or check sum
  kLinkFrozen = 1u << 19,        ///< reports come, their sequence does not advance
  kLinkStaleCommand = 1u << 20,  ///< the servo's command was too old: ramped down on this side
  kLinkServoLost = 1u << 21,     ///< the servo process ended
  kLinkSendFailed = 1u << 22,    ///< commands can not be handed to the bus
  kLinkOtherDevice = 1u << 23,   ///< the device that came back states other capabilities
  kLinkStopCalled = 1u << 24,    ///< an emergency stop by call, on the device side
  kLinkSuspended = 1u << 25,     ///< the machine slept: what is known is older than its stamps say
  kLinkDeaf = 1u << 26           ///< reports come, and by them the device accepts no command
};

/// Pose, twist and wrench as plain numbers: what crosses threads and processes is trivially
/// copyable.
struct PoseRecord {
  Real p_m[3] = {0, 0, 0};
  Real q_xyzw[4] = {0, 0, 0, 1};
};
struct TwistRecord {
  Real linear_m_per_s[3] = {0, 0, 0}, angular_rad_per_s[3] = {0, 0, 0};
};
struct WrenchRecord {
  Real force_n[3] = {0, 0, 0}, torque_nm[3] = {0, 0, 0};
};

[[nodiscard]] inline Vec3 vec3_of(const Real (&v)[3]) noexcept { return {v[0], v[1], v[2]}; }
[[nodiscard]] inline Pose pose_of(const PoseRecord& r) noexcept {
  return {vec3_of(r.p_m), Quat(r.q_xyzw[3], r.q_xyzw[0], r.q_xyzw[1], r.q_xyzw[2])};
}
[[nodiscard]] inline Twist twist_of(const TwistRecord& r) noexcept {
  return {vec3_of(r.linear_m_per_s), vec3_of(r.angular_rad_per_s)};
}
[[nodiscard]] inline Wrench wrench_of(const WrenchRecord& r) noexcept {
  return {vec3_of(r.force_n), vec3_of(r.torque_nm)};
}
[[nodiscard]] inline PoseRecord record_of(const Pose& p) noexcept {
  return {{p.p_wa.x(), p.p_wa.y(), p.p_wa.z()}, {p.q_wa.x(), p.q_wa.y(), p.q_wa.z(), p.q_wa.w()}};
}
[[nodiscard]] inline TwistRecord record_of(const Twist& t) noexcept {
  return {{t.linear_w.x(), t.linear_w.y(), t.linear_w.z()},
          {t.angular_w.x(), t.angular_w.y(), t.angular_w.z()}};
}
[[nodiscard]] inline WrenchRecord record_of(const Wrench& w) noexcept {
  return {{w.force_w.x(), w.force_w.y(), w.force_w.z()},
          {w.torque_w.x(), w.torque_w.y(), w.torque_w.z()}};
}

/// What the device of this connection may be sent: what it states of itself, the driver and the
/// configuration, the tightest of each. The device side bounds its output by the same numbers.
struct LimitsRecord {
  std::uint32_t connection = 0;  ///< counts the connections of the link; 0: nothing is known
  std::uint32_t driven_dof = 0;  ///< bits x y z rx ry rz
  Real max_force_n = 0, max_torque_nm = 0;                                  ///< norms
  Real max_axis_force_n[3] = {0, 0, 0}, max_axis_torque_nm[3] = {0, 0, 0};  ///< 0: the norm's
  Real slew_n_per_s = 0, slew_nm_per_s = 0;
  std::int64_t report_period_ns = 0;  ///< stated by the device; 0: not known
};

/// One report of the device, as the servo thread gets it.
struct DeviceState {
  std::uint64_t sequence = 0;  ///< counts reports since the link opened; 0: none yet
  std::int64_t stamp_ns = 0;   ///< host monotonic clock at completion of the transfer
  PoseRecord pose_dh;          ///< handle point and handle axes in D
  TwistRecord twist_d;         ///< of the handle point; meaningful only when twist_valid
  bool twist_valid = false;
  LinkState link = LinkState::kAbsent;
  std::uint32_t switches = 0;  ///< bit set = pressed
  std::uint32_t faults = 0;    ///< DeviceFault
  /// The wrench last handed to the device and the tick that asked for it: after every stage.
  WrenchRecord accepted_d;
  std::uint64_t accepted_tick = 0;  ///< 0: none
  LimitsRecord limits;
};

/// One command to the device: force at the handle point and torque about it, in D axes.
struct DeviceCommand {
  std::uint64_t tick = 0;      ///< servo tick that made it, from 1 on; 0: no command yet
  std::int64_t stamp_ns = 0;   ///< host monotonic clock when it was made
  std::uint64_t sequence = 0;  ///< of the state that it answers
  WrenchRecord wrench_d;
  /// Counts how often the operator has armed. A force ramped down on the device side stays down
  /// until this has grown.
  std::uint32_t arming = 0;
};

static_assert(std::is_trivially_copyable_v<DeviceState> &&
              std::is_trivially_copyable_v<DeviceCommand>);

}  // namespace haptic
