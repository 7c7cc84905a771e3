// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An open device of libHD, frame by frame: what its scheduler's callback does. No lock, no heap,
/// no exception.

#include <memory>
#include <span>
#include <utility>

#include "hal/bridge/device_tap.hpp"
#include "tools/bridges/openhaptics/hd_calls.hpp"
#include "tools/bridges/vendor/tapped_handle.hpp"
#include "tools/bridges/vendor/vendor_axes.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

namespace haptic::tools {

struct HdSettings {
  bool has_wrist = false;        ///< orientation is sensed
  bool has_torque = false;       ///< six driven degrees of freedom
  bool device_velocity = false;  ///< twist by the library, else the host's from poses
  int calibration_style = 0;     ///< HdCalibrationStyle, one of those that the device has
};

/// The settings as a recording has them. @return of numbers that are none of a style: 0.
[[nodiscard]] inline VendorNumbers numbers_of(const HdSettings& s) {
  return {s.has_wrist ? 1.0 : 0.0, s.has_torque ? 1.0 : 0.0, s.device_velocity ? 1.0 : 0.0,
          static_cast<double>(s.calibration_style)};
}
[[nodiscard]] inline HdSettings hd_settings_of(const VendorNumbers& n) {
  const int style = n[3] >= 0 && n[3] <= 0xffff ? static_cast<int>(n[3]) : 0;
  return {n[0] != 0, n[1] != 0, n[2] != 0, style};
}

class HdHandle final : public VendorHandle {
 public:
  /// Frames after the start of the scheduler whose values are not looked at: some come before the
  /// device has said anything.
  static constexpr unsigned kFirstFrames = 10;
  /// Frames in a row with an error of the device, after which it is lost.
  static constexpr unsigned kMostFailures = 3;
  /// Frames for which motors stay warm once the library has said so.
  static constexpr unsigned kWarmFrames = 1000;
  /// Frames after an update that count as not calibrated: the origin has moved, and the host must
  /// hear of that although it looks at the newest sample alone.
  static constexpr unsigned kUpdateFrames = 50;

  /// @param tap  the calls of a frame that have values go through it; may be null. In a replay
  ///   `calls` are not used.
  HdHandle(const HdCalls& calls, unsigned handle, const HdSettings& settings,
           std::shared_ptr<hal::DeviceTap> tap = nullptr)
      : calls_(calls), handle_(handle), settings_(settings), tap_(std::move(tap)) {}

  /// Opens a frame, which `exert` closes.
  [[nodiscard]] VendorResult sense(hal::BridgeSample& sample) noexcept override;
  [[nodiscard]] VendorResult exert(bool drives, const Wrench& wrench_d) noexcept override;

 private:
  [[nodiscard]] bool read_pose(hal::BridgeSample& sample) noexcept;
  [[nodiscard]] bool read_twist(hal::BridgeSample& sample) noexcept;
  void look_after_calibration() noexcept;
  void take_errors() noexcept;
  void get_doubles(unsigned parameter, std::span<double> values) noexcept;
  void set_doubles(unsigned parameter, const Vec3& vector, double scale) noexcept;

  const HdCalls calls_;
  const unsigned handle_;
  const HdSettings settings_;
  const std::shared_ptr<hal::DeviceTap> tap_;
  const VendorAxes axes_ = VendorAxes::open_haptics();
  unsigned frames_ = 0, failures_ = 0, warm_ = 0;
  unsigned updated_ = 0;    ///< frames since an update that are left of kUpdateFrames
  bool is_driven_ = false;  ///< the last frame had the drives on, with or without a wrench
  bool is_calibrated_ = false;
  bool has_failed_ = false, is_dropped_ = false;  ///< by the errors of this frame
};

}  // namespace haptic::tools
