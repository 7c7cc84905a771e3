// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/sliding_part.hpp"

#include "rt_core/scene/proxy_limits.hpp"
#include "tools/common/changed_scene.hpp"
#include "tools/common/error.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::tools {
namespace {

/// How far the pose that the part is pulled to lies before it: in radii of the part, and [rad].
constexpr double kLead = 0.5, kLeadTurn_rad = 0.3;
/// A target is reached when the part is nearer than this, in radii.
constexpr double kArrived = 1.0e-6;

SceneBytes scene_for_planning(const SceneView& scene) {
  const auto change = [](SceneParameters& p) {
    p.law = LawId::kProxy;
    p.work_units = kMostWorkUnits;
    p.device = DeviceParameters{};
    CouplingParameters& c = p.coupling;
    c.damping_ns_per_m = 0;
    c.max_rotation_error_rad = kMaxRotationError_rad;
    c.max_translation_error_m = c.max_pull_n = c.max_turn_nm = 0;
    c.passes = 1;
    c.passivity = 0;
  };
  const auto without_friction = [](BodyRecord& body) { body.friction = body.friction_static = 0; };
  return changed_scene(scene, change, 0, without_friction);
}

}  // namespace

struct SlidingPart::Engine {
  explicit Engine(SceneBytes bytes) : scene(std::move(bytes)) {
    RtStatus status = SceneView::open(scene.span(), view);
    if (status == RtStatus::kOk) {
      state = SceneBytes(static_cast<std::size_t>(view.header().capacity.state_bytes));
      status = HapticCore::create(state.span(), view, core);
    }
    if (status != RtStatus::kOk) {
      throw InputError(std::string("the scene without friction: not a usable scene: ") +
                       to_text(status) + "; compile it again");
    }
  }
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  SceneBytes scene, state;
  SceneView view;
  HapticCore* core = nullptr;
};

SlidingPart::SlidingPart(SlidingPart&&) noexcept = default;
SlidingPart& SlidingPart::operator=(SlidingPart&&) noexcept = default;
SlidingPart::~SlidingPart() = default;

SlidingPart::SlidingPart(const SceneView& scene)
    : engine_(std::make_unique<Engine>(scene_for_planning(scene))) {
  const SceneView& view = engine_->view;
  grip_a_ = Vec3d(view.bodies()[0].reference_m);
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) radius_m_ = std::max(radius_m_, piece.reach_m);
  }
}

PlanPose SlidingPart::grip_pose(const Pose& mesh) const {
  const Quatd q = mesh.q_wa.cast<double>().normalized();
  return plan_pose(mesh.p_wa.cast<double>() + q * grip_a_, q);
}

Pose SlidingPart::mesh_pose(const PlanPose& pose) const {
  const Quatd q = turn_of(pose);
  Pose mesh;
  mesh.p_wa = (place_of(pose) - q * grip_a_).cast<Real>();
  mesh.q_wa = q.cast<Real>();
  return mesh;
}

void SlidingPart::place(const PlanPose& pose) {
  engine_->core->reset();
  StepInput input;
  input.pose_wa = mesh_pose(pose);
  static_cast<void>(engine_->core->step(input));
  at_ = pose;
  tick_ += 1;
}

PushResult SlidingPart::push(const PlanPose& target, const PushLimits& limits,
                             std::vector<PlanPose>& path) {
  PushResult result;
  std::uint32_t still = 0;
  const double arrived_m = kArrived * radius_m_;
  for (; result.ticks < limits.most_ticks; ++result.ticks) {
    const Vec3d far = place_of(target) - place_of(at_);
    const Vec3d turn = turn_between(at_, target);
    if (far.norm() < arrived_m && turn.norm() < kArrived) {
      result.arrived = true;
      return result;
    }
    // Place and turn by one share, so that the part goes straight where nothing is in the way.
    const double share = std::min({1.0, kLead * radius_m_ / std::max(far.norm(), 1e-300),
                                   kLeadTurn_rad / std::max(turn.norm(), 1e-300)});
    StepInput input;
    input.pose_wa = mesh_pose(
        share < 1 ? plan_pose(place_of(at_) + share * far, exp_of(share * turn) * turn_of(at_))
                  : target);
    const StepResult step = engine_->core->step(input);
    tick_ += 1;
    const PlanPose next = grip_pose(step.proxy_pose_wa);
    const double moved = step_length_m(at_, next, radius_m_);
    if (moved > 0) path.push_back(next);
    at_ = next;
    still = moved < limits.still * radius_m_ ? still + 1 : 0;
    if (still >= limits.still_ticks) return result;
  }
  return result;
}

std::vector<HoldingPlane> SlidingPart::holding() const {
  std::vector<HoldingPlane> planes;
  const FeltContact& felt = engine_->core->felt_contact();
  for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
    planes.push_back(
        {felt.planes[k].pair, felt.planes[k].type, felt.planes[k].normal_w.cast<double>()});
  }
  return planes;
}

std::uint64_t SlidingPart::contact_state() const {
  std::uint64_t state = 0;
  const FeltContact& felt = engine_->core->felt_contact();
  for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
    state += hashed(felt.planes[k].pair << 8 | static_cast<std::uint64_t>(felt.planes[k].type));
  }
  return state;
}

}  // namespace haptic::tools
