// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo tick: device pose in, force and torque out. One object over caller-supplied memory; no
/// heap, lock, system call, exception or recursion in `step`; every loop bounded by a number in the
/// scene's header. Same input, same bits.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/base/status.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

inline constexpr std::size_t kStateAlignment = 64;

/// What one tick is given. Owner: the caller. The rendering reads the pose alone; stamp, twist,
/// switches and faults are what a device reports with it and belong to the stages between device
/// and law.
struct StepInput {
  std::uint64_t sequence = 0;  ///< of the device report
  std::int64_t stamp_ns = 0;   ///< host time of the report, monotonic clock
  Pose pose_wa;                ///< A's mesh frame in W
  Twist twist_w;               ///< meaningful only when twist_valid
  bool twist_valid = false;
  std::uint32_t switches = 0;       ///< device buttons, bit set = pressed
  std::uint32_t device_faults = 0;  ///< device faults, bit set = present
};

/// Flags of one tick; several may be set.
enum StepFlag : std::uint32_t {
  kFlagRelocalised = 1u << 0,    ///< at least one pair was searched exhaustively
  kFlagFirstTick = 1u << 1,      ///< that search was the start
  kFlagLocalSetEmpty = 1u << 2,  ///< no applicable node in a neighbor subgraph
  kFlagContradiction = 1u << 3,  ///< the local set contradicted a certificate or the motion bound
  kFlagNearSetCut = 1u << 4,  ///< a near set exceeded its capacity; still holds the nearest C-face
  kFlagVerdictUndecided =
      1u << 5,  ///< no certificate within the cap; the pair was searched exhaustively
  kFlagSeveralPlanes = 1u << 6,  ///< the paper's rule was applied to the deepest of several planes
  kFlagBadPose = 1u << 7,        ///< pose refused: wrench zero, state unchanged
  kFlagLocalSetOverflow = 1u << 8  ///< ties took more nodes than a local search may
};

/// Work of one tick, against the bounds in the scene's header.
struct StepCounters {
  std::uint32_t nodes_evaluated = 0;
  std::uint32_t support_pairs = 0;
  std::uint32_t relocalised_pairs = 0;
  std::uint32_t pair_visits = 0;
};

/// What one tick returns.
struct StepResult {
  Wrench wrench_w;    ///< reaction on the hand; torque about the grip point, W axes
  Real d_near_m = 0;  ///< smallest D_near over all pairs at the device pose, <= 0: collision
  std::uint32_t nearest_pair = 0;  ///< the pair it belongs to (lowest index at ties)
  ContactSituation situation = ContactSituation::kNone;  ///< of that pair
  std::uint32_t near_count = 0;                          ///< nodes of that pair's near set
  RtStatus status = RtStatus::kOk;
  std::uint32_t flags = 0;  ///< StepFlag
  StepCounters counters;
  std::uint64_t state_hash =
      0;  ///< of the state and result after this tick; equal runs have equal hashes
};

class HapticCore {
 public:
  /// Bytes of caller memory that a core for `scene` needs (kStateAlignment-aligned).
  [[nodiscard]] static std::size_t state_bytes(const SceneView& scene) noexcept;

  /// Builds a core in `memory`; `scene` and its blob must outlive it. No destructor needs to run.
  /// @return kOk and `core`; kMemoryTooSmall, kMemoryMisaligned or kBlobBadCapacity and core =
  /// nullptr.
  [[nodiscard]] static RtStatus create(std::span<std::byte> memory, const SceneView& scene,
                                       HapticCore*& core) noexcept;

  /// One servo tick. @retval status kPoseNotFinite, kPoseNotUnit: wrench zero, state unchanged.
  /// Cost: at most header().capacity.max_nodes_evaluated node evaluations and max_support_pairs
  /// support pairs.
  [[nodiscard]] StepResult step(const StepInput& input) noexcept;

  /// Forgets all contact history: the next tick is a first tick.
  void reset() noexcept;

  // Read-only views of the last tick for reports and pictures; not needed by the loop.
  [[nodiscard]] std::uint32_t pair_count() const noexcept;
  [[nodiscard]] Real pair_d_near_m(std::uint32_t pair) const noexcept;
  /// Node numbers of the pair's near set, ascending.
  [[nodiscard]] std::span<const std::uint32_t> pair_near_nodes(std::uint32_t pair) const noexcept;
  /// Node numbers of the pair's basic contacts whose point lies in both features, ascending.
  [[nodiscard]] std::span<const std::uint32_t> pair_contact_nodes(
      std::uint32_t pair) const noexcept;
  [[nodiscard]] ContactSituation pair_situation(std::uint32_t pair) const noexcept;
  /// Size of the neighbor subgraph that the last tick evaluated (paper: 17 to 72 on tetrahedron and
  /// box).
  [[nodiscard]] std::uint32_t pair_neighborhood_size(std::uint32_t pair) const noexcept;
  [[nodiscard]] bool pair_relocalised(std::uint32_t pair) const noexcept;

 private:
  struct State;
  explicit HapticCore(State* state) noexcept : state_(state) {}
  State* state_;
};

}  // namespace haptic
