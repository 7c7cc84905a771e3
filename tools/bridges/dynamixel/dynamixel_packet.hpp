// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Packets of DYNAMIXEL protocol 2.0: ff ff fd 00, id, length, instruction, parameters, CRC-16.
/// Source: emanual.robotis.com/docs/en/dxl/protocol2 and /docs/en/dxl/crc; that the answer to a
/// fast sync read is not stuffed, and that each servo's CRC goes on from the one before: the
/// official SDK (Apache-2.0). No heap.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::tools {

enum class DynamixelInstruction : std::uint8_t {
  kPing = 0x01,
  kRead = 0x02,
  kWrite = 0x03,
  kStatus = 0x55,
  kSyncRead = 0x82,
  kSyncWrite = 0x83,
  kFastSyncRead = 0x8a
};

inline constexpr std::uint8_t kDynamixelBroadcast = 0xfe;
/// Longest packet in either direction; 9 servos take 170 bytes.
inline constexpr std::size_t kMaxDynamixelPacket = 256;

/// CRC-16 with polynomial 0x8005, not reflected, from `start` on.
[[nodiscard]] std::uint16_t dynamixel_crc(std::span<const std::uint8_t> bytes,
                                          std::uint16_t start = 0) noexcept;

/// Packets to be written, one behind the other.
class DynamixelOutput {
 public:
  void clear() noexcept { size_ = 0; }
  /// Adds a packet. Parameters are stuffed: ff ff fd becomes ff ff fd fd. False, and nothing is
  /// added, where it does not fit.
  [[nodiscard]] bool add(std::uint8_t id, DynamixelInstruction instruction,
                         std::span<const std::uint8_t> parameters) noexcept;
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

 private:
  std::array<std::uint8_t, 2 * kMaxDynamixelPacket> bytes_{};
  std::size_t size_ = 0;
};

/// A status packet whose CRC is right.
struct DynamixelStatus {
  std::uint8_t id = 0;
  /// Bit 7: alert, the hardware error status says why. Bits 0 to 6: error number. Not of a fast
  /// answer, whose blocks have one each.
  std::uint8_t error = 0;
  /// In a fast answer (id kDynamixelBroadcast): blocks of error, id, data and CRC, as they came.
  std::span<const std::uint8_t> parameters;  ///< valid until the next call
};

enum class DynamixelRead : std::uint8_t { kNothing = 0, kStatus, kWrongCheck };

/// Finds status packets in what comes. Other packets, echoes of our own among them, and bytes
/// between packets are passed over.
class DynamixelInput {
 public:
  /// Room for bytes that come; `added` says how many did. Never empty.
  [[nodiscard]] std::span<std::uint8_t> room() noexcept;
  void added(std::size_t count) noexcept;
  /// The next packet. Cost: linear in the bytes.
  [[nodiscard]] DynamixelRead next(DynamixelStatus& status) noexcept;
  void clear() noexcept { begin_ = size_ = 0; }

 private:
  [[nodiscard]] std::span<const std::uint8_t> waiting() const noexcept {
    return std::span(bytes_).subspan(begin_, size_ - begin_);
  }
  std::array<std::uint8_t, 2 * kMaxDynamixelPacket> bytes_{};
  std::array<std::uint8_t, kMaxDynamixelPacket> plain_{};  ///< parameters without stuffing
  std::size_t begin_ = 0, size_ = 0;
};

/// One servo's part of a fast answer.
struct DynamixelBlock {
  std::uint8_t error = 0, id = 0;
  std::span<const std::uint8_t> data;
};
/// Block `index` of a fast answer with `data_bytes` bytes of each servo; its id is 0xff where there
/// is no such block.
[[nodiscard]] DynamixelBlock block_of(const DynamixelStatus& answer, std::size_t index,
                                      std::size_t data_bytes) noexcept;

[[nodiscard]] constexpr std::uint8_t low_byte(std::uint16_t word) noexcept {
  return static_cast<std::uint8_t>(word & 0xff);
}
[[nodiscard]] constexpr std::uint8_t high_byte(std::uint16_t word) noexcept {
  return static_cast<std::uint8_t>(word >> 8);
}
/// Little-endian numbers of the control table.
[[nodiscard]] constexpr std::int16_t int16_at(std::span<const std::uint8_t> b) noexcept {
  return static_cast<std::int16_t>(b[0] | b[1] << 8);
}
[[nodiscard]] constexpr std::int32_t int32_at(std::span<const std::uint8_t> b) noexcept {
  return static_cast<std::int32_t>(std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 |
                                   std::uint32_t{b[2]} << 16 | std::uint32_t{b[3]} << 24);
}

}  // namespace haptic::tools
