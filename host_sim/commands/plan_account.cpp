// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/plan_account.hpp"

#include <chrono>
#include <cstdio>

#include "tools/common/formatted.hpp"

namespace haptic::sim {

std::string millimetres_or_less(double length_m) {
  return length_m >= 1e-4 ? tools::formatted("%.3g mm", 1e3 * length_m)
                          : tools::formatted("%.3g um", 1e6 * length_m);
}

std::string pose_as_option(const Pose& pose) {
  std::string text;
  for (int k = 0; k < 3; ++k)
    text += tools::short_number(static_cast<double>(pose.p_wa[k]), 6) + ",";
  const Quat& q = pose.q_wa;
  for (const Real x : {q.w(), q.x(), q.y()})
    text += tools::short_number(static_cast<double>(x), 9) + ",";
  return text + tools::short_number(static_cast<double>(q.z()), 9);
}

const char* kind_text(ContactType type) {
  return type == ContactType::kA   ? "a face of the moving piece"
         : type == ContactType::kB ? "a face of the fixed piece"
                                   : "two edges";
}

std::string plane_text(const SceneView& view, PairIndex index, const std::string& kind,
                       const tools::Vec3d& normal_w) {
  const PairRecord pair = view.pair_record(index);
  return tools::formatted("pieces %u and %u, %s, normal (%.3f, %.3f, %.3f)", pair.piece_a,
                          pair.piece_b, kind.c_str(), normal_w.x(), normal_w.y(), normal_w.z());
}

std::string plane_text(const SceneView& view, const tools::HoldingPlane& plane) {
  return plane_text(view, plane.pair, kind_text(plane.type), plane.normal_w);
}

void say_progress(const tools::SearchState& state) {
  std::fprintf(stderr,
               "host_sim plan: %.0f s, %llu poses from the start and %llu from the goal, "
               "the trees are %.3g mm apart\n",
               state.seconds, static_cast<unsigned long long>(state.nodes_from_start),
               static_cast<unsigned long long>(state.nodes_from_goal), 1e3 * state.nearest_m);
}

tools::ShorteningProgress say_shortening(const tools::ShorteningLimits& limits) {
  using Clock = std::chrono::steady_clock;
  return [limits, said = Clock::now()](const tools::ShorteningState& state) mutable {
    if (Clock::now() - said < std::chrono::seconds(1)) return;
    said = Clock::now();
    std::fprintf(
        stderr,
        "host_sim plan: a motion is found; %.3g %% of the work on its shortening, %zu corners\n",
        100.0 * static_cast<double>(state.work) / static_cast<double>(limits.work), state.corners);
  };
}

void say_failure(const SceneView& view, const tools::SlidingPart& part,
                 const tools::SearchResult& result, bool turned) {
  std::printf("no plan found in %.0f s (%llu pushes, %llu ticks); got as far as this state:\n",
              result.state.seconds, static_cast<unsigned long long>(result.state.pushes),
              static_cast<unsigned long long>(result.state.ticks));
  std::printf("  from the start to %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_goal)).c_str());
  std::printf("  from the goal to  %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_start)).c_str());
  std::printf("  the nearest two poses are %.4g mm apart, a turn of 1 rad counted as %.4g mm\n",
              1e3 * result.state.nearest_m, 1e3 * part.radius_m());
  for (const tools::HoldingPlane& plane : result.goal_held)
    std::printf("  pushed out of the goal it is held by %s\n", plane_text(view, plane).c_str());
  if (!turned && !view.is_locked())
    std::printf(
        "  the goal is turned as the start: --method translations may find a motion that does not "
        "turn the part, or prove that there is none\n");
}

std::string too_large(const tools::Plan& plan) {
  std::size_t runs = 0;
  for (const tools::PlanPlane& plane : plan.planes) runs += plane.runs.size();
  if (plan.poses.size() <= tools::kMostPlanPoses && plan.planes.size() <= tools::kMostPlanPlanes &&
      runs <= tools::kMostPlanRuns) {
    return "";
  }
  return tools::formatted(
      "a motion was found and each of its %zu steps is proved, by %zu planes over %zu runs of "
      "steps, but a plan file holds %zu, %zu and %zu: none is written; with more "
      "--shorten-millions it has fewer steps",
      plan.steps(), plan.planes.size(), runs, tools::kMostPlanPoses - 1, tools::kMostPlanPlanes,
      tools::kMostPlanRuns);
}

}  // namespace haptic::sim
