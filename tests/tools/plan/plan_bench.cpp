// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/plan/plan_bench.hpp"

#include <doctest/doctest.h>

#include <filesystem>

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

tools::MadePlan plan_to(const SceneView& view, const std::string& goal, std::uint64_t seed,
                        double seconds, const std::string& start) {
  return tools::make_plan_between(view, start, goal, seed, seconds);
}

}  // namespace haptic::sim::test
