// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stages of a tick and what lies between ticks, in the caller's memory. Not for inclusion
/// outside rt_core.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/law/direct_wrench.hpp"
#include "rt_core/proxy/free_motion.hpp"
#include "rt_core/tick/goal.hpp"
#include "rt_core/tick/guide.hpp"
#include "rt_core/tick/output.hpp"
#include "rt_core/tick/step.hpp"
#include "rt_core/tracking/goal_contact.hpp"

namespace haptic {

// The chain of hashes over the results of all ticks.

/// Start of the chain.
inline constexpr std::uint64_t kHashStart = 0xcbf29ce484222325ull;

/// The hash after a tick, from the one before. Nothing that a caller may ask for or not is part of
/// it: where the part is `felt` (law kProxy), neither D_near nor the work of the search at the
/// goal.
[[nodiscard]] std::uint64_t chained_hash(std::uint64_t before, const StepResult& result,
                                         bool felt) noexcept;

struct CoreMemory {
  /// Where it lies in the caller's memory: behind the core, which is one address. The alignment is
  /// that of the 64-bit members, which 32-bit machines have too.
  static constexpr std::size_t kOffset = alignof(std::uint64_t);

  GoalStage goal;
  GoalContactStage goal_contact;
  FreeMotion free_motion;      ///< law kProxy only
  DirectWrench direct_wrench;  ///< laws but kProxy
  OutputStage output;
  GuideStage* guide = nullptr;  ///< law kProxy, of a scene with a guide; else null

  LawId law = LawId::kProxy;
  bool searches_goal = false;  ///< the scene has what a search at the goal needs
  PairIndex pair_count = 0;    ///< of the scene
  std::span<PairView> pairs;   ///< all of them where it has; else none
  HullScratch hull;
  std::uint64_t hash = kHashStart;
  StepPeaks peaks;

  /// Places everything in `arena`; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& scene) noexcept;
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;
  [[nodiscard]] bool has_guide() const noexcept { return kSceneTraits.guide && guide != nullptr; }
  [[nodiscard]] bool has_law(LawId id) const noexcept { return kSceneTraits.is_law(law, id); }
};

}  // namespace haptic
