// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A motion of a part that does not turn, from the cells of its free places; or the fact that there
/// is none, with the C-faces that stand in the way.

#include <cstdint>
#include <string>

#include "tools/plan/search/step_prover.hpp"
#include "tools/plan/search/translation_cells.hpp"

namespace haptic::tools {

enum class TranslationVerdict : std::uint8_t {
  kFound,       ///< a motion, with every step proved
  kImpossible,  ///< no translation leads from the start to the goal
  kUndecided    ///< a limit was exceeded, or it is a question of rounding
};

struct TranslationResult {
  TranslationVerdict verdict = TranslationVerdict::kUndecided;
  std::string why;                ///< of kUndecided
  CorneredMotion motion;          ///< of kFound
  TranslationSpace space;         ///< that the verdict is from
  bool goal_is_enclosed = false;  ///< of kImpossible; false: the start is
  Enclosure enclosure;            ///< of kImpossible: of the goal, or of the start
  double seconds = 0;
};

/// From `start` to `goal`, which are turned alike; `mesh_wa` is the start as a pose of the mesh
/// frame. A motion is looked for where depths to 0.9 `tolerance_m` count as free, so that rounding
/// does not decide; that there is none is said where depths to `tolerance_m` and rounding do.
[[nodiscard]] TranslationResult plan_translation(const SceneView& scene, StepProver& prover,
                                                 const Pose& mesh_wa, const PlanPose& start,
                                                 const PlanPose& goal, double tolerance_m);

}  // namespace haptic::tools
