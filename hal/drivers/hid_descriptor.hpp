// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reads a HID report descriptor (Device Class Definition for HID 1.11, section 6.2.2) as far as
/// the axes of a pointing device need it: where X, Y, Z, Rx, Ry and Rz lie and what range they
/// have. Pure, bounded, no allocation; any bytes may come in.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

/// Most bytes that are looked at; the class has no limit, devices of this kind have some hundreds.
inline constexpr std::size_t kMaxHidDescriptorBytes = 4096;

/// One axis as the descriptor declares it.
struct HidAxis {
  bool found = false;
  std::uint8_t report_id = 0;    ///< 0: reports carry no number
  std::uint32_t bit_offset = 0;  ///< in the report, after its number
  std::uint32_t bit_size = 0;
  std::int32_t logical_min = 0, logical_max = 0;
};

/// X, Y, Z, Rx, Ry, Rz: usages 0x30 to 0x35 of the page Generic Desktop.
inline constexpr std::size_t kHidAxes = 6;

struct HidAxes {
  std::array<HidAxis, kHidAxes> axes;
};

enum class HidVerdict : std::uint8_t {
  kOk = 0,
  kTooLong,    ///< more than kMaxHidDescriptorBytes
  kTruncated,  ///< ends inside an item
  kBadNesting  ///< collections or pushes do not pair, or go deeper than any device needs
};

/// Finds the axes. Items that are not understood are skipped, as the class demands; an axis whose
/// range is empty, or whose size is not 1 to 32 bits, is not found. If an axis is declared twice,
/// the first counts. `axes` is set with every verdict: what was found before the trouble. Cost:
/// linear in the bytes; reports of more than 2^20 bits are not followed further.
[[nodiscard]] HidVerdict find_hid_axes(std::span<const std::uint8_t> descriptor,
                                       HidAxes& axes) noexcept;

/// Largest displacement from the middle of `axis`' range that it can report; 0 where not found.
[[nodiscard]] double full_scale(const HidAxis& axis) noexcept;

}  // namespace haptic::hal
