// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Switches that are not on the device: a pedal, a key.

#include <cstdint>

namespace haptic::hal {

/// The switch of DeviceState::switches that an input beside the device stands for.
inline constexpr std::uint32_t kInputSwitch = std::uint32_t{1} << 31;

/// Owner: the link's thread, which asks at each report and at each output.
class SwitchSource {
 public:
  virtual ~SwitchSource() = default;
  /// Bits pressed now; never blocks.
  [[nodiscard]] virtual std::uint32_t pressed() noexcept = 0;
};

}  // namespace haptic::hal
