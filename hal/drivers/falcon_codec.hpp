// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of the Novint Falcon while its firmware runs. Facts: libnifalcon (BSD),
/// FalconFirmwareNovintSDK.cpp for the packets, FalconCommLibUSB.cpp for the serial bridge.
///
/// Both ways 16 bytes, one reply per request: '<', twelve nibbles plus 0x41 (three signed 16-bit
/// numbers, each its low nibble first), a byte of bits plus 0x41, one of padding, '>'.
///   host to device: motor values; bits 0 homing mode, 1 green, 2 blue, 3 red light
///   device to host: encoder counts; bits 0-3 grip buttons (1 plus, 2 forward, 4 centre, 8 minus),
///   4-6 encoder 1-3 homed
/// The device is behind an FTDI bridge: each USB packet to the host, of at most 64 bytes, begins
/// with two modem-status bytes, and the 16-byte packets lie in what remains as in a stream: cut and
/// joined anyhow.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

inline constexpr std::size_t kFalconPacketBytes = 16;
inline constexpr std::size_t kFtdiPacketBytes = 64, kFtdiStatusBytes = 2;
/// Largest motor value either way.
inline constexpr std::int16_t kFalconMaxMotor = 4095;

struct FalconReport {
  std::array<std::int16_t, 3> counts{};
  std::uint8_t buttons = 0;  ///< bits 0-3
  std::uint8_t homed = 0;    ///< bits 0-2, one per encoder

  [[nodiscard]] bool all_homed() const noexcept { return homed == 7; }
  friend bool operator==(const FalconReport&, const FalconReport&) = default;
};

enum FalconLight : std::uint8_t {
  kFalconGreen = 1u << 1,
  kFalconBlue = 1u << 2,
  kFalconRed = 1u << 3
};

struct FalconCommand {
  std::array<std::int16_t, 3> motors{};
  bool homing = false;
  std::uint8_t lights = 0;  ///< FalconLight

  friend bool operator==(const FalconCommand&, const FalconCommand&) = default;
};

using FalconPacket = std::array<std::uint8_t, kFalconPacketBytes>;

[[nodiscard]] FalconPacket encode(const FalconReport& report) noexcept;
[[nodiscard]] FalconPacket encode(const FalconCommand& command) noexcept;
/// False, the result unchanged, where brackets, nibbles or unused bits are not as above. The
/// padding byte may be anything.
[[nodiscard]] bool decode(std::span<const std::uint8_t, kFalconPacketBytes> bytes,
                          FalconReport& report) noexcept;
[[nodiscard]] bool decode(std::span<const std::uint8_t, kFalconPacketBytes> bytes,
                          FalconCommand& command) noexcept;

/// Finds 16-byte packets in a stream that may be cut anywhere. Neither bracket is a nibble or bits
/// plus 0x41, so a bracket in the wrong place shows a lost byte at once and the search goes on from
/// there. Cost per byte: constant; it holds one packet and no more.
class FalconStream {
 public:
  enum class Step : std::uint8_t {
    kNone = 0,  ///< inside a packet, or between two
    kPacket,    ///< `packet()` is whole
    kBroken     ///< what was gathered is no packet and was thrown away
  };
  Step push(std::uint8_t byte) noexcept;
  [[nodiscard]] const FalconPacket& packet() const noexcept { return bytes_; }
  void clear() noexcept { filled_ = 0; }

 private:
  FalconPacket bytes_{};
  std::size_t filled_ = 0;
};

}  // namespace haptic::hal
