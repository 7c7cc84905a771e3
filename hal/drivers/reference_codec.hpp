// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of the reference 6-DOF device (PROTOCOL.md), both ways: the driver reads reports and
/// writes commands, the device model does the reverse. Little-endian, packed, each ends with a
/// CRC-32.
///
/// Report, device to host, 96 bytes:
///   0 u16 magic 0x4852 | 2 u8 version 1 | 3 u8 status bits | 4 u32 sequence | 8 u64 device time,
///   us 16 i32[3] position of the handle point, nm | 28 i32[4] orientation x y z w, 2^-30 44 i32[3]
///   velocity, um/s | 56 i32[3] angular velocity, urad/s | 68 u32 switches 72 u32 faults | 76 u32
///   tick stamp of the last command accepted | 80 u32 commands rejected 84 u32 its sequence | 88
///   u32 reserved 0 | 92 u32 CRC-32 of bytes 0-91
/// Command, host to device, 56 bytes:
///   0 u16 magic 0x4843 | 2 u8 version 1 | 3 u8 bits (0: drives enabled) | 4 u32 sequence
///   8 u32 tick stamp | 12 i32[3] force, 10 uN | 24 i32[3] torque, 0.1 uN m
///   36 u8[16] reserved 0 | 52 u32 CRC-32 of bytes 0-51

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

inline constexpr std::size_t kReferenceReportBytes = 96, kReferenceCommandBytes = 56;
inline constexpr double kReferencePositionUnit_m = 1.0e-9;
inline constexpr double kReferenceForceUnit_n = 1.0e-5, kReferenceTorqueUnit_nm = 1.0e-7;

enum ReferenceStatusBit : std::uint8_t {
  kReferenceCalibrated = 1u << 0,
  kReferenceDrivesOn = 1u << 1,
  kReferenceTwistValid = 1u << 2,
  kReferenceWatchdogCut = 1u << 3,
  kReferenceEmergencyStop = 1u << 4
};

/// A report in its own units, as integers: equal reports have equal bytes.
struct ReferenceReport {
  std::uint8_t status = 0;
  std::uint32_t sequence = 0;
  std::uint64_t time_us = 0;
  std::array<std::int32_t, 3> position{};
  std::array<std::int32_t, 4> orientation{0, 0, 0, 1 << 30};
  std::array<std::int32_t, 3> velocity{}, angular_velocity{};
  std::uint32_t switches = 0, faults = 0;
  std::uint32_t accepted_tick = 0, rejected = 0, accepted_sequence = 0;
};

struct ReferenceCommand {
  bool drives_on = false;
  std::uint32_t sequence = 0, tick = 0;
  std::array<std::int32_t, 3> force{}, torque{};
};

enum class CodecVerdict : std::uint8_t {
  kOk = 0,
  kBadLength,
  kBadMagic,
  kBadVersion,
  kBadCheck,
  kBadReserved,
  kBadNumber
};

void encode(const ReferenceReport& report,
            std::span<std::uint8_t, kReferenceReportBytes> bytes) noexcept;
void encode(const ReferenceCommand& command,
            std::span<std::uint8_t, kReferenceCommandBytes> bytes) noexcept;
/// Refuses wrong length, magic, version, check sum, reserved bytes that are not zero, unknown bits,
/// and an orientation whose length is off by more than 1e-3; `report` is unchanged then.
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceReport& report) noexcept;
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceCommand& command) noexcept;

/// CRC-32 (IEEE 802.3, reflected, 0xedb88320), as in zip and Ethernet.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace haptic::hal
