// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a scene and two poses to a plan: search, shortening, stations.

#include <functional>
#include <string>

#include "rt_core/scene/scene_view.hpp"
#include "tools/plan/plan.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/search/plan_search.hpp"
#include "tools/plan/search/plan_shortening.hpp"

namespace haptic::tools {

/// Pieces nearer than this touch at a station, where nothing else is asked for [m].
inline constexpr double kPlanContact_m = 5.0e-5;

/// Depth that counts as free in the plans of a scene [m]: that of the core, and room for the
/// rounding of the proof.
[[nodiscard]] double plan_tolerance_m(const SceneView& scene);

/// The stations and the proof of a motion of the scene's part.
/// @throws std::runtime_error when a step is not proved.
[[nodiscard]] Plan plan_from(const SceneView& scene, const SlidingPart& part, StepProver& prover,
                             const CorneredMotion& motion, std::uint64_t seed);

/// The text of a plan's file, and its proof as its reader makes it. `file`: for messages.
struct ProvedText {
  std::string text;
  PlanProof proof;
};
/// @throws std::runtime_error when it is not proved; InputError when its reader would refuse it.
[[nodiscard]] ProvedText proved_plan_text(const SceneView& scene, const Plan& plan,
                                          const std::string& file);

/// Writes that text.
/// @throws as proved_plan_text; as write_files.
[[nodiscard]] PlanProof write_proved_plan(const SceneView& scene, const Plan& plan,
                                          const std::string& file);

struct MadePlan {
  SearchResult search;
  double found_m = 0;              ///< length before the shortening
  double shorten_s = 0;            ///< time that shortening and proof took
  std::uint64_t shorten_work = 0;  ///< of ShorteningLimits::work
  Plan plan;                       ///< with a pose where the search has found one
};

/// `part` and `prover` are of the scene; the prover's tolerance is plan_tolerance_m.
/// Same scene, poses, seed and work: the same plan, where one is found before the search's time is
/// over. @param progress  called about once a second of the search.
/// @throws std::runtime_error when a step that was proved is not proved again, which contradicts
///         its maker.
[[nodiscard]] MadePlan make_plan_between(const SceneView& scene, SlidingPart& part,
                                         StepProver& prover, const PlanPose& start,
                                         const PlanPose& goal, const SearchLimits& search,
                                         const ShorteningLimits& shortening,
                                         const std::function<void(const SearchState&)>& progress,
                                         const ShorteningProgress& shortening_progress = {});

/// The same between poses as they are written for --start and --goal, seeded.
[[nodiscard]] MadePlan make_plan_between(const SceneView& scene, const std::string& start,
                                         const std::string& goal, std::uint64_t seed,
                                         double seconds);

}  // namespace haptic::tools
