// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/goal.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/scene/envelope_of.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {
namespace {

/// Beyond this turn between goal and proxy the goal follows: at half a turn the shorter way between
/// them, and with it the torque, would change sides.
constexpr Real kAnchorTurn_rad = 2.8_r;
/// How fast the goal comes back where nothing is felt.
constexpr Real kTurnBack_rad_per_s = 20.0_r;

}  // namespace

void GoalStage::read_scene(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  grip_a_ = point_of(scene.bodies()[0].reference_m);
  holds_ = kSceneTraits.is_law(p.law, LawId::kProxy);
  envelope_ = envelope_of(p);
  locked_ = scene.is_locked();
  if (is_locked()) locked_r_wa_ = envelope_.q_wa.toRotationMatrix();
  anchor_rad_ = std::max(kAnchorTurn_rad, static_cast<Real>(p.coupling.max_rotation_error_rad));
  turn_back_rad_ = kTurnBack_rad_per_s / static_cast<Real>(p.rate_hz);
}

void GoalStage::reset() noexcept {
  offset_ = Offset{};
  watch_.reset();
  left_ = false;
}

void GoalStage::begin_at(const Pose& pose_wa) noexcept {
  frozen_ = device_grip(pose_wa);
  offset_.clutched = true;
  offset_.is_zero = false;
}

GripPose GoalStage::device_grip(const Pose& pose_wa) const noexcept {
  GripPose device;
  if (is_locked()) {
    device.q_wa = envelope_.q_wa;
    device.r_wa = locked_r_wa_;
  } else {
    device.q_wa = pose_wa.q_wa.normalized();
    device.r_wa = device.q_wa.toRotationMatrix();
  }
  device.x0_w = pose_wa.p_wa + device.r_wa * grip_a_;
  return device;
}

/// The offset with which the goal stands to the device as these two do.
GoalStage::Offset GoalStage::offset_between(const GripPose& device,
                                            const GripPose& goal) const noexcept {
  Offset offset = offset_;
  offset.translation_m = goal.x0_w - device.x0_w;
  if (!is_locked()) {
    offset.rotation =
        (offset_.anchor.conjugate() * goal.q_wa * device.q_wa.conjugate()).normalized();
  }
  offset.is_zero = false;
  return offset;
}

GripPose GoalStage::offset_goal(const GripPose& device) const noexcept {
  GripPose goal = device;
  if (offset_.is_zero) return goal;
  goal.x0_w += offset_.translation_m;
  if (!is_locked()) {
    goal.q_wa = (offset_.anchor * offset_.rotation * device.q_wa).normalized();
    goal.r_wa = goal.q_wa.toRotationMatrix();
  }
  return goal;
}

/// Takes the anchor back by a step. It may have no part in a pull: turned back under one, the
/// spring would do work that nobody has put in.
void GoalStage::turn_back() noexcept {
  if (offset_.is_zero) return;
  const Vec3 turn = so3_log(offset_.anchor);
  const Real angle = std::sqrt(turn.squaredNorm());
  if (angle > turn_back_rad_) {
    offset_.anchor = so3_exp(Vec3(turn * (1 - turn_back_rad_ / angle)));
    return;
  }
  offset_.anchor = Quat::Identity();
  const bool clutched_once = !offset_.translation_m.isZero(0) ||
                             !offset_.rotation.coeffs().cwiseEqual(Quat::Identity().coeffs()).all();
  offset_.is_zero = !clutched_once && !offset_.clutched;
}

/// EnvelopeSide of the goal, now and by the next tick.
std::uint32_t GoalStage::outside_of(const GripPose& goal) noexcept {
  const bool place = envelope_.limits_place();
  const bool turn = envelope_.limits_turn();
  if (!place && !turn) return 0;
  return is_locked() ? watch_.update_place(envelope_, goal.x0_w)
                     : watch_.update(envelope_, goal.x0_w, goal.q_wa);
}

/// Holds the goal of law kProxy inside the envelope; the other laws measure at the pose itself.
/// True: the goal was changed.
bool GoalStage::hold(GripPose& goal) const noexcept {
  const bool place = envelope_.limits_place();
  const bool turn = envelope_.limits_turn();
  if (!holds_ || (!place && !turn)) return false;
  return is_locked() ? hold_place(envelope_, goal) : hold_inside(envelope_, goal);
}

/// The wrench is ramped out until reset: nothing has to be followed for it. Where the device asks
/// the part to be is told on.
Goal GoalStage::left_goal(Goal goal, bool clutched) noexcept {
  goal.outside = outside_of(offset_goal(goal.device));
  goal.flags = kFlagOutsideEnvelope | (clutched ? std::uint32_t{kFlagClutched} : 0u);
  goal.grip = frozen_;
  goal.pose_wa = mesh_pose(goal.grip);
  return goal;
}

Goal GoalStage::update(const Pose& pose_wa, bool clutched, const GripPose* felt,
                       bool at_rest) noexcept {
  Goal goal;
  goal.device = device_grip(pose_wa);
  if (holds_ && left_) return left_goal(goal, clutched);
  if (offset_.clutched && clutched) {  // the goal stays
    goal.grip = frozen_;
    goal.flags = kFlagClutched;
  } else {
    if (offset_.clutched) {  // on release it goes on from where it is
      offset_ = offset_between(goal.device, frozen_);
      offset_.clutched = false;
    }
    if (at_rest) turn_back();
    goal.grip = offset_goal(goal.device);
    const Quat asked = goal.grip.q_wa;
    if (felt != nullptr && !is_locked() && limit_turn(anchor_rad_, *felt, goal.grip)) {
      offset_.anchor = (goal.grip.q_wa * asked.conjugate() * offset_.anchor).normalized();
      offset_.is_zero = false;
      goal.flags |= kFlagSaturated;
    }
    if (clutched) {
      offset_.clutched = true;
      frozen_ = goal.grip;
      goal.flags |= kFlagClutched;
    }
  }
  goal.outside = outside_of(goal.grip);
  left_ = left_ || goal.outside != 0;
  if (left_) goal.flags |= kFlagOutsideEnvelope;
  const bool held = hold(goal.grip);
  if (holds_ && left_) frozen_ = goal.grip;
  const bool as_given = offset_.is_zero && !offset_.clutched && !held;
  goal.pose_wa = as_given ? pose_wa : mesh_pose(goal.grip);
  if (as_given && is_locked()) goal.pose_wa.q_wa = goal.grip.q_wa;
  return goal;
}

}  // namespace haptic
