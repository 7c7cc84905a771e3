// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of the reference 6-DOF device (PROTOCOL.md), both ways: the driver reads reports and
/// writes commands, the device model does the reverse. Little-endian, packed, each ends with a
/// CRC-32 of all bytes before it. Numbers stay integers here: equal values have equal bytes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/device.hpp"

namespace haptic::hal {

inline constexpr std::size_t kReferenceReportBytes = 96, kReferenceCommandBytes = 56;
inline constexpr std::size_t kReferenceBlockBytes = 64;
inline constexpr std::uint16_t kReferenceReportMagic = 0x4852, kReferenceCommandMagic = 0x4843;
inline constexpr std::uint16_t kReferenceBlockMagic = 0x4842;
inline constexpr std::uint8_t kReferenceVersion = 1;

// Version 1.1: what a device adds for a host that has asked for the long block.
inline constexpr std::size_t kReferenceLongBlockBytes = 128;
inline constexpr std::uint8_t kReferenceMinor = 1;
inline constexpr double kReferenceGapUnit_m = 1.0e-6;

inline constexpr double kReferencePositionUnit_m = 1.0e-9;
inline constexpr double kReferenceOrientationUnit = 1.0 / (1 << 30);
inline constexpr double kReferenceVelocityUnit_m_per_s = 1.0e-6;
inline constexpr double kReferenceTurnUnit_rad_per_s = 1.0e-6;
inline constexpr double kReferenceForceUnit_n = 1.0e-5, kReferenceTorqueUnit_nm = 1.0e-7;

/// The request for the capability block, on the control pipe: device to host, vendor, interface.
inline constexpr std::uint8_t kReferenceBlockRequestType = 0xc1, kReferenceBlockRequest = 0x01;

enum ReferenceStatusBit : std::uint8_t {
  kReferenceCalibrated = 1u << 0,
  kReferenceDrivesOn = 1u << 1,
  kReferenceTwistValid = 1u << 2,
  kReferenceWatchdogCut = 1u << 3,
  kReferenceEmergencyStop = 1u << 4,
  kReferenceSlewing = 1u << 5,  ///< of 1.1: the drives do not give all of their force yet
  kReferenceStatusBits = 0x3f
};

/// Fault bits that a report may carry; they have the numbers and meanings of DeviceFault.
inline constexpr std::uint32_t kReferenceFaultBits = 0x3f;

/// Report, device to host, 96 bytes. Byte by byte: 0 u16 magic, 2 u8 version, 3 u8 status, then the
/// members below in their order from byte 4 on, 92 u32 CRC-32.
struct ReferenceReport {
  std::uint8_t status = 0;                                    ///< ReferenceStatusBit
  std::uint32_t sequence = 0;                                 ///< byte 4
  std::uint64_t time_us = 0;                                  ///< 8: the device's own clock
  std::array<std::int32_t, 3> position{};                     ///< 16: handle point in D [nm]
  std::array<std::int32_t, 4> orientation{0, 0, 0, 1 << 30};  ///< 28: x y z w, unit 2^-30
  std::array<std::int32_t, 3> velocity{};                     ///< 44: of the handle point [um/s]
  std::array<std::int32_t, 3> angular_velocity{};             ///< 56: in D axes [urad/s]
  std::uint32_t switches = 0;                                 ///< 68: bit set = pressed
  std::uint32_t faults = 0;                                   ///< 72: kReferenceFaultBits
  std::uint32_t accepted_tick = 0;                            ///< 76: of the last command accepted
  std::uint32_t rejected = 0;                                 ///< 80: commands, since power-up
  std::uint32_t accepted_sequence = 0;                        ///< 84: of the last command accepted
  std::uint32_t gripper = 0;  ///< 88: 1 + gap [um], 0: none is measured; of 1.1

  friend bool operator==(const ReferenceReport&, const ReferenceReport&) = default;
};

/// Command, host to device, 56 bytes: 0 u16 magic, 2 u8 version, 3 u8 bits (0: drives enabled),
/// 4 u32 sequence, 8 u32 tick, 12 i32[3] force, 24 i32[3] torque, 36 u8[16] reserved 0, 52 u32
/// CRC-32.
struct ReferenceCommand {
  bool drives_on = false;
  std::uint32_t sequence = 0;
  std::uint32_t tick = 0;                ///< lower 32 bits of the servo tick
  std::array<std::int32_t, 3> force{};   ///< at the handle point, D axes [10 uN]
  std::array<std::int32_t, 3> torque{};  ///< about the handle point [0.1 uN m]

