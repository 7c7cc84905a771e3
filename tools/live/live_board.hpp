// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a session that is watched while it runs puts into memory that the server's process reads:
/// the newest state, and the inputs of the last minute for pages that compute them again. And the
/// other way, in memory of its own, where the hand of a page wants the simulated device; a session
/// that takes no hand has no such memory at all.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/exchange/stamped_record.hpp"
#include "tools/live/live_state.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::tools {

/// Input of one tick and the state hash after it, as the page gets it
/// (host_sim/view/page/src/live.ts).
struct LiveTick : RecordedTick {
  std::uint64_t sequence = 0;
  std::uint64_t given_begin = 0,
                given = 0;  ///< its poses of driven parts: number of the first, how many
};
static_assert(sizeof(LiveTick) == 208 && std::is_trivially_copyable_v<LiveTick>);

/// Where a page's hand wants the part (A's mesh frame in W).
struct PageHand {
  double p_wa_m[3] = {}, q_wa_xyzw[4] = {0, 0, 0, 1};
  double stamp = 0;            ///< the page's own time; it comes back in LiveState
  std::uint64_t wanted = 0;    ///< counts the poses; 0: none yet
  std::uint64_t restarts = 0;  ///< counts the calls to begin again
};
using HandBoard = NewestRecord<PageHand>;

/// Zeroed memory is a board without a tick.
struct LiveBoard {
  static constexpr std::size_t kTicks = 65536;  ///< of the last minute
  static constexpr std::size_t kGiven = 65536;  ///< poses of driven parts
  using Record = StampedRecord<sizeof(LiveTick) / sizeof(RecordWord)>;
  using GivenRecord = StampedRecord<sizeof(GivenPose) / sizeof(RecordWord)>;

  NewestRecord<LiveState> newest;
  alignas(64) std::atomic<std::uint64_t> written{0};  ///< ticks so far
  std::array<Record, kTicks> ring{};
  std::array<GivenRecord, kGiven> given{};  ///< GivenPose::tick: the number of that tick
};

/// Owner: the one thread that runs the ticks. Wait-free.
class LiveWriter {
 public:
  explicit LiveWriter(LiveBoard& board) : board_(board), newest_(board.newest) {}

  /// The number of the tick in `state` and in `given`, the poses that are new in it, is set here.
  void publish(LiveTick tick, LiveState state, std::span<const GivenPose> given = {}) noexcept;
  /// Says again what is newest, with no further tick to come.
  void finish() noexcept;

 private:
  LiveBoard& board_;
  NewestWriter<LiveState> newest_;
  LiveState last_;
  std::uint64_t written_ = 0, given_ = 0;
};

/// Owner: one thread. Never writes to the board; any bytes in it give some value.
class LiveReader {
 public:
  explicit LiveReader(const LiveBoard& board) : board_(board), newest_(board.newest) {}

  [[nodiscard]] const LiveState& newest() noexcept { return newest_.newest(); }
  [[nodiscard]] std::uint64_t written() const noexcept {
    // Acquire: the ticks below it are there.
    return board_.written.load(std::memory_order_acquire);
  }
  /// Copies ticks `first`, `first + 1`, .. into `out`, as far as they are there; where `first` has
  /// been overwritten, those from the oldest on. @return how many; `first` is that of the first
  /// copied.
  [[nodiscard]] std::size_t copy(std::uint64_t& first, std::span<LiveTick> out) const noexcept;
  /// The poses of driven parts that came with `ticks`, as `copy` made them: at most `most`, and
  /// those of whole ticks. @return how many of `ticks` have them all, from the first on; 0: those
  /// of the first have been overwritten.
  [[nodiscard]] std::size_t copy_given(std::span<const LiveTick> ticks, std::size_t most,
                                       std::vector<GivenPose>& out) const;

 private:
  const LiveBoard& board_;
  NewestReader<LiveState> newest_;
};

[[nodiscard]] LiveTick live_tick(const RecordedTick& tick, std::uint64_t sequence);

}  // namespace haptic::tools
