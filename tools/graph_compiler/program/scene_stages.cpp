// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/scene_stages.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/program/scene_guide.hpp"
#include "tools/plan/assembly_stages.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::tools {
namespace {

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
    if (off_m <= kSamePlanEnd * plan.length_m) return;
    throw InputError(file + formatted(": the plan does not %s, but %.4g mm off, a turn of 1 rad "
                                      "counted as %.4g mm; make it with host_sim plan --stage",
                                      what, 1e3 * off_m, 1e3 * plan.length_m));
  };
  require(plan.poses.front(), start, "begin where the part of its stage starts");
  require(plan.poses.back(), goal, "end at the goal of its stage");
}

}  // namespace

std::string lay_apart(SceneFile& scene, const std::vector<PartBall>& balls) {
  constexpr double kRoom = 1.2, kApart = 2.2;  // in radii of the assembly, of the largest part
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  const auto middle = [](const PartBall& ball) { return Eigen::Vector3d(ball.middle_m.data()); };
  for (const PartBall& ball : balls) {
    low = low.cwiseMin(middle(ball) - Eigen::Vector3d::Constant(ball.radius_m));
    high = high.cwiseMax(middle(ball) + Eigen::Vector3d::Constant(ball.radius_m));
  }
  const Eigen::Vector3d centre = (low + high) / 2;
  double radius_m = 0, most_m = 0;
  struct Laid {
    std::size_t part;
    double angle;
  };
  std::vector<Laid> laid;
  for (std::size_t k = 0; k < balls.size(); ++k) {
    const Eigen::Vector3d off = middle(balls[k]) - centre;
    radius_m = std::max(radius_m, off.norm() + balls[k].radius_m);
    if (numbered_part(scene, k).role == PartRole::kFixed) continue;
    most_m = std::max(most_m, balls[k].radius_m);
    laid.push_back({k, std::atan2(off.y(), off.x())});
  }
  std::ranges::stable_sort(laid, std::less<>{}, &Laid::angle);
  const double each = 2 * std::numbers::pi / static_cast<double>(laid.size());
  const double ring_m =
      std::max(kRoom * (radius_m + most_m) + kApart * most_m,
               laid.size() > 1 ? kApart * most_m / (2 * std::sin(each / 2)) : 0.0);
  for (std::size_t k = 0; k <= scene.statics.size(); ++k) {
    const ScenePart& part = numbered_part(scene, k);
    if (part.role == PartRole::kFixed) continue;
    scene.stages.push_back({part.name, part.position_m, part.quaternion_wxyz, std::nullopt, {}});
  }
  for (std::size_t slot = 0; slot < laid.size(); ++slot) {
    const std::size_t k = laid[slot].part;
    ScenePart& part = k == 0 ? scene.moving : scene.statics[k - 1];
    const double angle = each * static_cast<double>(slot);
    const Eigen::Vector3d to =
        centre + ring_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    for (std::size_t i = 0; i < 3; ++i)
      part.position_m[i] += to[static_cast<int>(i)] - balls[k].middle_m[i];
  }
  return formatted(
      "[bodies] assembled: %zu parts are laid on a ring of %.4g m about (%.4g, %.4g, "
      "%.4g) m, and their places in the file are the goals of %zu stages, in its order",
      laid.size(), ring_m, centre.x(), centre.y(), centre.z(), laid.size());
}

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

void take_stage(CompiledScene& compiled, std::size_t number) {
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
  const std::uint32_t part = assembly.stages()[number - 1].part;
  std::vector<PartReport> reports{compiled.parts[part]};
  for (const std::uint32_t other : assembly.parts().others_of(part))
    reports.push_back(compiled.parts[other]);
  const SceneBytes alone = assembly.scene_at(number - 1);
  compiled.bytes.assign(alone.span().begin(), alone.span().end());
  compiled.parts = std::move(reports);
}

}  // namespace haptic::tools
