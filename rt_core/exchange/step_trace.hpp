// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One fixed-size record per tick, and the overwriting recorder that keeps the last seconds of them
/// in memory that the caller has locked: what a fault is explained from.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// What the recorder keeps of a tick. Plain numbers, no pointers: it is read from another process
/// after the one that wrote it has died. All in double, regardless of the scalar of the build.
struct StepTrace {
  std::uint64_t tick = 0, sequence = 0;          ///< 1, 2, ...; of the state that was rendered
  std::int64_t stamp_ns = 0, now_ns = 0;         ///< of the state, and begin of the tick
  std::uint64_t state_hash = 0;                  ///< StepResult::state_hash
  double pose_p_m[3] = {}, pose_q_xyzw[4] = {};  ///< handle in D
  double command_force_n[3] = {}, command_torque_nm[3] = {};
  double rendered_force_n[3] = {}, rendered_torque_nm[3] = {};  ///< before safety, W axes
  double d_near_m = 0;  ///< at the goal pose; NaN where it was not searched
  std::uint32_t step_flags = 0, limiter_flags = 0, faults = 0, device_faults = 0;
  std::uint32_t switches = 0, late_periods = 0;
  std::uint8_t link = 0, arming = 0, situation = 0;
  std::uint8_t began = 0;  ///< 1: the core was reset before this tick (ServoResult::began)
  std::uint32_t work = 0;  ///< plane gaps and feature evaluations
};
static_assert(std::is_trivially_copyable_v<StepTrace> && sizeof(StepTrace) % 8 == 0);

/// Ring of the newest records in caller-supplied memory. Owner: the servo thread writes, wait-free;
/// anyone may copy it out at any time, also from another process that maps the same memory and also
/// after the writer was killed in the middle of a record: each slot carries a stamp, and what is
/// half written or was overwritten meanwhile is left out.
class FlightRecorder {
 public:
  /// Bytes of memory for `records` records (aligned to 64).
  [[nodiscard]] static std::size_t bytes_for(std::size_t records) noexcept;

  /// A recorder over `memory`, emptied; it uses as many records as fit. `memory` aligned to 64;
  /// nobody copies from it during this call. Memory that is too small or not aligned records
  /// nothing.
  explicit FlightRecorder(std::span<std::byte> memory) noexcept;

  /// Overwrites the oldest record. Wait-free; cost: one copy.
  void write(const StepTrace& record) noexcept;

  /// Records that fit; 0: nothing is recorded.
  [[nodiscard]] std::size_t capacity() const noexcept;

  /// Copies the newest records of a recorder's memory into `out`, oldest first; returns how many.
  /// `memory` is what a FlightRecorder was built over; with any bytes, nothing outside it
  /// is touched. Cost: O(capacity).
  [[nodiscard]] static std::size_t copy_newest(std::span<const std::byte> memory,
                                               std::span<StepTrace> out) noexcept;

 private:
  std::byte* memory_ = nullptr;
  std::size_t capacity_ = 0;
  std::uint64_t written_ = 0;
};

}  // namespace haptic
