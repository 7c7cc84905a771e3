// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Polhem / WoodenHaptics on plain USB: six sensed, three driven degrees of freedom. Bytes in
/// polhem_codec, the arm in polhem_kinematics. Facts: haptikfabrikenapi (GPL-3; facts only).
///
/// Frame D: axes as the arm's base frame P (x from the base towards the operator, y to his right, z
/// up), origin at the geometry's origin_p_m.
///
/// The encoders count from where they were at power-up. The operator puts the arm into its
/// calibration pose and presses the switch; the driver answers by setting the counts and waits
/// until they arrive. Until then, and after every further press, the link is kStarting and the
/// currents are zero. A program that starts again cannot know that an earlier one had calibrated.

#include "hal/drivers/driver.hpp"
#include "hal/drivers/polhem_codec.hpp"
#include "hal/drivers/polhem_kinematics.hpp"

namespace haptic::hal {

/// 5 N, 800 N/m and 8 N s/m within 100 mm, as the configuration polhem_v1 states them; one count is
/// 3.1e-4 rad at a body, 6e-3 rad at the wrist. The device drops its drives 0.5 s after the last
/// report.
[[nodiscard]] DeviceCapabilities polhem_capabilities() noexcept;

struct PolhemSettings {
  PolhemGeometry geometry;
  /// The board has one switch, and it calibrates. Without a deadman switch beside the device it is
  /// an input device: it declares no driven degree of freedom, and its currents stay zero.
  bool has_deadman = false;
  double max_current_a = 2.0;  ///< what the usual drives can carry; at most 3
  DeviceCapabilities capabilities = polhem_capabilities();
};

class PolhemDriver : public Driver {
 public:
  /// 1234:0006 is the default of the board's library and nobody's registered identity: a search for
  /// devices must not open it. Only a user who names this driver does.
  static constexpr bool kOnRequestOnly = true;

  explicit PolhemDriver(const PolhemSettings& settings = {}) noexcept;

  /// Sends zero currents until the first report comes.
  /// @retval kStartFailed  none came, or what came is no report of this device.
  /// @retval kBadCapabilities  the geometry is not usable.
  [[nodiscard]] HalStatus start(UsbPort& port) noexcept override;

  [[nodiscard]] ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                   DeviceState& state) noexcept override;

  /// Currents within max_current_a, all three scaled together, or the command that sets the counts.
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override;
  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t> report) const noexcept override;

  /// Counts of a calibrated device differ from the commanded ones by at most this: the arm may
  /// move a little while the command travels.
  static constexpr int kCountSlack = 200;

 private:
  enum class Calibration : std::uint8_t { kNone, kPressed, kSent, kDone };
  void follow_calibration(const PolhemReport& report) noexcept;

  PolhemSettings settings_;
  PolhemKinematics arm_;
  bool usable_ = false;
  Calibration calibration_ = Calibration::kNone;
  int reports_since_sent_ = 0;
  PolhemAngles angles_{};
};

}  // namespace haptic::hal
