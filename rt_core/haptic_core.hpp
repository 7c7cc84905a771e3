// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo tick: device pose in, force and torque out. One object over caller-supplied memory; no
/// heap, lock, system call, exception or recursion in `step`; every loop bounded by a number in the
/// scene's header. Same input, same bits.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/motion_envelope.hpp"
#include "rt_core/base/state_account.hpp"
#include "rt_core/base/status.hpp"
#include "rt_core/proxy/felt_contact.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/goal.hpp"
#include "rt_core/tick/step.hpp"
#include "rt_core/tracking/contact_polygon.hpp"
#include "rt_core/tracking/pair_report.hpp"

namespace haptic {

inline constexpr std::size_t kStateAlignment = 64;

struct SharedMotion;
struct CoreMemory;  // the stages of a tick (tick/core_memory.hpp)

class HapticCore {
 public:
  /// Bytes of caller memory that a core for `scene` needs (kStateAlignment-aligned).
  [[nodiscard]] static std::size_t state_bytes(const SceneView& scene) noexcept;

  /// The same by what it is for; the sum is state_bytes.
  [[nodiscard]] static StateAccount state_account(const SceneView& scene) noexcept;

  /// Builds a core in `memory`; `scene` and its blob must outlive it. No destructor needs to run.
  /// @return kOk and `core`; kMemoryTooSmall, kMemoryMisaligned or kBlobBadCapacity and core =
  /// nullptr.
  [[nodiscard]] static RtStatus create(std::span<std::byte> memory, const SceneView& scene,
                                       HapticCore*& core) noexcept;

  /// One servo tick. @retval status kPoseNotFinite (or beyond 1e9 m), kPoseNotUnit: wrench zero,
  /// state unchanged. Cost: within the bounds of header().capacity for any motion since the
  /// last tick.
  [[nodiscard]] StepResult step(const StepInput& input) noexcept;

  /// Forgets all contact history: the next tick is a first tick.
  void reset() noexcept;

  /// After create or reset: the part begins at this pose of its mesh frame, wherever the device is.
  /// The first steps come with StepInput::clutched; once that ends the goal goes on from here as
  /// the device goes, and the wrench is ramped in.
  void begin_at(const Pose& pose_wa) noexcept;

  /// Law kProxy: the part moves among others, by a law of all, which outlives this; null: it alone
  /// does. Resets the core. A tick is then `aim`, a tick of that law, and `render`.
  void join(SharedMotion* shared) noexcept;
  /// The first half of `step`: where the part is to go. @return kOk, or why `step` refuses the
  /// input; then nothing has changed.
  [[nodiscard]] RtStatus aim(const StepInput& input, Goal& goal) noexcept;
  /// The second half, of the same input and its goal.
  [[nodiscard]] StepResult render(const StepInput& input, const Goal& goal) noexcept;

  // Read-only views of the last tick for reports and pictures; not needed by the loop.
  [[nodiscard]] PairIndex pair_count() const noexcept;
  /// Of a listed pair: unlisted ones have none.
  [[nodiscard]] PairReport pair_report(std::uint32_t pair) const noexcept;
  /// Law kProxy: the planes that hold the part. Other laws: none.
  [[nodiscard]] const FeltContact& felt_contact() const noexcept;
  [[nodiscard]] const StepPeaks& peaks() const noexcept;
  /// What the scene says about where the part goes.
  [[nodiscard]] const MotionEnvelope& envelope() const noexcept;
  /// Contact plane, frame, polygon and ids of one pair in the last tick, formed when asked for:
  /// `step` does nothing for it. Of the part as it is felt: law kProxy at proxy_pose_wa, where the
  /// pair has one of the planes of felt_contact; other laws at the goal. `pair` < pair_count(). The
  /// lists of `out` bring their room, as many as the pair's near_capacity always suffice; where the
  /// pair does not touch they end empty. Uses memory of the tick: between ticks, on their thread.
  /// Cost: near nodes, and O(K log K) of the K contact points; law kProxy: and a search of the pair
  /// without history.
  void contact_geometry(PairIndex pair, ContactGeometry& out) noexcept;

 private:
  explicit HapticCore(CoreMemory* memory) noexcept : memory_(memory) {}
  CoreMemory* memory_;
};

}  // namespace haptic
