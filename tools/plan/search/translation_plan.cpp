// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/translation_plan.hpp"

#include <array>
#include <chrono>

namespace haptic::tools {
namespace {

/// Share of the tolerance that a motion is looked for with.
constexpr double kPlannedShare = 0.9;
/// Straight ways lie in one cell each; its planes of two C-faces may take turns on the way.
constexpr int kWayHalvings = 16;

void look_for_motion(StepProver& prover, const PlanPose& start, const PlanPose& goal,
                     TranslationResult& result) {
  const CellWay way = way_through(result.space, place_of(start), place_of(goal));
  result.verdict = TranslationVerdict::kFound;
  result.motion = {{start}};
  for (std::size_t k = 1; k < way.places.size(); ++k) {
    const PlanPose next =
        k + 1 < way.places.size() ? plan_pose(way.places[k], turn_of(start)) : goal;
    const PlanPose& at = result.motion.corners.back();
    if (next == at) continue;
    if (!prover.prove(at, next, kWayHalvings)) {
      result.verdict = TranslationVerdict::kUndecided;
      result.why = "a way through the cells is not proved: it is a question of rounding";
      return;
    }
    result.motion.corners.push_back(next);
  }
}

}  // namespace

TranslationResult plan_translation(const SceneView& scene, StepProver& prover, const Pose& mesh_wa,
                                   const PlanPose& start, const PlanPose& goal,
                                   double tolerance_m) {
  const auto began = std::chrono::steady_clock::now();
  TranslationResult result;
  const std::array<Vec3d, 2> places{place_of(start), place_of(goal)};
  const auto decide = [&] {
    for (const bool last : {false, true}) {
      const double depth_m = last ? tolerance_m + 2 * kCellRounding_m : kPlannedShare * tolerance_m;
      result.space = make_translation_space(scene, mesh_wa, places, depth_m);
      result.why = result.space.undecided;
      if (!result.why.empty()) return;
      const auto at_start = result.space.cells_at(places[0]);
      const auto at_goal = result.space.cells_at(places[1]);
      if (at_start.empty() || at_goal.empty()) {
        result.why = "the start or the goal is deeper in contact than the cells allow for";
        continue;
      }
      const std::vector<bool> from_start = result.space.reached_from(at_start);
      if (from_start[at_goal.front()]) {
        if (last) {
          result.why =
              "whether a translation passes is a question of the depth that counts as free";
          return;
        }
        return look_for_motion(prover, start, goal, result);
      }
      if (!last) continue;
      result.verdict = TranslationVerdict::kImpossible;
      result.why.clear();
      const Enclosure of_start = enclosure_of(result.space, from_start);
      result.enclosure = enclosure_of(result.space, result.space.reached_from(at_goal));
      result.goal_is_enclosed = (result.enclosure.high - result.enclosure.low).norm() <=
                                (of_start.high - of_start.low).norm();
      if (!result.goal_is_enclosed) result.enclosure = of_start;
    }
  };
  decide();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

}  // namespace haptic::tools
