// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_stages.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/program/scene_guide.hpp"
#include "tools/plan/assembly_stages.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::tools {
namespace {

/// A plan's end may lie off the pose that it is of by this share of the part's radius.
constexpr double kSamePose = 1.0e-4;

/// The grip point of the moving part where its mesh frame is at `place`.
PlanPose grip_pose(const SceneView& scene, const PartPlace& place) {
  const double* const q = place.q_wa_xyzw;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  const Eigen::Vector3d x =
      Eigen::Vector3d(place.p_wa_m) + turn * Eigen::Vector3d(scene.bodies()[0].reference_m);
  return {{x[0], x[1], x[2]}, {turn.w(), turn.x(), turn.y(), turn.z()}};
}

void require_ends(const std::string& file, const SceneView& scene, const PartPlace& start,
                  const PartPlace& goal) {
  const Plan plan = read_plan(file);
  const auto require = [&](const PlanPose& end, const PartPlace& place, const char* what) {
    const double off_m = step_length_m(end, grip_pose(scene, place), plan.length_m);
    if (off_m <= kSamePose * plan.length_m) return;
    throw InputError(file + formatted(": the plan does not %s, but %.4g mm off, a turn of 1 rad "
                                      "counted as %.4g mm; make it with host_sim plan --stage",
                                      what, 1e3 * off_m, 1e3 * plan.length_m));
  };
  require(plan.poses.front(), start, "begin where the part of its stage starts");
  require(plan.poses.back(), goal, "end at the goal of its stage");
}

}  // namespace

void add_stages(CompiledScene& compiled) {
  const SceneFile& scene = compiled.scene;
  if (scene.stages.empty()) return;
  std::vector<Stage> stages;
  for (const SceneStage& of : scene.stages) {
    Stage stage;
    while (numbered_part(scene, stage.part).name != of.part) ++stage.part;
    std::ranges::copy(of.position_m, stage.goal.p_wa_m);
    for (std::size_t k = 0; k < 4; ++k) stage.goal.q_wa_xyzw[k] = of.quaternion_wxyz[(k + 1) % 4];
    stages.push_back(stage);
  }
  const auto opened = [](const SceneBytes& bytes) {
    SceneView view;
    if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
      throw std::logic_error("the scene just written does not open");
    return view;
  };
  const SceneBytes parts{compiled.bytes};
  compiled.bytes = with_stages(opened(parts), stages);
  const bool has_guide =
      std::ranges::any_of(scene.stages, [](const SceneStage& s) { return s.guide.has_value(); });
  if (!has_guide) return;
  const SceneBytes staged{compiled.bytes};
  const SceneView view = opened(staged);
  const AssemblyStages assembly(view, scene.file);
  std::vector<std::optional<GuideTables>> guides(assembly.parts().count());
  for (std::size_t k = 0; k < stages.size(); ++k) {
    if (!scene.stages[k].guide) continue;
    const SceneBytes bytes = assembly.scene_at(k);
    const SceneView alone = opened(bytes);
    const SceneGuide& guide = *scene.stages[k].guide;
    std::vector<std::string> notes;
    guides[stages[k].part] = make_guide(guide, alone, scene.file, notes);
    require_ends(guide.plan.string(), alone, assembly.parts().start_of(stages[k].part),
                 stages[k].goal);
    for (const std::string& note : notes)
      compiled.notes.push_back(formatted("stage %zu, '", k + 1) + scene.stages[k].part +
                               "': " + note);
  }
  compiled.bytes = with_guides(view, guides);
}

std::vector<std::byte> stage_scene(const CompiledScene& compiled, std::size_t number) {
  const SceneBytes whole{compiled.bytes};
  SceneView view;
  if (SceneView::open(whole.span(), view) != RtStatus::kOk)
    throw std::logic_error("the scene just written does not open");
  const std::size_t count = compiled.scene.stages.size();
  if (number == 0 || number > count) {
    throw InputError(
        compiled.scene.file +
        formatted(": has %zu stages, and --stage asks for number %zu; ", count, number) +
        (count == 0 ? "add [[stage]] tables" : "number them from 1"));
  }
  const AssemblyStages assembly(view, compiled.scene.file);
  const SceneBytes alone = assembly.scene_at(number - 1);
  return {alone.span().begin(), alone.span().end()};
}

}  // namespace haptic::tools
