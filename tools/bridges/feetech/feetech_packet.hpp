// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Packets of Feetech's serial bus servos: ff ff, id, length, instruction or error, parameters, and
/// the inverted sum of all between. Source: FTServo_Python (MIT) and SMS_STS.h of Feetech. No heap.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::tools {

enum class FeetechInstruction : std::uint8_t { kPing = 0x01, kRead = 0x02, kSyncRead = 0x82 };

inline constexpr std::uint8_t kFeetechBroadcast = 0xfe;
inline constexpr std::size_t kMaxFeetechPacket = 64;

/// Registers of the STS3215 that the bridge reads; it writes none.
namespace feetech_register {
inline constexpr std::uint8_t kModel = 3;  ///< 2 bytes
inline constexpr std::uint8_t kTorqueEnable = 40;
inline constexpr std::uint8_t kPresentPosition = 56;  ///< 2 bytes, then speed, load
}  // namespace feetech_register
/// Position, speed and load, two bytes each.
inline constexpr std::size_t kFeetechPresentBytes = 6;

/// Bits of a servo's error byte.
inline constexpr std::uint8_t kFeetechSensor = 1u << 1, kFeetechHot = 1u << 2;

/// One packet to be written.
class FeetechOutput {
 public:
  /// At most 32 parameters.
  FeetechOutput(std::uint8_t id, FeetechInstruction instruction,
                std::span<const std::uint8_t> parameters) noexcept;
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

 private:
  std::array<std::uint8_t, kMaxFeetechPacket> bytes_{};
  std::size_t size_ = 0;
};

struct FeetechStatus {
  std::uint8_t id = 0, error = 0;
  std::span<const std::uint8_t> parameters;  ///< valid until the next call
};

enum class FeetechRead : std::uint8_t { kNothing = 0, kStatus, kWrongCheck };

/// Finds answers in what comes.
class FeetechInput {
 public:
  /// Never empty.
  [[nodiscard]] std::span<std::uint8_t> room() noexcept;
  void added(std::size_t count) noexcept;
  [[nodiscard]] FeetechRead next(FeetechStatus& status) noexcept;
  void clear() noexcept { begin_ = size_ = 0; }

 private:
  std::array<std::uint8_t, 4 * kMaxFeetechPacket> bytes_{};
  std::size_t begin_ = 0, size_ = 0;
};

/// A number with its sign in bit 15.
[[nodiscard]] constexpr int feetech_number(std::span<const std::uint8_t> b) noexcept {
  const int size = b[0] | (b[1] & 0x7f) << 8;
  return (b[1] & 0x80) != 0 ? -size : size;
}

}  // namespace haptic::tools
