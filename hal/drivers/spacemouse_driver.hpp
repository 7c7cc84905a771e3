// SPDX-License-Identifier: Apache-2.0
#pragma once
/// 3Dconnexion six-axis devices: six sensed degrees of freedom, none driven, buttons. What the cap
/// reports is how far it is pushed and turned from its rest; displacement_pose.hpp makes a pose of
/// it, whose origin is where it was when the link opened.
///
/// Reports come while the cap is away from its rest, and one when it returns: a device at rest is
/// silent, and its last velocity was zero. So silence is a hand at rest, from the first moment on.

#include "hal/drivers/displacement_pose.hpp"
#include "hal/drivers/driver.hpp"
#include "hal/drivers/hid_descriptor.hpp"
#include "hal/drivers/spacemouse_codec.hpp"

namespace haptic::hal {

struct SpaceMouseSettings : DisplacementSettings {
  std::uint16_t vendor_id = 0x256f, product_id = 0xc635;
  /// Raw value at full displacement; 0: from the descriptor, else kDisplacementFullScale.
  double full_scale = 0;
  bool light = true;  ///< switched on in start()
};

class SpaceMouseDriver : public Driver {
 public:
  explicit SpaceMouseDriver(const SpaceMouseSettings& settings = {}) noexcept;

  /// Fetches the report descriptor for the axes' ranges and switches the light; a device that
  /// refuses either still works, with kDisplacementFullScale.
  /// @retval kDeviceUnfit  an identity that is refused, or neither of the table nor of the maker.
  [[nodiscard]] HalStatus start(UsbPort& port) noexcept override;

  /// Axes: integrates the velocity so far, then takes over the new one, which `twist_d` is. Buttons
  /// say nothing of the axes: the velocity so far goes on for its time.
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
  void take_axes(std::int64_t stamp_ns) noexcept;
  void fill(DeviceState& state) const noexcept;
  void take_descriptor(std::span<const std::uint8_t> descriptor) noexcept;

  SpaceMouseSettings settings_;
  SpaceMouseAxes axes_;
  bool fit_ = false;
  bool may_be_joined_ = true;
  std::array<double, kHidAxes> scale_{};
  SpaceMouseInput input_;
  DisplacementPose pose_;
};

}  // namespace haptic::hal
