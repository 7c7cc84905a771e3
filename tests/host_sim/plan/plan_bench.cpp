// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/plan/plan_bench.hpp"

#include <doctest/doctest.h>

#include <filesystem>

#include "tools/c_space/pose_text.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim::test {
namespace {

tools::SceneBytes compiled(const tools::SceneFile& file) {
  return tools::SceneBytes(tools::compile_scene(file, {}).bytes);
}

}  // namespace

PlannedScene::PlannedScene(const std::string& folder)
    : bytes(compiled(tools::read_scene_file(std::filesystem::path(HAPTIC_SCENES_DIR) / folder /
                                            "scene.toml"))) {
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
}

PlannedScene::PlannedScene(const std::string& text, const std::string& name)
    : bytes(compiled(tools::parse_scene_file(text, name, HAPTIC_SCENES_DIR))) {
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
}

FoundPlan plan_to(const SceneView& view, const std::string& goal, std::uint64_t seed,
                  double seconds, const std::string& start) {
  SlidingPart part(view);
  const double tolerance_m = 0.995 * tools::most_tolerance_m(view);
  StepProver prover(view, tolerance_m);
  SearchLimits limits;
  limits.seconds = seconds;
  limits.seed = seed;
  FoundPlan found;
  found.search =
      search_plan(view, part, prover, part.grip_pose(tools::pose_from_text(view, "--start", start)),
                  part.grip_pose(tools::pose_from_text(view, "--goal", goal)), limits,
                  [](const SearchState&) {});
  if (!found.search.found) return found;
  ShorteningLimits shortening;
  shortening.seed = seed;
  const CorneredMotion motion =
      shortened(found.search.start, found.search.motion, prover, part.radius_m(), shortening);
  const tools::PlanCheck check(view);
  found.plan =
      make_plan(motion, prover, check, {"a scene", seed, tolerance_m, 5e-5, part.radius_m()});
  return found;
}

}  // namespace haptic::sim::test
