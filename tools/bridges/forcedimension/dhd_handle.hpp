// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An open Force Dimension device, turn by turn. All calls are made on one thread, which may block
/// in any of them.

#include <cstdint>

#include "tools/bridges/forcedimension/dhd_calls.hpp"
#include "tools/bridges/vendor/vendor_axes.hpp"
#include "tools/bridges/vendor/vendor_exchange.hpp"

namespace haptic::tools {

/// The switch that a gripper is: above those of the buttons.
inline constexpr unsigned kGripperSwitch = 16;

struct DhdSettings {
  bool has_wrist = false, has_active_wrist = false;
  bool device_velocity = false;  ///< twist by the library, else the host's from poses
  Real gripper_closed_rad = 0;   ///< below it the gripper is kGripperSwitch; 0: not looked at
};

class DhdHandle final : public VendorHandle {
 public:
  /// Calls in a row that failed, after which the device is lost.
  static constexpr unsigned kMostFailures = 5;
  /// The status is asked for at every so manieth turn.
  static constexpr unsigned kStatusEvery = 16;
  /// The gripper opens again above its angle by this much [rad].
  static constexpr Real kGripperPlay_rad = 0.03_r;

  DhdHandle(const DhdCalls& calls, char id, const DhdSettings& settings)
      : calls_(calls), id_(id), settings_(settings) {}

  [[nodiscard]] VendorResult sense(hal::BridgeSample& sample) noexcept override;
  [[nodiscard]] VendorResult exert(bool drives, const Wrench& wrench_d) noexcept override;

 private:
  [[nodiscard]] VendorResult counted(int result, unsigned& failures) noexcept;
  [[nodiscard]] bool read_twist(hal::BridgeSample& sample) noexcept;
  [[nodiscard]] VendorResult read_status() noexcept;
  void read_switches(hal::BridgeSample& sample) noexcept;
  [[nodiscard]] VendorResult enable(bool force) noexcept;
  [[nodiscard]] int send(const Wrench& wrench_d) noexcept;

  const DhdCalls calls_;
  const char id_;
  const DhdSettings settings_;
  const VendorAxes axes_ = VendorAxes::force_dimension();
  unsigned read_failures_ = 0, force_failures_ = 0, turns_ = 0;
  bool is_calibrated_ = false, is_powered_ = false;
  bool has_force_ = true;  ///< until it was switched off for the first time
  bool dropped_ = false;   ///< the device has switched its force off by itself
  bool gripper_closed_ = false;
};

}  // namespace haptic::tools
