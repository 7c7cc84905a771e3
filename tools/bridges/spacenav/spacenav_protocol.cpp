// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/spacenav/spacenav_protocol.hpp"

#include <algorithm>
#include <cstring>

namespace haptic::tools {
namespace {

constexpr std::int32_t kTag = 0x7faa0000;  // of requests, ignored by the daemon and given back
constexpr std::size_t kPieceBytes = 24;
constexpr std::size_t kLast = 6;                 // of data: length of a text, status of an answer
constexpr std::int32_t kContinuation = 0x10000;  // above the length of what is left of a text

}  // namespace

SpnavUnit spnav_request(SpnavRequest request, std::int32_t first) {
  SpnavUnit unit;
  unit.type = kTag | request;
  unit.data[0] = first;
  return unit;
}

SpnavUnit spnav_request(SpnavRequest request, const std::string& text) {
  SpnavUnit unit;
  unit.type = kTag | request;
  const std::size_t length = std::min(text.size(), kPieceBytes);
  std::memcpy(unit.data.data(), text.data(), length);
  unit.data[kLast] = static_cast<std::int32_t>(length);
  return unit;
}

bool is_answer(const SpnavUnit& unit, SpnavRequest request) noexcept {
  return unit.type == (kTag | request);
}

bool is_answer(const SpnavUnit& unit) noexcept { return (unit.type & ~0xffff) == kTag; }

bool is_refused(const SpnavUnit& answer) noexcept { return answer.data[kLast] < 0; }

SpnavText::State SpnavText::add(const SpnavUnit& answer) {
  const std::int32_t last = answer.data[kLast];
  if (last < 0) return State::kRefused;
  const auto left = static_cast<std::size_t>(last & (kContinuation - 1));
  const bool first = (last & kContinuation) == 0;
  if (first != !begun_ || left > kSpnavMostText || (begun_ && left != left_))
    return State::kRefused;
  begun_ = true;
  const std::size_t length = std::min(left, kPieceBytes);
  std::array<char, kPieceBytes> piece{};
  std::memcpy(piece.data(), answer.data.data(), kPieceBytes);
  for (std::size_t k = 0; k < length; ++k)
    text_ += piece[k] >= ' ' && piece[k] <= '~' ? piece[k] : '?';
  left_ = left - length;
  return left_ == 0 ? State::kWhole : State::kMore;
}

std::span<std::byte> SpnavStream::room() noexcept {
  std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_),
            bytes_.begin() + static_cast<std::ptrdiff_t>(end_), bytes_.begin());
  end_ -= begin_;
  begin_ = 0;
  return std::span(bytes_).subspan(end_);
}

SpnavStream::Item SpnavStream::next(SpnavUnit& unit) noexcept {
  const std::size_t held = end_ - begin_;
  std::int32_t head = 0;
  if (held < sizeof head) return Item::kNone;
  std::memcpy(&head, bytes_.data() + begin_, sizeof head);
  if ((head & ~0xff) == kSpnavChangeProtocol) {
    begin_ += sizeof head;
    unit = SpnavUnit{};
    unit.data[0] = head & 0xff;
    return Item::kVersion;
  }
  if (held < kSpnavUnitBytes) return Item::kNone;
  std::memcpy(&unit, bytes_.data() + begin_, kSpnavUnitBytes);
  begin_ += kSpnavUnitBytes;
  return Item::kUnit;
}

}  // namespace haptic::tools
