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

#include "host_sim/device/loop_run.hpp"
#include "host_sim/view/page_file.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/exchange/stamped_record.hpp"

namespace haptic::sim {

/// Input of one tick and the state hash after it, as the page gets it
/// (host_sim/view/page/src/live.ts).
struct LiveTick : RecordedTick {
  std::uint64_t sequence = 0;
};
static_assert(sizeof(LiveTick) == 184 && std::is_trivially_copyable_v<LiveTick>);

/// The newest tick in the words of the core that ran it, as the page gets it.
struct LiveState {
  std::uint64_t tick = 0;  ///< 0, 1, ... since the program began
  double t_s = 0;
  double device_p_m[3] = {}, device_q_xyzw[4] = {0, 0, 0, 1};  ///< A's mesh frame in W
  double felt_p_m[3] = {}, felt_q_xyzw[4] = {0, 0, 0, 1};      ///< the device's where not known
  double force_n[3] = {}, torque_nm[3] = {};
  double apart_m = 0, gap_m = 0, d_near_m = 0, energy_j = 0;
  std::uint64_t state_hash = 0;
  double hand_stamp = 0;  ///< of the hand's order that this tick followed
  std::uint32_t situation = 0, flags = 0, status = 0, work = 0;
  std::uint32_t is_over = 0;  ///< no further tick comes
  std::uint32_t knows_felt = 1;
  double guide_force_n[3] = {}, guide_torque_nm[3] = {};
  double guide_to_go_m = 0, guide_off_m = 0;
  std::uint32_t guide_state = 0, guide_station = 0;  ///< GuideState
};
static_assert(sizeof(LiveState) == 320);

/// Where a page's hand wants the part (A's mesh frame in W).
struct HandOrder {
  double p_wa_m[3] = {}, q_wa_xyzw[4] = {0, 0, 0, 1};
  double stamp = 0;            ///< the page's own time; it comes back in LiveState
  std::uint64_t wanted = 0;    ///< counts the poses; 0: none yet
  std::uint64_t restarts = 0;  ///< counts the calls to begin again
};
using HandBoard = NewestRecord<HandOrder>;

/// Zeroed memory is a board without a tick.
struct LiveBoard {
  static constexpr std::size_t kTicks = 65536;  ///< of the last minute
  using Record = StampedRecord<sizeof(LiveTick) / sizeof(RecordWord)>;

  NewestRecord<LiveState> newest;
  alignas(64) std::atomic<std::uint64_t> written{0};  ///< ticks so far
  std::array<Record, kTicks> ring{};
};

/// Owner: the one thread that runs the ticks. Wait-free.
class LiveWriter {
 public:
  explicit LiveWriter(LiveBoard& board) : board_(board), newest_(board.newest) {}

  /// `state.tick` is set here.
  void publish(const LiveTick& tick, LiveState state) noexcept;
  /// Says again what is newest, with no further tick to come.
  void finish() noexcept;

 private:
  LiveBoard& board_;
  NewestWriter<LiveState> newest_;
  LiveState last_;
  std::uint64_t written_ = 0;
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

 private:
  const LiveBoard& board_;
  NewestReader<LiveState> newest_;
};

/// What a closed loop says of a tick, and back. `hand_stamp`: of the order that it followed.
[[nodiscard]] LiveTick live_tick(const RecordedTick& tick, std::uint64_t sequence);
[[nodiscard]] LiveState live_state(const LoopRecord& record, double hand_stamp = 0);
[[nodiscard]] LoopRecord record_of(const LiveState& state);

}  // namespace haptic::sim
