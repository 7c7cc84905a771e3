// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A core over one compiled scene, fed with poses from outside: the part that an image on another
/// machine and its counterpart on the PC share, so that their files can be compared bit for bit. No
/// heap, no system call. Files are little-endian arrays of the structures below.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt_core/haptic_core.hpp"

namespace haptic {

/// One element of a file of poses: A's mesh frame in W, rounded to Real once by the machine that
/// runs the core.
struct DrivePose {
  std::int64_t stamp_ns = 0;
  double p_wa_m[3] = {};
  double q_wa_wxyz[4] = {};  ///< unit, w first
};

/// One element of a file of results.
struct DriveTick {
  std::uint64_t state_hash = 0;
  double force_w_n[3] = {};
  double torque_w_nm[3] = {};
  std::uint32_t clock_units = 0;  ///< of the machine's own clock, 0 where it has none
  std::uint32_t flags = 0;        ///< StepFlag
};

inline constexpr char kDriveMagic[8] = {'R', 'T', 'D', 'R', 'I', 'V', 'E', '1'};

/// Last element of a file of results.
struct DriveSummary {
  char magic[8] = {};
  std::uint32_t status = 0;  ///< RtStatus: of opening the scene, else of the first tick that failed
  std::uint32_t ticks = 0;   ///< elements before this one
  std::uint32_t scalar_bytes = 0;
  std::uint32_t address_bytes = 0;
  std::uint64_t scene_hash = 0;   ///< content hash in the scene's header
  std::uint64_t state_bytes = 0;  ///< memory of the core on this machine
  std::uint64_t scene_bytes = 0;
  std::uint32_t stack_bytes = 0;  ///< deepest use, 0: not measured
  std::uint32_t stack_room_bytes = 0;
  std::uint32_t empty_clock_units = 0;  ///< of a tick with nothing in it
  std::uint32_t reserved = 0;
};
static_assert(sizeof(DrivePose) == 64 && sizeof(DriveTick) == 64 && sizeof(DriveSummary) == 64);
static_assert(std::is_trivially_copyable_v<DrivePose> && std::is_trivially_copyable_v<DriveTick> &&
              std::is_trivially_copyable_v<DriveSummary>);

/// Owner: one thread. `blob` and `state` must outlive it.
class PoseDrive {
 public:
  /// Opens the scene and builds the core in `state`. @return as SceneView::open and
  /// HapticCore::create; the drive must not step unless it is kOk.
  [[nodiscard]] RtStatus open(std::span<const std::byte> blob, std::span<std::byte> state) noexcept;

  /// Input of the next tick.
  [[nodiscard]] StepInput input_of(const DrivePose& pose) const noexcept;
  /// Only after kOk of open().
  [[nodiscard]] HapticCore& core() noexcept { return *core_; }
  /// Takes note of a tick's result: its element of the file, without the clock.
  [[nodiscard]] DriveTick tick_of(const StepResult& result) noexcept;

  /// Of the ticks so far; stack and clock are the machine's to fill in.
  [[nodiscard]] DriveSummary summary() const noexcept;

 private:
  SceneView view_;
  HapticCore* core_ = nullptr;
  RtStatus status_ = RtStatus::kOk;
  std::uint32_t ticks_ = 0;
};

}  // namespace haptic