  friend bool operator==(const ReferenceCommand&, const ReferenceCommand&) = default;
};

/// Capability block, device to host on request, 64 bytes: 0 u16 magic, 2 u8 version, 3 u8 bits (0:
/// twist sensed), then the members below in their order from byte 4 on, with u16 reserved 0 at byte
/// 10 and u32 CRC-32 at byte 60. From byte 20 on, 0 means "not known".
struct ReferenceBlock {
  bool twist_sensed = true;
  std::uint8_t sensed_dof = 0x3f, driven_dof = 0x3f;  ///< 4, 5: DofBit
  std::uint16_t report_period_us = 1000;              ///< 6
  std::uint16_t watchdog_ms = 20;                     ///< 8
  std::uint32_t max_force = 1'200'000;                ///< 12: norm [10 uN]
  std::uint32_t max_torque = 3'000'000;               ///< 16: norm [0.1 uN m]
  std::uint32_t max_force_rate_mn_per_s = 2'000'000;  ///< 20
  std::uint32_t max_torque_rate_mnm_per_s = 40'000;   ///< 24
  std::uint32_t max_stiffness_mn_per_m = 0;           ///< 28
  std::uint32_t max_damping_mns_per_m = 0;            ///< 32
  std::uint32_t mass_mg = 100'000;                    ///< 36: felt at the handle
  std::uint32_t damping_uns_per_m = 1'000'000;        ///< 40
  std::uint32_t friction = 0;                         ///< 44: Coulomb [10 uN]
  std::uint32_t encoder_step_nm = 1000;               ///< 48
  std::uint32_t encoder_step_nrad = 10'000;           ///< 52
  std::uint32_t workspace_radius_um = 0;              ///< 56

  friend bool operator==(const ReferenceBlock&, const ReferenceBlock&) = default;
};

/// Capability block of version 1.1, 128 bytes: bytes 0 to 59 as the block of 1.0, then 60 u8 minor
/// version, 61 u8 bits (0: displacement), 62 u16 reserved 0, 64 u32 latency, 68 u32 largest gap, 72
/// u32 reserved 0, 76 name, 100 serial number, 124 u32 CRC-32.
struct ReferenceLongBlock {
  ReferenceBlock first;
  /// 0: the device answers as one of 1.0, and knows nothing of what follows.
  std::uint8_t minor = kReferenceMinor;
  /// The handle springs back, and the pose is what the device integrates of its displacement.
  bool is_displacement = false;
  std::uint32_t latency_us = 0;      ///< from a sample to the begin of its wrench, of its own
  std::uint32_t largest_gap_um = 0;  ///< of the gripper; 0: it has none
  DeviceText name{}, serial{};

  friend bool operator==(const ReferenceLongBlock&, const ReferenceLongBlock&) = default;
};

enum class CodecVerdict : std::uint8_t {
  kOk = 0,
  kBadLength,
  kBadMagic,
  kBadVersion,
  kBadCheck,
  kBadReserved,  ///< reserved bytes that are not zero, bits that mean nothing
  kBadNumber,    ///< orientation that is none
  kBadText       ///< name or serial number that is none
};

/// Any member value is written, also those that `decode` refuses.
void encode(const ReferenceReport& report,
            std::span<std::uint8_t, kReferenceReportBytes> bytes) noexcept;
void encode(const ReferenceCommand& command,
            std::span<std::uint8_t, kReferenceCommandBytes> bytes) noexcept;
void encode(const ReferenceBlock& block,
            std::span<std::uint8_t, kReferenceBlockBytes> bytes) noexcept;
/// Always as one of version 1.1, so with its minor version.
void encode(const ReferenceLongBlock& block,
            std::span<std::uint8_t, kReferenceLongBlockBytes> bytes) noexcept;

/// Refuses wrong length, magic, version, check sum, reserved bytes that are not zero, unknown bits,
/// and an orientation whose length is off by more than 1e-3; the second argument is unchanged then.
/// An accepted block encodes to the same bytes. Cost: one pass over the bytes.
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceReport& report) noexcept;
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceCommand& command) noexcept;
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceBlock& block) noexcept;
[[nodiscard]] CodecVerdict decode(std::span<const std::uint8_t> bytes,
                                  ReferenceLongBlock& block) noexcept;

/// A block of either version, distinguished by its length; one of 1.0 has minor version 0.
[[nodiscard]] CodecVerdict decode_either(std::span<const std::uint8_t> bytes,
                                         ReferenceLongBlock& block) noexcept;

/// True where `sequence` comes after `last`, counters of 32 bits that wrap: less than half the
/// range ahead.
[[nodiscard]] constexpr bool is_newer(std::uint32_t sequence, std::uint32_t last) noexcept {
  const std::uint32_t ahead = sequence - last;
  return ahead != 0 && ahead < 0x8000'0000u;
}

/// CRC-32 (IEEE 802.3, reflected, 0xedb88320), as in zip and Ethernet.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace haptic::hal
