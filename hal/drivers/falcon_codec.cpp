// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/falcon_codec.hpp"

namespace haptic::hal {
namespace {

constexpr std::uint8_t kOpen = '<', kClose = '>', kBase = 0x41;
constexpr std::size_t kBitsAt = 13, kPaddingAt = 14, kCloseAt = 15;

void put_number(std::int16_t value, std::span<std::uint8_t, 4> bytes) noexcept {
  const auto pattern = static_cast<std::uint16_t>(value);
  for (std::size_t i = 0; i < 4; ++i) {
    bytes[i] = static_cast<std::uint8_t>(kBase + (pattern >> (4 * i) & 0xfu));
  }
}

FalconPacket packet_of(const std::array<std::int16_t, 3>& numbers, std::uint8_t bits) noexcept {
  FalconPacket bytes{};
  bytes[0] = kOpen;
  for (std::size_t k = 0; k < 3; ++k) {
    put_number(numbers[k], std::span<std::uint8_t, 4>(bytes.data() + 1 + 4 * k, 4));
  }
  bytes[kBitsAt] = static_cast<std::uint8_t>(kBase + bits);
  bytes[kPaddingAt] = kBase;
  bytes[kCloseAt] = kClose;
  return bytes;
}

bool numbers_of(std::span<const std::uint8_t, kFalconPacketBytes> bytes, std::uint8_t largest_bits,
                std::array<std::int16_t, 3>& numbers, std::uint8_t& bits) noexcept {
  if (bytes[0] != kOpen || bytes[kCloseAt] != kClose) return false;
  std::array<std::uint16_t, 3> patterns{};
  for (std::size_t i = 0; i < 12; ++i) {
    const unsigned nibble = bytes[1 + i] - unsigned{kBase};  // below the base: wraps, refused
    if (nibble > 0xfu) return false;
    std::uint16_t& pattern = patterns[i / 4];
    pattern = static_cast<std::uint16_t>(pattern | nibble << (4 * (i % 4)));
  }
  const unsigned found = bytes[kBitsAt] - unsigned{kBase};
  if (found > largest_bits) return false;
  for (std::size_t k = 0; k < 3; ++k) numbers[k] = static_cast<std::int16_t>(patterns[k]);
  bits = static_cast<std::uint8_t>(found);
  return true;
}

}  // namespace

FalconPacket encode(const FalconReport& report) noexcept {
  return packet_of(report.counts,
                   static_cast<std::uint8_t>((report.buttons & 0xfu) | (report.homed & 0x7u) << 4));
}

FalconPacket encode(const FalconCommand& command) noexcept {
  return packet_of(command.motors,
                   static_cast<std::uint8_t>((command.lights & 0xeu) | (command.homing ? 1u : 0u)));
}

bool decode(std::span<const std::uint8_t, kFalconPacketBytes> bytes,
            FalconReport& report) noexcept {
  std::array<std::int16_t, 3> counts{};
  std::uint8_t bits = 0;
  if (!numbers_of(bytes, 0x7f, counts, bits)) return false;
  report = {counts, static_cast<std::uint8_t>(bits & 0xfu), static_cast<std::uint8_t>(bits >> 4)};
  return true;
}

bool decode(std::span<const std::uint8_t, kFalconPacketBytes> bytes,
            FalconCommand& command) noexcept {
  std::array<std::int16_t, 3> motors{};
  std::uint8_t bits = 0;
  if (!numbers_of(bytes, 0xf, motors, bits)) return false;
  command = {motors, (bits & 1u) != 0, static_cast<std::uint8_t>(bits & 0xeu)};
  return true;
}

FalconStream::Step FalconStream::push(std::uint8_t byte) noexcept {
  if (filled_ == kFalconPacketBytes) filled_ = 0;  // the last one was handed out
  const bool was_inside = filled_ > 0;
  if (!was_inside) {
    if (byte != kOpen) return Step::kNone;  // rest of a packet whose head was lost
    bytes_[filled_++] = byte;
    return Step::kNone;
  }
  if (filled_ == kCloseAt) {
    if (byte == kClose) {
      bytes_[filled_++] = byte;
      return Step::kPacket;
    }
  } else if (filled_ == kPaddingAt || (byte != kOpen && byte != kClose)) {
    bytes_[filled_++] = byte;
    return Step::kNone;
  }
  filled_ = 0;
  if (byte == kOpen) bytes_[filled_++] = byte;
  return Step::kBroken;
}

}  // namespace haptic::hal
