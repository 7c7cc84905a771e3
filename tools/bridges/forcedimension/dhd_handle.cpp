// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/forcedimension/dhd_handle.hpp"

#include "tools/bridges/vendor/vendor_call.hpp"

namespace haptic::tools {
namespace {

constexpr std::uint32_t kButtons = (1u << kGripperSwitch) - 1;

Vec3 vec3(double x, double y, double z) {
  return {static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z)};
}

}  // namespace

/// Results below 0 are failures; 1 (nothing new since the last call) and 2 (a motor gives what it
/// can) are none.
VendorResult DhdHandle::counted(int result, unsigned& failures) noexcept {
  if (result >= 0) {
    failures = 0;
    return VendorResult::kDone;
  }
  const int error = vendor_call(tap_, "dhdErrorGetLast", [&] { return calls_.error_get_last(); });
  const bool is_gone =
      error == kDhdErrorCom || error == kDhdErrorNoDevice || error == kDhdErrorNotReady;
  ++failures;
  return is_gone || failures >= kMostFailures ? VendorResult::kLost : VendorResult::kRefused;
}

VendorResult DhdHandle::sense(hal::BridgeSample& sample) noexcept {
  struct {
    double p[3] = {}, r[3][3] = {};
  } pose;
  const auto& [p, r] = pose;
  const VendorResult read = counted(
      vendor_call(tap_, "dhdGetPositionAndOrientationFrame", pose,
                  [&] { return calls_.get_pose(&pose.p[0], &pose.p[1], &pose.p[2], pose.r, id_); }),
      read_failures_);
  if (read != VendorResult::kDone) return read;
  Mat3 turned = Mat3::Identity();
  if (settings_.has_wrist) {
    for (int row = 0; row < 3; ++row)
      turned.row(row) = vec3(r[row][0], r[row][1], r[row][2]).transpose();
  }
  if (!axes_.pose_to_d(vec3(p[0], p[1], p[2]), turned, sample.pose_dh))
    return VendorResult::kRefused;
  sample.twist_valid = settings_.device_velocity && read_twist(sample);
  read_switches(sample);
  if (turns_++ % kStatusEvery == 0) {
    const VendorResult status = read_status();
    if (status != VendorResult::kDone) return status;
  }
  sample.calibrated = is_calibrated_;
  if (!is_powered_) sample.faults |= kDeviceDriveFault;
  return VendorResult::kDone;
}

bool DhdHandle::read_twist(hal::BridgeSample& sample) noexcept {
  double v[3] = {}, w[3] = {};
  if (vendor_call(tap_, "dhdGetLinearVelocity", v,
                  [&] { return calls_.get_linear_velocity(&v[0], &v[1], &v[2], id_); }) < 0)
    return false;
  if (settings_.has_wrist && vendor_call(tap_, "dhdGetAngularVelocityRad", w, [&] {
                               return calls_.get_angular_velocity(&w[0], &w[1], &w[2], id_);
                             }) < 0)
    return false;
  const Twist twist_d = {axes_.to_d(vec3(v[0], v[1], v[2])), axes_.to_d(vec3(w[0], w[1], w[2]))};
  if (!is_finite(twist_d)) return false;
  sample.twist_d = record_of(twist_d);
  return true;
}

void DhdHandle::read_switches(hal::BridgeSample& sample) noexcept {
  const int mask = vendor_call(tap_, "dhdGetButtonMask",
                               [&] { return static_cast<int>(calls_.get_button_mask(id_)); });
  sample.switches = static_cast<unsigned>(mask) & kButtons;
  if (settings_.gripper_closed_rad <= 0) return;
  double angle_rad = 0;
  // A gripper that cannot be read is open: a deadman switch must not stay pressed.
  const bool is_read =
      vendor_call(tap_, "dhdGetGripperAngleRad", angle_rad,
                  [&] { return calls_.get_gripper_angle(&angle_rad, id_); }) >= 0 &&
      angle_rad >= 0;
  const Real limit_rad =
      settings_.gripper_closed_rad + (gripper_closed_ ? kGripperPlay_rad : 0.0_r);
  gripper_closed_ = is_read && static_cast<Real>(angle_rad) < limit_rad;
  if (gripper_closed_) sample.switches |= 1u << kGripperSwitch;
}

VendorResult DhdHandle::read_status() noexcept {
  int status[kDhdStatusRoom] = {};
  const VendorResult read = counted(
      vendor_call(tap_, "dhdGetStatus", status, [&] { return calls_.get_status(status, id_); }),
      read_failures_);
  if (read != VendorResult::kDone) return read;
  is_powered_ = status[kDhdPower] != 0;
  is_calibrated_ =
      status[kDhdReset] == 0 && (!settings_.has_active_wrist || status[kDhdWristInit] != 0);
  // Its own button, its velocity limit, its watchdog: they stand until the force is asked for again
  // from zero.
  if (has_force_ && status[kDhdForce] == 0) dropped_ = true;
  return VendorResult::kDone;
}

int DhdHandle::send(const Wrench& wrench_d) noexcept {
  const Vec3 f = axes_.from_d(wrench_d.force_w);
  const Vec3 t = settings_.has_active_wrist ? axes_.from_d(wrench_d.torque_w) : Vec3(Vec3::Zero());
  const double w[7] = {static_cast<double>(f.x()),
                       static_cast<double>(f.y()),
                       static_cast<double>(f.z()),
                       static_cast<double>(t.x()),
                       static_cast<double>(t.y()),
                       static_cast<double>(t.z()),
                       0.0};
  return vendor_call_with(tap_, "dhdSetForceAndTorqueAndGripperForce", w, [&] {
    return calls_.set_wrench(w[0], w[1], w[2], w[3], w[4], w[5], w[6], id_);
  });
}

/// Zero stands in the device before its force is switched, either way; one that does not take it is
/// switched off all the same.
VendorResult DhdHandle::enable(bool force) noexcept {
  const VendorResult zero = counted(send(Wrench{}), force_failures_);
  if (force && zero != VendorResult::kDone) return zero;
  const unsigned char on = force ? 1 : 0;
  const VendorResult switched = counted(
      vendor_call_with(tap_, "dhdEnableForce", on, [&] { return calls_.enable_force(on, id_); }),
      force_failures_);
  if (switched != VendorResult::kDone) return switched;
  has_force_ = force;
  dropped_ = false;
  return VendorResult::kDone;
}

VendorResult DhdHandle::exert(bool drives, const Wrench& wrench_d) noexcept {
  if (drives != has_force_) {
    const VendorResult switched = enable(drives);
    if (switched != VendorResult::kDone) return switched;
  }
  if (!drives) return VendorResult::kDone;
  if (dropped_) return VendorResult::kRefused;
  return counted(send(wrench_d), force_failures_);
}

}  // namespace haptic::tools
