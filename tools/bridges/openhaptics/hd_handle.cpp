// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/openhaptics/hd_handle.hpp"

#include <array>

#include "tools/bridges/vendor/vendor_call.hpp"

namespace haptic::tools {
namespace {

constexpr double kMetresPerMillimetre = 1.0e-3;
constexpr double kMillinewtonMetresPerNewtonMetre = 1.0e3;

Vec3 scaled(const double* v, double scale) {
  return {static_cast<Real>(v[0] * scale), static_cast<Real>(v[1] * scale),
          static_cast<Real>(v[2] * scale)};
}

std::array<double, 3> doubles_of(const Vec3& v, double scale) {
  return {static_cast<double>(v.x()) * scale, static_cast<double>(v.y()) * scale,
          static_cast<double>(v.z()) * scale};
}

}  // namespace

void HdHandle::get_doubles(unsigned parameter, std::span<double> values) noexcept {
  (void)hal::through(tap_.get(), hal::TapKind::kCall, call_bytes(parameter),
                     std::as_writable_bytes(values), [&] {
                       calls_.get_double(parameter, values.data());
                       return 0;
                     });
}

void HdHandle::set_doubles(unsigned parameter, const Vec3& vector, double scale) noexcept {
  const std::array<double, 3> values = doubles_of(vector, scale);
  (void)vendor_call_with(tap_, parameter == kHdForce ? "hdSetDoublev force" : "hdSetDoublev torque",
                         values, [&] {
                           calls_.set_double(parameter, values.data());
                           return 0;
                         });
}

/// Warm motors go on; a device that has taken its force away gets none until it is asked for again
/// from zero; errors of the device itself end it.
void HdHandle::take_errors() noexcept {
  for (int k = 0; k < kMostHdErrors; ++k) {
    const auto code = static_cast<unsigned>(
        vendor_call(tap_, "hdGetError", [&] { return static_cast<int>(calls_.get_error().code); }));
    if (code == kHdSuccess) return;
    if (code == kHdWarmMotors) warm_ = kWarmFrames;
    if (code >= kHdExceededMaxForce && code <= kHdForceError) is_dropped_ = true;
    if (code == kHdDeviceFault || code == kHdCommError || code == kHdCommConfigError ||
        code == kHdTimerError)
      has_failed_ = true;
  }
}

/// An update moves the origin, so it waits until the drives are off: with drives on and no force in
/// this frame, the next one would have the force of a pose that has jumped. Until then, and for a
/// while after, the pose counts as not calibrated, which takes the force away.
void HdHandle::look_after_calibration() noexcept {
  const auto calibration = static_cast<unsigned>(vendor_call(
      tap_, "hdCheckCalibration", [&] { return static_cast<int>(calls_.check_calibration()); }));
  is_calibrated_ = calibration == kHdCalibrated && updated_ == 0;
  if (updated_ > 0) --updated_;
  if (calibration != kHdNeedsUpdate || is_driven_) return;
  vendor_order(
      tap_, [&] { calls_.update_calibration(static_cast<unsigned>(settings_.calibration_style)); });
  updated_ = frames_ < kFirstFrames ? 0 : kUpdateFrames;  // nobody has a pose from before
}

bool HdHandle::read_pose(hal::BridgeSample& sample) noexcept {
  double t[16] = {};
  get_doubles(kHdTransform, t);
  Mat3 turned = Mat3::Identity();
  if (settings_.has_wrist) {
    for (int column = 0; column < 3; ++column) turned.col(column) = scaled(t + 4 * column, 1.0);
  }
  return axes_.pose_to_d(scaled(t + 12, kMetresPerMillimetre), turned, sample.pose_dh);
}

bool HdHandle::read_twist(hal::BridgeSample& sample) noexcept {
  double v[3] = {}, w[3] = {};
  get_doubles(kHdVelocity, v);
  if (settings_.has_wrist) get_doubles(kHdAngularVelocity, w);
  const Twist twist_d = {axes_.to_d(scaled(v, kMetresPerMillimetre)), axes_.to_d(scaled(w, 1.0))};
  if (!is_finite(twist_d)) return false;
  sample.twist_d = record_of(twist_d);
  return true;
}

VendorResult HdHandle::sense(hal::BridgeSample& sample) noexcept {
  has_failed_ = is_dropped_ = false;
  // Every call below acts on the current device.
  vendor_order(tap_, [&] { calls_.make_current(handle_); });
  look_after_calibration();
  vendor_order(tap_, [&] { calls_.begin_frame(handle_); });
  const bool is_pose = read_pose(sample);
  sample.twist_valid = settings_.device_velocity && read_twist(sample);
  int buttons = 0;
  (void)vendor_call(tap_, "hdGetIntegerv", buttons, [&] {
    calls_.get_integer(kHdButtons, &buttons);
    return 0;
  });
  sample.switches = static_cast<std::uint32_t>(buttons);
  take_errors();
  sample.calibrated = is_calibrated_;
  if (warm_ > 0) {
    --warm_;
    sample.faults |= kDeviceOverheated;
  }
  const bool is_early = frames_ < kFirstFrames;
  if (is_early) ++frames_;
  return is_early || !is_pose || has_failed_ ? VendorResult::kRefused : VendorResult::kDone;
}

VendorResult HdHandle::exert(bool drives, const Wrench& wrench_d) noexcept {
  const Wrench wrench = drives ? wrench_d : Wrench{};
  set_doubles(kHdForce, axes_.from_d(wrench.force_w), 1.0);
  if (settings_.has_torque)
    set_doubles(kHdTorque, axes_.from_d(wrench.torque_w), kMillinewtonMetresPerNewtonMetre);
  vendor_order(tap_, [&] { calls_.end_frame(handle_); });
  is_driven_ = drives;
  take_errors();
  failures_ = has_failed_ ? failures_ + 1 : 0;
  if (failures_ >= kMostFailures) return VendorResult::kLost;
  return has_failed_ || is_dropped_ ? VendorResult::kRefused : VendorResult::kDone;
}

}  // namespace haptic::tools
