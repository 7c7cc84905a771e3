// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/feetech/feetech_packet.hpp"

#include <algorithm>

namespace haptic::tools {
namespace {

constexpr std::size_t kFeetechLengthAt = 3, kFeetechBodyAt = 5;
constexpr std::size_t kMostFeetechParameters = 32;

std::uint8_t feetech_sum(std::span<const std::uint8_t> bytes) noexcept {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum += byte;
  return static_cast<std::uint8_t>(~sum & 0xff);
}

}  // namespace

FeetechOutput::FeetechOutput(std::uint8_t id, FeetechInstruction instruction,
                             std::span<const std::uint8_t> parameters) noexcept {
  const auto used = parameters.first(std::min(parameters.size(), kMostFeetechParameters));
  bytes_ = {0xff, 0xff, id, static_cast<std::uint8_t>(used.size() + 2),
            static_cast<std::uint8_t>(instruction)};
  std::ranges::copy(used, bytes_.begin() + kFeetechBodyAt);
  size_ = kFeetechBodyAt + used.size();
  bytes_[size_] = feetech_sum(std::span(bytes_).subspan(2, size_ - 2));
  ++size_;
}

std::span<std::uint8_t> FeetechInput::room() noexcept {
  std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_),
            bytes_.begin() + static_cast<std::ptrdiff_t>(size_), bytes_.begin());
  size_ -= begin_;
  begin_ = 0;
  if (size_ == bytes_.size()) size_ = 0;  // no packet is as long: noise
  return std::span(bytes_).subspan(size_);
}

void FeetechInput::added(std::size_t count) noexcept {
  size_ = std::min(size_ + count, bytes_.size());
}

FeetechRead FeetechInput::next(FeetechStatus& status) noexcept {
  for (; size_ - begin_ >= kFeetechBodyAt + 1; ++begin_) {
    const auto packet = std::span(bytes_).subspan(begin_, size_ - begin_);
    // A third ff begins later; an echo of ours has the broadcast's id.
    if (packet[0] != 0xff || packet[1] != 0xff || packet[2] >= kFeetechBroadcast) continue;
    const std::size_t length = packet[kFeetechLengthAt];
    if (length < 2 || length + 4 > kMaxFeetechPacket) continue;
    const std::size_t whole = length + 4;
    if (packet.size() < whole) return FeetechRead::kNothing;
    if (feetech_sum(packet.subspan(2, whole - 3)) != packet[whole - 1]) {
      ++begin_;
      return FeetechRead::kWrongCheck;
    }
    status = {packet[2], packet[4], packet.subspan(kFeetechBodyAt, length - 2)};
    begin_ += whole;
    return FeetechRead::kStatus;
  }
  return FeetechRead::kNothing;
}

}  // namespace haptic::tools
