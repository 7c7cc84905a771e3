// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The short report of the reference device (PROTOCOL.md, section 3), which fits into one packet of
/// full speed. Commands and capability block are those of reference_codec.hpp.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal {

inline constexpr std::size_t kReferenceShortReportBytes = 60;
/// With a gripper, for a host of 1.1.
inline constexpr std::size_t kReferenceShortGripperBytes = 62;
inline constexpr std::uint32_t kReferenceShortGap_um = 10;
inline constexpr std::uint16_t kReferenceShortReportMagic = 0x4853;

/// 60 bytes: 0 u16 magic, 2 u8 version, 3 u8 status, then the members in their order from byte 4
/// on, 56 u32 CRC-32. 62 bytes: 56 u16 gripper, 58 u32 CRC-32.
struct ReferenceShortReport {
  std::uint8_t status = 0;                    ///< ReferenceStatusBit
  std::uint32_t sequence = 0;                 ///< byte 4
  std::uint32_t time_us = 0;                  ///< 8: lower half of the device's clock
  std::array<std::int32_t, 3> position{};     ///< 12: handle point in D [nm]
  std::array<std::int32_t, 3> orientation{};  ///< 24: x y z of a unit quaternion, w >= 0; 2^-30
  std::array<std::int16_t, 3> velocity{};     ///< 36: of the handle point [0.1 mm/s]
  std::array<std::int16_t, 3> angular_velocity{};  ///< 42: in D axes [mrad/s]
  std::uint16_t switches = 0;                      ///< 48: bit set = pressed
  std::uint8_t faults = 0;                         ///< 50: kReferenceFaultBits
  std::uint8_t rejected = 0;                       ///< 51: lowest byte of the commands rejected
  std::uint32_t accepted_sequence = 0;             ///< 52: of the last command accepted
  std::uint16_t gripper = 0;  ///< 1 + gap [10 um], 0: none is measured; not in 60 bytes

  friend bool operator==(const ReferenceShortReport&, const ReferenceShortReport&) = default;
};

/// Any member value is written, also those that `decode` refuses.
void encode(const ReferenceShortReport& report,
            std::span<std::uint8_t, kReferenceShortReportBytes> bytes) noexcept;
void encode(const ReferenceShortReport& report,
            std::span<std::uint8_t, kReferenceShortGripperBytes> bytes) noexcept;

/// Refuses wrong length, magic, version, check sum, unknown bits, and x y z longer than 1.001;
/// `report` is unchanged then. An accepted report encodes to the same bytes.
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceShortReport& report) noexcept;

/// In the units of the long report. w is what is left to length one, 0 where nothing is; time and
/// rejected have no upper half, and accepted_tick is 0.
[[nodiscard]] ReferenceReport in_full(const ReferenceShortReport& report) noexcept;

/// A report of either form, distinguished by its length; verdicts as of `decode`.
[[nodiscard]] CodecVerdict decode_either(std::span<const std::uint8_t> bytes,
                                         ReferenceReport& report) noexcept;

}  // namespace haptic::hal
