// SPDX-License-Identifier: Apache-2.0
#include "rt_core/part_hand.hpp"

#include <algorithm>

namespace haptic {
namespace {

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

bool is_no_wrench(const Wrench& wrench) noexcept {
  return wrench.force_w.isZero(0) && wrench.torque_w.isZero(0);
}

/// The ramp of the clutch has come to its end, and so has that of a guide, which is longer.
bool is_let_go(const StepResult& result) noexcept {
  return result.status == RtStatus::kOk && (result.flags & kFlagRamping) != 0 &&
         is_no_wrench(result.spring_w) && is_no_wrench(result.guidance.wrench_w);
}

}  // namespace

/// The law of the part among those of the driven ones that it may meet.
RtStatus PartHand::open_law(std::uint32_t part, Side& side) noexcept {
  side.motion = nullptr;
  if (parts_->driven().empty()) return RtStatus::kOk;
  PartsInHands held;
  held.part[0] = part;
  held.scene[0] = &side.view;
  const RtStatus status = JointMotion::create(side.room.law, *parts_, held, *driven_, side.motion);
  if (status == RtStatus::kOk && side.motion != nullptr) side.core->join(&side.motion->of_hand(0));
  return status;
}

RtStatus PartHand::place(std::uint32_t part, Side& side) noexcept {
  const RtStatus status = parts_->place(part, places(), side.room.scene, side.view);
  if (status != RtStatus::kOk) return status;
  return HapticCore::create(side.room.state, side.view, side.core);
}

RtStatus PartHand::open(std::uint32_t part, Side& side) noexcept {
  RtStatus status = place(part, side);
  if (status == RtStatus::kOk) status = open_law(part, side);
  if (status == RtStatus::kOk) side.core->begin_at(pose_of(places_[part]));
  return status;
}

RtStatus PartHand::begin(const PartScenes& parts, const Room& one, const Room& other) noexcept {
  if (parts.hands() != 1) return RtStatus::kNotGraspable;
  parts_ = &parts;
  for (std::uint32_t k = 0; k < parts.count(); ++k) places_[k] = parts.start_of(k);
  sides_[0].room = one;
  sides_[1].room = other;
  part_.store(0, std::memory_order_release);
  side_ = 0;
  hash_ = 0;
  from_place_ = was_taken_ = begins_ = driven_lost_ = false;
  given_j_ = 0;
  std::array<Pose, kMostDriven> starts;
  for (std::uint32_t k = 0; k < parts.driven().size(); ++k)
    starts[k] = pose_of(places_[parts.driven()[k].part]);
  driven_ = &own_driven_;
  number_ = 0;
  driven_->begin(parts.driven(), std::span(starts).first(parts.driven().size()));
  const RtStatus status = open(0, sides_[0]);
  if (status != RtStatus::kOk) return status;
  // It is held as in a scene of one part: its goal is the device's pose.
  sides_[0].core->reset();
  first_grip_a_ = grip_of(sides_[0].view);
  phase_.store(Phase::kHolding, std::memory_order_release);
  return RtStatus::kOk;
}

RtStatus PartHand::begin_of_two(const PartScenes& parts, std::uint32_t number, const Room& room,
                                DrivenParts& driven) noexcept {
  parts_ = &parts;
  for (std::uint32_t k = 0; k < parts.count(); ++k) places_[k] = parts.start_of(k);
  sides_[0].room = room;
  driven_ = &driven;
  number_ = number;
  part_.store(number, std::memory_order_release);
  side_ = 0;
  hash_ = 0;
  was_taken_ = driven_lost_ = false;
  from_place_ = begins_ = true;
  given_j_ = 0;
  const RtStatus status = place(number, sides_[0]);
  if (status != RtStatus::kOk) return status;
  first_grip_a_ = grip_of(sides_[0].view);
  phase_.store(Phase::kHolding, std::memory_order_release);
  return RtStatus::kOk;
}

void PartHand::join(JointMotion& motion) noexcept {
  Side& side = sides_[0];
  side.motion = &motion;
  side.core->join(&motion.of_hand(number_));
  side.core->begin_at(pose_of(places_[number_]));
}

RtStatus PartHand::prepare(std::uint32_t part) noexcept {
  const bool may = phase() == Phase::kEmpty && part < parts_->count() && parts_->may_be_taken(part);
  if (!may) return RtStatus::kNotGraspable;
  const RtStatus status = open(part, sides_[1 - side_]);
  if (status != RtStatus::kOk) return status;
  next_ = part;
  phase_.store(Phase::kPrepared, std::memory_order_release);
  return RtStatus::kOk;
}

void PartHand::release() noexcept {
  if (parts_ != nullptr && parts_->holds_throughout()) return;
  Phase holding = Phase::kHolding;
  static_cast<void>(phase_.compare_exchange_strong(holding, Phase::kLettingGo));
}

void PartHand::reset(bool keeps_pull) noexcept {
  const Phase phase = this->phase();
  if (phase == Phase::kEmpty || phase == Phase::kPrepared) return;
  core().reset();
  // A reset drops the offset by which the hand leads it from where it was taken.
  begins_ = from_place_ || phase == Phase::kLettingGo;
  if (begins_) core().begin_at(is_of_two() ? held_wa(keeps_pull) : begun_wa());
}

/// Where a part that was taken begins again.
Pose PartHand::begun_wa() const noexcept {
  return was_taken_ ? felt_wa_ : pose_of(places_[part()]);
}

/// The part of one of two hands, whose law goes on: where its hand leads it, or where it is.
Pose PartHand::held_wa(bool leads) const noexcept {
  const JointMotion& motion = *sides_[0].motion;
  if (!motion.has_begun()) return pose_of(places_[part()]);
  const GripPose& grip = leads ? motion.goal(number_) : motion.of_hand(number_).pose;
  return {grip.x0_w - grip.r_wa * grip_a(), grip.q_wa};
}

Vec3 PartHand::grip_a() const noexcept { return grip_of(scene()); }

/// The hand leads the first part by its grip point, and any other by its own.
StepInput PartHand::led(const StepInput& input) const noexcept {
  StepInput given = input;
  if (part() == number_) return given;
  const Vec3 between_a = first_grip_a_ - grip_a();
  given.pose_wa.p_wa += input.pose_wa.q_wa * between_a;
  return given;
}

/// The part has been let go where it is felt; one that was only taken is where it was, to the bit.
void PartHand::put_down(const StepResult& last) noexcept {
  left_wa_ = last.proxy_pose_wa;
  if (differs(left_wa_, taken_wa_)) places_[part()] = place_of(left_wa_);
  phase_.store(Phase::kEmpty, std::memory_order_release);
}

bool PartHand::follow(const DrivenInput& input) noexcept {
  driven_lost_ = (driven_->follow(input) & 1u << number_) != 0;
  return driven_lost_;
}

const SceneCapacity& PartHand::bounds() const noexcept {
  const Side& side = sides_[side_];
  return side.motion != nullptr ? side.motion->bounds() : side.view.header().capacity;
}

StepResult PartHand::empty_step(const StepInput& input) noexcept {
  for (std::uint32_t k = 0; k < driven_->count(); ++k) driven_->pass(k);
  StepResult result;
  result.goal_pose_wa = led(input).pose_wa;
  result.proxy_pose_wa = left_wa_;
  result.flags = kFlagClutched | kFlagRamping;
  result.state_hash = hash_;
  return result;
}

/// Counts what the other parts have given the hand's spring, which the tick just rendered knows.
void PartHand::take_given() noexcept {
  double& given_j = sides_[side_].motion->of_hand(number_).given_j;
  given_j_ += given_j;
  given_j = 0;
}

/// The tick of the part that is held: by itself, or among others that move.
StepResult PartHand::step_core(const StepInput& input) noexcept {
  JointMotion* const motion = sides_[side_].motion;
  Goal goal;
  if (motion == nullptr || core().aim(input, goal) != RtStatus::kOk) return core().step(input);
  motion->lead(number_, goal.grip);
  motion->tick();
  const StepResult result = core().render(input, goal);
  take_given();
  return result;
}

StepInput PartHand::enter(const StepInput& input) noexcept {
  StepInput given = led(input);
  if (phase() == Phase::kLettingGo || begins_ || driven_lost_) given.clutched = true;
  return given;
}

StepResult PartHand::leave(StepResult result) noexcept {
  if (driven_lost_) result.flags |= kFlagDrivenLost;
  hash_ = result.state_hash;
  if (result.status != RtStatus::kOk) return result;
  begins_ = false;
  felt_wa_ = result.proxy_pose_wa;
  if (!was_taken_) taken_wa_ = felt_wa_;
  was_taken_ = true;
  if (phase() == Phase::kLettingGo && is_let_go(result)) put_down(result);
  return result;
}

StepResult PartHand::step(const StepInput& input) noexcept {
  const Phase phase = this->phase();
  stepped_as_ = phase;
  if (phase == Phase::kEmpty) return empty_step(input);
  if (phase == Phase::kPrepared) {
    side_ = 1 - side_;
    part_.store(next_, std::memory_order_release);
    was_taken_ = false;
    from_place_ = begins_ = true;
    phase_.store(Phase::kHolding, std::memory_order_release);
  }
  const StepResult result = step_core(enter(input));
  if (sides_[side_].motion == nullptr)
    for (std::uint32_t k = 0; k < driven_->count(); ++k) driven_->pass(k);
  return leave(result);
}

}  // namespace haptic
