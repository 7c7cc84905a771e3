// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/dynamixel/dynamixel_packet.hpp"

#include <algorithm>

namespace haptic::tools {
namespace {

constexpr std::array<std::uint8_t, 4> kHeader = {0xff, 0xff, 0xfd, 0x00};
constexpr std::size_t kIdAt = 4, kLengthAt = 5, kInstructionAt = 7, kBodyAt = 8;
/// Instruction and CRC; an answer has its error byte too.
constexpr std::size_t kLeastLength = 3;

constexpr std::array<std::uint16_t, 256> crc_table() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t k = 0; k < table.size(); ++k) {
    std::uint32_t word = static_cast<std::uint32_t>(k) << 8;
    for (int bit = 0; bit < 8; ++bit) {
      word = (word & 0x8000u) != 0 ? (word << 1) ^ 0x8005u : word << 1;
    }
    table[k] = static_cast<std::uint16_t>(word);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> kCrcTable = crc_table();

}  // namespace

std::uint16_t dynamixel_crc(std::span<const std::uint8_t> bytes, std::uint16_t start) noexcept {
  std::uint16_t crc = start;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>((crc << 8) ^ kCrcTable[(crc >> 8 ^ byte) & 0xff]);
  }
  return crc;
}

bool DynamixelOutput::add(std::uint8_t id, DynamixelInstruction instruction,
                          std::span<const std::uint8_t> parameters) noexcept {
  std::array<std::uint8_t, kMaxDynamixelPacket> packet{};
  // Stuffing adds a third at most.
  if (parameters.size() > (kMaxDynamixelPacket - kBodyAt - 2) * 3 / 4) return false;
  std::ranges::copy(kHeader, packet.begin());
  packet[kIdAt] = id;
  packet[kInstructionAt] = static_cast<std::uint8_t>(instruction);
  std::size_t at = kBodyAt;
  for (const std::uint8_t byte : parameters) {
    packet[at++] = byte;
    if (byte == 0xfd && packet[at - 2] == 0xff && packet[at - 3] == 0xff) packet[at++] = 0xfd;
  }
  const auto length = static_cast<std::uint16_t>(at + 2 - kInstructionAt);
  packet[kLengthAt] = low_byte(length);
  packet[kLengthAt + 1] = high_byte(length);
  const std::uint16_t crc = dynamixel_crc(std::span(packet).first(at));
  packet[at++] = low_byte(crc);
  packet[at++] = high_byte(crc);
  if (at > bytes_.size() - size_) return false;
  std::copy_n(packet.begin(), at, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += at;
  return true;
}

std::span<std::uint8_t> DynamixelInput::room() noexcept {
  if (begin_ > 0) {
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_),
              bytes_.begin() + static_cast<std::ptrdiff_t>(size_), bytes_.begin());
    size_ -= begin_;
    begin_ = 0;
  }
  if (size_ == bytes_.size()) size_ = 0;  // no packet is as long: noise
  return std::span(bytes_).subspan(size_);
}

void DynamixelInput::added(std::size_t count) noexcept {
  size_ = std::min(size_ + count, bytes_.size());
}

DynamixelRead DynamixelInput::next(DynamixelStatus& status) noexcept {
  for (;;) {
    const auto rest = waiting();
    const auto found = std::ranges::search(rest, kHeader);
    if (found.empty()) {
      // The last three bytes may be the beginning of one.
      begin_ = size_ - std::min<std::size_t>(rest.size(), kHeader.size() - 1);
      return DynamixelRead::kNothing;
    }
    begin_ += static_cast<std::size_t>(found.begin() - rest.begin());
    const auto packet = waiting();
    if (packet.size() < kBodyAt) return DynamixelRead::kNothing;
    const std::size_t length = packet[kLengthAt] + std::size_t{packet[kLengthAt + 1]} * 256;
    const std::size_t whole = kInstructionAt + length;
    if (length < kLeastLength || whole > kMaxDynamixelPacket) {
      begin_ += kHeader.size();
      continue;
    }
    if (packet.size() < whole) return DynamixelRead::kNothing;
    const std::uint16_t crc =
        static_cast<std::uint16_t>(packet[whole - 2] | packet[whole - 1] << 8);
    if (dynamixel_crc(packet.first(whole - 2)) != crc) {
      begin_ += kHeader.size();  // a packet may begin within the damaged one
      return DynamixelRead::kWrongCheck;
    }
    begin_ += whole;
    if (packet[kInstructionAt] != static_cast<std::uint8_t>(DynamixelInstruction::kStatus) ||
        whole < kBodyAt + 3) {
      continue;
    }
    status.id = packet[kIdAt];
    if (status.id == kDynamixelBroadcast) {
      status.error = 0;
      status.parameters = packet.subspan(kBodyAt, whole - kBodyAt);
      return DynamixelRead::kStatus;
    }
    status.error = packet[kBodyAt];
    std::size_t plain = 0;
    for (std::size_t at = kBodyAt + 1; at < whole - 2; ++at) {
      plain_[plain++] = packet[at];
      // ff ff fd fd: the last one is stuffing.
      if (packet[at] == 0xfd && packet[at - 1] == 0xff && packet[at - 2] == 0xff &&
          packet[at + 1] == 0xfd && at + 1 < whole - 2) {
        ++at;
      }
    }
    status.parameters = std::span(plain_).first(plain);
    return DynamixelRead::kStatus;
  }
}

DynamixelBlock block_of(const DynamixelStatus& answer, std::size_t index,
                        std::size_t data_bytes) noexcept {
  const std::size_t step = data_bytes + 4;
  if (answer.parameters.size() < (index + 1) * step) return {0, 0xff, {}};
  const auto block = answer.parameters.subspan(index * step, step);
  return {block[0], block[1], block.subspan(2, data_bytes)};
}

}  // namespace haptic::tools
