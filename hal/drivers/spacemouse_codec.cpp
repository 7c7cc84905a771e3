// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacemouse_codec.hpp"

#include <algorithm>

namespace haptic::hal {
namespace {

void take_axes(std::span<const std::uint8_t> bytes, std::span<std::int16_t> axes) noexcept {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i] =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
  }
}

void put_axes(std::span<const std::int16_t> axes, std::span<std::uint8_t> bytes) noexcept {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto pattern = static_cast<std::uint16_t>(axes[i]);
    bytes[2 * i] = static_cast<std::uint8_t>(pattern & 0xffu);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(pattern >> 8);
  }
}

}  // namespace

SpaceMouseReport decode(std::span<const std::uint8_t> report, bool may_be_joined,
                        SpaceMouseInput& input) noexcept {
  if (report.empty()) return SpaceMouseReport::kBadLength;
  const std::span<const std::uint8_t> rest = report.subspan(1);
  const std::span<std::int16_t> axes(input.axes);
  switch (report[0]) {
    case 1:
      if (report.size() < kSpaceMouseShortBytes) return SpaceMouseReport::kBadLength;
      if (!may_be_joined || report.size() < kSpaceMouseLongBytes) {
        take_axes(rest, axes.first(3));
        return SpaceMouseReport::kTranslation;
      }
      take_axes(rest, axes);
      return SpaceMouseReport::kAllAxes;
    case 2:
      if (report.size() < kSpaceMouseShortBytes) return SpaceMouseReport::kBadLength;
      take_axes(rest, axes.last(3));
      return SpaceMouseReport::kRotation;
    case 3:
      if (rest.empty()) return SpaceMouseReport::kBadLength;
      input.buttons = 0;
      for (std::size_t i = 0; i < std::min<std::size_t>(rest.size(), 4); ++i) {
        input.buttons |= static_cast<std::uint32_t>(rest[i]) << (8 * i);
      }
      return SpaceMouseReport::kButtons;
    case 23:
      if (rest.empty()) return SpaceMouseReport::kBadLength;
      input.battery_percent = std::min<std::uint8_t>(rest[0], 100);
      return SpaceMouseReport::kBattery;
    default:
      return SpaceMouseReport::kUnknown;
  }
}

std::array<std::uint8_t, kSpaceMouseShortBytes> encode_short(
    std::uint8_t number, std::span<const std::int16_t, 3> values) noexcept {
  std::array<std::uint8_t, kSpaceMouseShortBytes> bytes{number};
  put_axes(values, std::span(bytes).subspan(1));
  return bytes;
}

std::array<std::uint8_t, kSpaceMouseLongBytes> encode_long(
    std::span<const std::int16_t, 6> values) noexcept {
  std::array<std::uint8_t, kSpaceMouseLongBytes> bytes{1};
  put_axes(values, std::span(bytes).subspan(1));
  return bytes;
}

}  // namespace haptic::hal
