// SPDX-License-Identifier: Apache-2.0
#include "rt_core/part_hand.hpp"

#include <algorithm>

namespace haptic {
namespace {

Pose pose_of(const PartPlace& place) noexcept {
  const double* const q = place.q_wa_xyzw;
  Pose pose;
  for (int k = 0; k < 3; ++k) pose.p_wa[k] = static_cast<Real>(place.p_wa_m[k]);
  pose.q_wa = Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                   static_cast<Real>(q[2]));
  return pose;
}

PartPlace place_of(const Pose& pose) noexcept {
  PartPlace place;
  for (int k = 0; k < 3; ++k) place.p_wa_m[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) place.q_wa_xyzw[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
  return place;
}

Vec3 grip_of(const SceneView& scene) noexcept {
  Vec3 grip;
  for (int k = 0; k < 3; ++k) grip[k] = static_cast<Real>(scene.bodies()[0].reference_m[k]);
  return grip;
}

/// By more than rounding.
bool differs(const Pose& one, const Pose& other) noexcept {
  constexpr Real kRoundings = 64 * kRealEpsilon;
  const Real size_m = one.p_wa.cwiseAbs().maxCoeff() + other.p_wa.cwiseAbs().maxCoeff();
  const Vec3 way_m = (one.p_wa - other.p_wa).cwiseAbs();
  const auto turn = (one.q_wa.coeffs() - other.q_wa.coeffs()).cwiseAbs();
  return way_m.maxCoeff() > kRoundings * size_m || turn.maxCoeff() > kRoundings;
}

/// The ramp of the clutch has come to its end.
bool is_let_go(const StepResult& result) noexcept {
  return result.status == RtStatus::kOk && (result.flags & kFlagRamping) != 0 &&
         result.spring_w.force_w.isZero(0) && result.spring_w.torque_w.isZero(0);
}

}  // namespace

RtStatus PartHand::open(std::uint32_t part, Side& side) noexcept {
  RtStatus status = parts_->place(part, places(), side.room.scene, side.view);
  if (status == RtStatus::kOk) status = HapticCore::create(side.room.state, side.view, side.core);
  if (status == RtStatus::kOk) side.core->begin_at(pose_of(places_[part]));
  return status;
}

RtStatus PartHand::begin(const PartScenes& parts, const Room& one, const Room& other) noexcept {
  if (parts.count() == 0) return RtStatus::kNotGraspable;
  parts_ = &parts;
  for (std::uint32_t k = 0; k < parts.count(); ++k) places_[k] = parts.start_of(k);
  sides_[0].room = one;
  sides_[1].room = other;
  part_.store(0, std::memory_order_release);
  side_ = 0;
  hash_ = 0;
  from_place_ = was_taken_ = begins_ = false;
  const RtStatus status = open(0, sides_[0]);
  if (status != RtStatus::kOk) return status;
  // It is held as in a scene of one part: its goal is the device's pose.
  sides_[0].core->reset();
  first_grip_a_ = grip_of(sides_[0].view);
  phase_.store(Phase::kHolding, std::memory_order_release);
  return RtStatus::kOk;
}

RtStatus PartHand::prepare(std::uint32_t part) noexcept {
  const bool may = phase() == Phase::kEmpty && part < parts_->count() && parts_->may_be_held(part);
  if (!may) return RtStatus::kNotGraspable;
  const RtStatus status = open(part, sides_[1 - side_]);
  if (status != RtStatus::kOk) return status;
  next_ = part;
  phase_.store(Phase::kPrepared, std::memory_order_release);
  return RtStatus::kOk;
}

void PartHand::release() noexcept {
  Phase holding = Phase::kHolding;
  static_cast<void>(phase_.compare_exchange_strong(holding, Phase::kLettingGo));
}

void PartHand::reset() noexcept {
  const Phase phase = this->phase();
  if (phase == Phase::kEmpty || phase == Phase::kPrepared) return;
  core().reset();
  // A reset drops the offset by which the hand leads it from where it was taken.
  begins_ = from_place_ || phase == Phase::kLettingGo;
  if (begins_) core().begin_at(was_taken_ ? felt_wa_ : pose_of(places_[part()]));
}

Vec3 PartHand::grip_a() const noexcept { return grip_of(scene()); }

/// The hand leads the first part by its grip point, and any other by its own.
StepInput PartHand::led(const StepInput& input) const noexcept {
  StepInput given = input;
  if (part() == 0) return given;
  const Vec3 between_a = first_grip_a_ - grip_a();
  given.pose_wa.p_wa += input.pose_wa.q_wa * between_a;
  return given;
}

/// The part has been let go where it is felt; one that was only taken is where it was, to the bit.
void PartHand::leave(const StepResult& last) noexcept {
  left_wa_ = last.proxy_pose_wa;
  if (differs(left_wa_, taken_wa_)) places_[part()] = place_of(left_wa_);
  phase_.store(Phase::kEmpty, std::memory_order_release);
}

StepResult PartHand::empty_step(const StepInput& input) const noexcept {
  StepResult result;
  result.goal_pose_wa = led(input).pose_wa;
  result.proxy_pose_wa = left_wa_;
  result.flags = kFlagClutched | kFlagRamping;
  result.state_hash = hash_;
  return result;
}

StepResult PartHand::step(const StepInput& input) noexcept {
  const Phase phase = this->phase();
  if (phase == Phase::kEmpty) return empty_step(input);
  if (phase == Phase::kPrepared) {
    side_ = 1 - side_;
    part_.store(next_, std::memory_order_release);
    was_taken_ = false;
    from_place_ = begins_ = true;
    phase_.store(Phase::kHolding, std::memory_order_release);
  }
  StepInput given = led(input);
  if (phase == Phase::kLettingGo || begins_) given.clutched = true;
  const StepResult result = core().step(given);
  hash_ = result.state_hash;
  if (result.status != RtStatus::kOk) return result;
  begins_ = false;
  felt_wa_ = result.proxy_pose_wa;
  if (!was_taken_) taken_wa_ = felt_wa_;
  was_taken_ = true;
  if (phase == Phase::kLettingGo && is_let_go(result)) leave(result);
  return result;
}

}  // namespace haptic
