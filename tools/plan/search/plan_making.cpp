// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/plan_making.hpp"

#include <chrono>
#include <stdexcept>

#include "tools/c_space/pose_text.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {
namespace {

constexpr double kToleranceShare = 1.005 / 1.01;

}  // namespace

double plan_tolerance_m(const SceneView& scene) {
  return kToleranceShare * most_tolerance_m(scene);
}

Plan plan_from(const SceneView& scene, const SlidingPart& part, StepProver& prover,
               const CorneredMotion& motion, std::uint64_t seed) {
  const SceneParameters& p = scene.parameters();
  const PlanTitle title{std::string(scene.text(p.name_offset, p.name_bytes)), seed,
                        plan_tolerance_m(scene), kPlanContact_m, part.radius_m()};
  return make_plan(motion, prover, PlanCheck(scene), title);
}

ProvedText proved_plan_text(const SceneView& scene, const Plan& plan, const std::string& file) {
  ProvedText proved{plan_as_text(plan), {}};
  proved.proof = prove_plan(scene, parse_plan(proved.text, file), file);
  if (!proved.proof.holds())
    throw std::runtime_error("the plan is not proved: " + proved.proof.failure);
  return proved;
}

PlanProof write_proved_plan(const SceneView& scene, const Plan& plan, const std::string& file) {
  const ProvedText proved = proved_plan_text(scene, plan, file);
  write_files({{file, std::as_bytes(std::span(proved.text))}});
  return proved.proof;
}

MadePlan make_plan_between(const SceneView& scene, SlidingPart& part, StepProver& prover,
                           const PlanPose& start, const PlanPose& goal, const SearchLimits& search,
                           const ShorteningLimits& shortening,
                           const std::function<void(const SearchState&)>& progress,
                           const ShorteningProgress& shortening_progress) {
  MadePlan made;
  made.search = search_plan(scene, part, prover, start, goal, search, progress);
  if (!made.search.found) return made;
  const auto began = std::chrono::steady_clock::now();
  made.found_m = made.search.motion.length_m(part.radius_m());
  const std::uint64_t work = prover.work();
  const CorneredMotion motion =
      shortened(made.search.motion, prover, part.radius_m(), shortening, shortening_progress);
  made.shorten_work = prover.work() - work;
  made.plan = plan_from(scene, part, prover, motion, search.seed);
  made.shorten_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return made;
}

MadePlan make_plan_between(const SceneView& scene, const std::string& start,
                           const std::string& goal, std::uint64_t seed, double seconds) {
  SlidingPart part(scene);
  StepProver prover(scene, plan_tolerance_m(scene));
  SearchLimits search;
  search.seconds = seconds;
  search.seed = seed;
  ShorteningLimits shortening;
  shortening.seed = seed;
  return make_plan_between(scene, part, prover,
                           part.grip_pose(pose_from_text(scene, "--start", start)),
                           part.grip_pose(pose_from_text(scene, "--goal", goal)), search,
                           shortening, [](const SearchState&) {});
}

}  // namespace haptic::tools
