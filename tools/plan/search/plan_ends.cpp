// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/plan_ends.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/plan/search/inside_surface.hpp"

namespace haptic::tools {
namespace {

/// Where two poses are turned alike [rad].
constexpr double kSameTurn_rad = 1.0e-9;

PlanPose end_within_limits(const SceneView& scene, const SlidingPart& part, const Pose& mesh_wa,
                           const std::string& name) {
  const PlanPose pose = part.grip_pose(mesh_wa);
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::abs(pose.x0_m[k]) <= kMostPlanPlace_m) continue;
    throw UsageError(name + formatted(": the grip point's %c is %.6g m, and a plan holds places to "
                                      "%.3g m from the origin; give a nearer pose",
                                      "xyz"[k], pose.x0_m[k], kMostPlanPlace_m));
  }
  const std::string left = PlanLimits(scene.parameters().envelope).left_by(pose);
  if (left.empty()) return pose;
  throw InputError(name + ": " + left +
                   (scene.is_locked() ? "; give x,y,z within the limits and no quaternion, or "
                                      : "; give a pose within the limits, or ") +
                   "widen them in the scene file and compile it again");
}

void require_free(const SceneView& scene, StepProver& prover, const PlanPose& pose,
                  const std::string& end) {
  if (prover.is_free(pose)) {
    const std::optional<std::uint32_t> body = enclosing_body(scene, pose);
    if (!body) return;
    const BodyRecord& record = scene.bodies()[*body];
    std::string name(scene.text(record.name_offset, record.name_bytes));
    std::replace_if(name.begin(), name.end(), is_control, '?');
    throw InputError(end + ": the part and '" + name +
                     "' lie in one another there, within a closed surface; give a pose outside of "
                     "it");
  }
  const StepProver::Blocked& pair = prover.blocked();
  throw InputError(end + ": the part is not free there: pieces " + std::to_string(pair.piece_a) +
                   " and " + std::to_string(pair.piece_b) +
                   " overlap; give a pose outside of the obstacles");
}

}  // namespace

PlanEnds checked_ends(const SceneView& scene, const SlidingPart& part, StepProver& prover,
                      const AskedEnds& asked) {
  PlanEnds ends;
  ends.start = end_within_limits(scene, part, asked.start_wa, asked.start_name);
  ends.goal = end_within_limits(scene, part, asked.goal_wa, asked.goal_name);
  require_free(scene, prover, ends.start, asked.start_name);
  require_free(scene, prover, ends.goal, asked.goal_name);
  if (step_length_m(ends.start, ends.goal, part.radius_m()) < 1e-9 * part.radius_m())
    throw UsageError(asked.goal_name + ": is the start; give another pose");
  ends.turned = turn_between(ends.start, ends.goal).norm() > kSameTurn_rad;
  return ends;
}

}  // namespace haptic::tools
