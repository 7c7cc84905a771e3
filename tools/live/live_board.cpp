// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_board.hpp"

#include <algorithm>
#include <bit>

namespace haptic::tools {
namespace {

/// A reader that copies the oldest ticks is not overtaken by so many new ones.
constexpr std::uint64_t kMargin = 1024;

}  // namespace

void LiveWriter::publish(const LiveTick& tick, LiveState state) noexcept {
  LiveBoard::Record& record = board_.ring[written_ % LiveBoard::kTicks];
  record.write(static_cast<RecordWord>(written_ + 1),
               std::bit_cast<LiveBoard::Record::Words>(tick));
  state.record.tick = written_;
  newest_.publish(state);
  last_ = state;
  ++written_;
  // Release: who sees the count sees the tick.
  board_.written.store(written_, std::memory_order_release);
}

void LiveWriter::finish() noexcept {
  last_.is_over = 1;
  newest_.publish(last_);
}

std::size_t LiveReader::copy(std::uint64_t& first, std::span<LiveTick> out) const noexcept {
  const std::uint64_t end = written();
  if (end > LiveBoard::kTicks - kMargin)
    first = std::max(first, end - (LiveBoard::kTicks - kMargin));
  std::size_t copied = 0;
  while (copied < out.size() && first + copied < end) {
    const std::uint64_t tick = first + copied;
    LiveBoard::Record::Words words;
    if (!board_.ring[tick % LiveBoard::kTicks].copy(static_cast<RecordWord>(tick + 1), words)) {
      if (copied > 0) break;
      first += 1;  // overwritten meanwhile
      continue;
    }
    out[copied] = std::bit_cast<LiveTick>(words);
    ++copied;
  }
  return copied;
}

LiveTick live_tick(const RecordedTick& tick, std::uint64_t sequence) { return {tick, sequence}; }

}  // namespace haptic::tools
