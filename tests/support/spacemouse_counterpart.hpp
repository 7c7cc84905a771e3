// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A 3Dconnexion device as the bus sees it: report descriptor, light, reports while its cap is
/// moved. For tests; usable as the port of a driver's start, or byte by byte behind a simulated
/// bus.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "tests/support/device_counterpart.hpp"

namespace haptic::test {

/// A report descriptor as such devices have: six axes of 16 bits from -`range` to `range`, in one
/// report (`joined`) or two, buttons, a light.
[[nodiscard]] std::vector<std::uint8_t> spacemouse_descriptor(std::int16_t range, bool joined);

class SpaceMouseCounterpart : public DeviceCounterpart {
 public:
  explicit SpaceMouseCounterpart(bool joined, std::int16_t range = 350)
      : descriptor(spacemouse_descriptor(range, joined)), joined_(joined) {}

  std::vector<std::uint8_t> descriptor;  ///< empty: the request is stalled
  bool takes_light = true;

  // World side.
  /// Queues the reports of a new displacement: one, or two of three axes each.
  void push(const std::array<std::int16_t, 6>& axes);
  void press(std::uint32_t buttons);
  void say_battery(std::uint8_t percent);
  [[nodiscard]] int light() const { return light_; }  ///< -1: never set

  // Bytes.
  bool on_control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                  std::size_t& moved) override;
  bool on_out(std::span<const std::uint8_t> /*bytes*/) override { return false; }
  std::size_t on_in(std::span<std::uint8_t> bytes) override;

 private:
  bool joined_;
  int light_ = -1;
  std::deque<std::vector<std::uint8_t>> reports_;
};

}  // namespace haptic::test
