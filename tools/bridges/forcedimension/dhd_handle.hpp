// SPDX-License-Identifier: Apache-2.0
#pragma once
/// An open Force Dimension device, turn by turn. All calls are made on one thread, which may block
/// in any of them.

#include <cstdint>
#include <memory>
#include <utility>

#include "hal/bridge/device_tap.hpp"
#include "tools/bridges/forcedimension/dhd_calls.hpp"
#include "tools/bridges/vendor/tapped_handle.hpp"
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

/// The settings as a recording has them.
[[nodiscard]] inline VendorNumbers numbers_of(const DhdSettings& s) {
  return {s.has_wrist ? 1.0 : 0.0, s.has_active_wrist ? 1.0 : 0.0, s.device_velocity ? 1.0 : 0.0,
          static_cast<double>(s.gripper_closed_rad)};
}
[[nodiscard]] inline DhdSettings dhd_settings_of(const VendorNumbers& n) {
  return {n[0] != 0, n[1] != 0, n[2] != 0, static_cast<Real>(n[3])};
}

class DhdHandle final : public VendorHandle {
 public:
  /// Calls in a row that failed, after which the device is lost.
  static constexpr unsigned kMostFailures = 5;
  /// The status is asked for at every so manieth turn.
  static constexpr unsigned kStatusEvery = 16;
  /// The gripper opens again above its angle by this much [rad].
  static constexpr Real kGripperPlay_rad = 0.03_r;

  /// @param tap  the calls of a turn go through it; may be null. In a replay `calls` are not used.
  DhdHandle(const DhdCalls& calls, char id, const DhdSettings& settings,
            std::shared_ptr<hal::DeviceTap> tap = nullptr)
      : calls_(calls), id_(id), settings_(settings), tap_(std::move(tap)) {}

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
  const std::shared_ptr<hal::DeviceTap> tap_;
  const VendorAxes axes_ = VendorAxes::force_dimension();
  unsigned read_failures_ = 0, force_failures_ = 0, turns_ = 0;
  bool is_calibrated_ = false, is_powered_ = false;
  bool has_force_ = true;  ///< until it was switched off for the first time
  bool dropped_ = false;   ///< the device has switched its force off by itself
  bool gripper_closed_ = false;
};

}  // namespace haptic::tools
