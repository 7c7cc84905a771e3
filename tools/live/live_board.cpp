// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_board.hpp"

#include <algorithm>
#include <bit>

namespace haptic::tools {
namespace {

/// A reader that copies the oldest ticks is not overtaken by so many new ones.
constexpr std::uint64_t kMargin = 1024;

}  // namespace

void LiveWriter::publish(LiveTick tick, LiveState state,
                         std::span<const GivenPose> given) noexcept {
  tick.given_begin = given_;
  tick.given = given.size();
  for (GivenPose pose : given) {
    pose.tick = written_;
    board_.given[given_ % LiveBoard::kGiven].write(
        static_cast<RecordWord>(given_ + 1), std::bit_cast<LiveBoard::GivenRecord::Words>(pose));
    ++given_;
  }
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

std::size_t LiveReader::copy_given(std::span<const LiveTick> ticks, std::size_t most,
                                   std::vector<GivenPose>& out) const {
  out.clear();
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    // Any bytes may stand in the board.
    const std::uint64_t count = std::min<std::uint64_t>(ticks[k].given, kMostDriven);
    if (out.size() + count > most) return k;
    const std::size_t before = out.size();
    for (std::uint64_t at = ticks[k].given_begin; at < ticks[k].given_begin + count; ++at) {
      LiveBoard::GivenRecord::Words words;
      if (!board_.given[at % LiveBoard::kGiven].copy(static_cast<RecordWord>(at + 1), words)) {
        out.resize(before);
        return k;
      }
      out.push_back(std::bit_cast<GivenPose>(words));
    }
  }
  return ticks.size();
}

LiveTick live_tick(const RecordedTick& tick, std::uint64_t sequence) {
  return {tick, sequence, 0, 0};
}

}  // namespace haptic::tools
