// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/core_session.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "rt_core/scene/capacity.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/common/simplified_bodies.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"

namespace haptic::sim {

CoreSession::CoreSession(const std::string& scene_path, GoalContact asked)
    : blob_(tools::read_scene_bytes(scene_path)) {
  open(scene_path, asked);
  tools::tell_simplification("host_sim", scene_path, view_);
}

CoreSession::CoreSession(std::span<const std::byte> scene, const std::string& name,
                         GoalContact asked)
    : blob_(scene) {
  open(name, asked);
}

void CoreSession::change(const std::function<void(SceneParameters&)>& change) {
  blob_ = tools::with_changed(
      view_, [&](const SceneView& scene) { return tools::changed_scene(scene, change); });
  open("the changed scene", GoalContact::kLeftOut);
}

void CoreSession::reset() {
  if (parts_) {
    // It has begun so before.
    static_cast<void>(parts_->begin());
  } else {
    core_->reset();
  }
}

void CoreSession::open_parts(const std::string& name) {
  const RtStatus status = tools::HeldParts::open(view_, parts_);
  if (status != RtStatus::kOk) {
    throw tools::InputError(name + ": the parts of the scene are refused: " + to_text(status) +
                            "; compile it again");
  }
}

void CoreSession::open(const std::string& name, GoalContact asked) {
  RtStatus opened = SceneView::open(blob_.span(), view_);
  if (opened == RtStatus::kOk && asked == GoalContact::kAsked && view_.lists_pairs() &&
      !has_goal_contact(view_.parameters())) {
    blob_ = tools::changed_scene(view_, [](SceneParameters& p) { p.goal_contact = 1; });
    opened = SceneView::open(blob_.span(), view_);
  }
  if (opened != RtStatus::kOk) {
    std::string text = name + ": not a usable scene: " + to_text(opened);
    if (name.ends_with(".toml")) {
      text += "; compile it first: graph_compiler " + name + " -o SCENE.rtscene";
    } else if (!text.ends_with("compile it again")) {
      text += "; a scene is what graph_compiler writes";
    }
    throw tools::InputError(text);
  }
  state_ = tools::SceneBytes(static_cast<std::size_t>(view_.header().capacity.state_bytes));
  const RtStatus created = HapticCore::create(state_.span(), view_, core_);
  if (created != RtStatus::kOk) {
    throw tools::InputError(name + ": the core refuses the scene: " + to_text(created) +
                            "; compile it again");
  }
  open_parts(name);
}

std::string scene_title(const SceneView& view) {
  const SceneParameters& p = view.parameters();
  const std::string stiffness = p.law == LawId::kProxy
                                    ? "k_t " + tools::short_number(p.coupling.k_t_n_per_m, 4)
                                    : "k_F " + tools::short_number(p.k_f_n_per_m, 4);
  return std::string(view.text(p.name_offset, p.name_bytes)) + ", law " + law_name(p.law) + ", " +
         stiffness + " N/m";
}

std::vector<std::uint32_t> near_nodes(const HapticCore& core, std::uint32_t pair) {
  std::vector<std::uint32_t> nodes;
  const PairReport report = core.pair_report(pair);
  for (const NearNode& n : report.near) nodes.push_back(n.node);
  std::ranges::sort(nodes);
  return nodes;
}

std::vector<std::uint32_t> contact_nodes(const HapticCore& core, std::uint32_t pair) {
  const std::span<const std::uint32_t> numbers = core.pair_report(pair).contact_nodes;
  std::vector<std::uint32_t> nodes(numbers.begin(), numbers.end());
  std::ranges::sort(nodes);
  return nodes;
}

Pose pose_of(const MotionSample& sample) {
  Pose pose;
  pose.p_wa = Vec3(static_cast<Real>(sample.p[0]), static_cast<Real>(sample.p[1]),
                   static_cast<Real>(sample.p[2]));
  const double* q = sample.q_wxyz;
  pose.q_wa = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
                   static_cast<Real>(q[3]));
  return pose;
}

StepInput input_of(const MotionSample& sample, std::uint64_t tick, GoalContact goal) {
  StepInput input;
  input.sequence = tick;
  input.stamp_ns = std::llround(sample.t_s * 1e9);
  input.pose_wa = pose_of(sample);
  input.report_goal_contact = goal == GoalContact::kAsked;
  return input;
}

}  // namespace haptic::sim
