// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The part in the hand among those that their owner moves: the law of several bodies, as the core
/// asks for it. What is driven is led by a spring many times as stiff as the hand's: it pushes the
/// part and does not yield, but stays behind where it would go through it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "rt_core/bodies/driven_parts.hpp"
#include "rt_core/proxy/shared_motion.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// Alignment of a law's memory [bytes].
inline constexpr std::size_t kLawAlignment = 64;

/// The scenes of a part's law among driven ones.
struct DrivenScenes {
  const SceneView* held = nullptr;  ///< in which it is held
  bool meets_standing = true;       ///< false: what stands there are the driven parts themselves
  std::array<const SceneView*, kMostDriven> with{};  ///< by driven part; null: the two never meet
};

/// Owner: the servo thread. Placed in the caller's memory; never moved.
class DrivenMotion final : public SharedMotion {
 public:
  /// Memory of one, aligned to kLawAlignment. Cost: O(pieces).
  [[nodiscard]] static std::size_t state_bytes(const DrivenScenes& scenes) noexcept;

  /// Bounds of a tick: those of the scene in which the part is held, with what the law adds. Cost:
  /// O(driven parts).
  [[nodiscard]] static SceneCapacity bounds_of(const DrivenScenes& scenes) noexcept;

  /// Makes one in `memory`. Scenes and parts outlive it. No destructor needs to run.
  /// @return kOk; kMemoryTooSmall, kMemoryMisaligned. Cost: O(bytes of the scenes), no heap. Not
  /// for the servo loop.
  [[nodiscard]] static RtStatus create(std::span<std::byte> memory, const DrivenScenes& scenes,
                                       DrivenParts& parts, DrivenMotion*& motion) noexcept;

  /// Moves all of them, the part towards `goal`. Cost: within bounds().
  void tick(const GripPose& goal) noexcept;

  [[nodiscard]] const SceneCapacity& bounds() const noexcept { return bounds_; }

 private:
  explicit DrivenMotion(DrivenParts& parts) noexcept : parts_(&parts) {}
  [[nodiscard]] static std::uint32_t list_pairs(
      const DrivenScenes& scenes, std::array<BodyPairScene, kMostDriven + 1>& pairs) noexcept;
  void place(Arena& arena, const DrivenScenes& scenes) noexcept;
  void configure(const DrivenScenes& scenes) noexcept;
  void feel() noexcept;
  void lead_back() noexcept;

  BodyLaw law_;
  DrivenParts* parts_;
  std::array<std::uint32_t, kMostDriven> met_{};  ///< by body but the first: number of the part
  std::uint32_t met_count_ = 0;
  Spring held_spring_;
  Real behind_m_ = 0;  ///< a driven part that lags by more is behind
  SceneCapacity bounds_{};
};

}  // namespace haptic
