// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A gripper as a switch: pressed while it is closed.

#include <cmath>
#include <cstdint>
#include <optional>

#include "rt_core/base/scalar.hpp"

namespace haptic::hal {

/// The switch of DeviceState::switches that a closed gripper stands for, where it is asked for.
inline constexpr std::uint32_t kClosedGripper = std::uint32_t{1} << 30;

struct GripperSettings {
  Real closes_m = 0;  ///< at this gap or less it is closed; 0: it is no switch
  Real opens_m = 0;   ///< at this gap or more it is open; above closes_m
  [[nodiscard]] bool is_used() const noexcept { return closes_m > 0; }
};

/// Owner: one thread. Pure.
class GripperSwitch {
 public:
  explicit GripperSwitch(const GripperSettings& settings) noexcept : settings_(settings) {}

  /// Between the two gaps it stays as it was; a gap that is not measured is open, so that no
  /// deadman switch stays pressed.
  [[nodiscard]] bool closed(std::optional<Real> gap_m) noexcept {
    if (!settings_.is_used() || !gap_m || !std::isfinite(*gap_m)) return is_closed_ = false;
    if (*gap_m <= settings_.closes_m) is_closed_ = true;
    if (*gap_m >= settings_.opens_m) is_closed_ = false;
    return is_closed_;
  }
  void open() noexcept { is_closed_ = false; }

 private:
  GripperSettings settings_;
  bool is_closed_ = false;
};

}  // namespace haptic::hal
