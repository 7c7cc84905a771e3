// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An open device of libHD, frame by frame: what its scheduler's callback does. No lock, no heap,
/// no exception.

#include "tools/bridges/openhaptics/hd_calls.hpp"
#include "tools/bridges/vendor/vendor_axes.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

namespace haptic::tools {

struct HdSettings {
  bool has_wrist = false;        ///< orientation is sensed
  bool has_torque = false;       ///< six driven degrees of freedom
  bool device_velocity = false;  ///< twist by the library, else the host's from poses
  int calibration_style = 0;     ///< HdCalibrationStyle, one of those that the device has
};

class HdHandle final : public VendorHandle {
 public:
  /// Frames after the start of the scheduler whose values are not looked at: some come before the
  /// device has said anything.
  static constexpr unsigned kFirstFrames = 10;
  /// Frames in a row with an error of the device, after which it is lost.
  static constexpr unsigned kMostFailures = 3;
  /// Frames for which motors stay warm once the library has said so.
  static constexpr unsigned kWarmFrames = 1000;

  HdHandle(const HdCalls& calls, unsigned handle, const HdSettings& settings)
      : calls_(calls), handle_(handle), settings_(settings) {}

  /// Opens a frame, which `exert` closes.
  [[nodiscard]] VendorResult sense(hal::BridgeSample& sample) noexcept override;
  [[nodiscard]] VendorResult exert(bool drives, const Wrench& wrench_d) noexcept override;

 private:
  [[nodiscard]] bool read_pose(hal::BridgeSample& sample) noexcept;
  [[nodiscard]] bool read_twist(hal::BridgeSample& sample) noexcept;
  void look_after_calibration() noexcept;
  void take_errors() noexcept;

  const HdCalls calls_;
  const unsigned handle_;
  const HdSettings settings_;
  const VendorAxes axes_ = VendorAxes::open_haptics();
  unsigned frames_ = 0, failures_ = 0, warm_ = 0;
  bool has_force_ = false;  ///< the last frame had a wrench that is not zero
  bool is_calibrated_ = false;
  bool has_failed_ = false, is_dropped_ = false;  ///< by the errors of this frame
};

}  // namespace haptic::tools
