// SPDX-License-Identifier: Apache-2.0
#pragma once
/// 3Dconnexion six-axis devices: six sensed degrees of freedom, none driven, buttons. What the cap
/// reports is how far it is pushed and turned from its rest, which stands for a velocity: the
/// driver integrates it to a pose over the time between reports.
///
/// Frame D: x right, y away from the operator, z up, origin where the pose was when the link
/// opened. Reports come while the cap is away from its rest, and one when it returns: a device at
/// rest is silent, and its last velocity was zero. So silence is a hand at rest, from the first
/// moment on; before that a velocity lasts until the next report, or for longest_step_ns.

#include "hal/drivers/driver.hpp"
#include "hal/drivers/hid_descriptor.hpp"
#include "hal/drivers/spacemouse_codec.hpp"

namespace haptic::hal {

/// Full scale where neither descriptor nor user says one: the logical maximum that current models
/// declare.
inline constexpr double kSpaceMouseFullScale = 350.0;

struct SpaceMouseSettings {
  std::uint16_t vendor_id = 0x256f, product_id = 0xc635;
  Real full_speed_m_per_s = 0.10_r;  ///< at full displacement
  Real full_turn_rad_per_s = 1.0_r;  ///< at full turn
  Real dead_zone = 0.05_r;           ///< share of full scale that counts as rest, below 0.9
  Real reach_m = 0.25_r;             ///< the pose stays within this distance of the origin
  double full_scale = 0;             ///< of a raw axis; 0: from the descriptor
  std::int64_t longest_step_ns = 50'000'000;  ///< longest time that one velocity is taken to last
  bool light = true;                          ///< switched on in start()
};

class SpaceMouseDriver : public Driver {
 public:
  explicit SpaceMouseDriver(const SpaceMouseSettings& settings = {}) noexcept;

  /// Fetches the report descriptor for the axes' ranges and switches the light; a device that
  /// refuses either still works, with kSpaceMouseFullScale.
  /// @retval kDeviceUnfit  an identity that is refused, or neither of the table nor of the maker.
  [[nodiscard]] HalStatus start(UsbPort& port) noexcept override;

  /// Integrates the velocity so far over the time since the last report, at most longest_step_ns,
  /// then takes over the new one. `twist_d` is the new one.
  [[nodiscard]] ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                   DeviceState& state) noexcept override;

  /// Nothing to send: no degree of freedom is driven.
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override;
  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t> report) const noexcept override;

  /// The pose where the hand has it by now.
  [[nodiscard]] bool rest(std::int64_t stamp_ns, DeviceState& state) noexcept override;

  [[nodiscard]] const SpaceMouseInput& input() const noexcept { return input_; }
  /// Full scale of the raw axis, after start().
  [[nodiscard]] double full_scale_of(std::size_t axis) const noexcept { return scale_[axis]; }

 private:
  void integrate(std::int64_t stamp_ns) noexcept;
  void take_velocity() noexcept;
  void fill(DeviceState& state) const noexcept;
  void take_descriptor(std::span<const std::uint8_t> descriptor) noexcept;

  SpaceMouseSettings settings_;
  SpaceMouseAxes axes_;
  bool fit_ = false;
  bool may_be_joined_ = true;
  std::array<double, kHidAxes> scale_{};
  SpaceMouseInput input_;
  Pose pose_dh_;
  Twist velocity_d_;
  std::int64_t stamp_ns_ = 0;     ///< up to which the velocity is in the pose
  std::int64_t reported_ns_ = 0;  ///< when it was reported
  bool stamped_ = false;
};

}  // namespace haptic::hal
