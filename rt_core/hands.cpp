// SPDX-License-Identifier: Apache-2.0
#include "rt_core/hands.hpp"

namespace haptic {

RtStatus Hands::begin(const PartScenes& parts, const Each<PartHand::Room>& rooms) noexcept {
  motion_ = nullptr;
  count_ = parts.hands();
  if (count_ > 1) return begin_two(parts, rooms);
  return hands_[0].begin(parts, rooms[0], rooms[1]);
}

RtStatus Hands::open_law(const PartScenes& parts, std::span<std::byte> memory) noexcept {
  PartsInHands held;
  held.count = kMostHands;
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    held.part[k] = k;
    held.scene[k] = &hands_[k].scene();
  }
  return JointMotion::create(memory, parts, held, driven_, motion_);
}

RtStatus Hands::begin_two(const PartScenes& parts, const Each<PartHand::Room>& rooms) noexcept {
  std::array<Pose, kMostDriven> starts;
  for (std::uint32_t k = 0; k < parts.driven().size(); ++k)
    starts[k] = pose_of(parts.start_of(parts.driven()[k].part));
  driven_.begin(parts.driven(), std::span(starts).first(parts.driven().size()));
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    const RtStatus status = hands_[k].begin_of_two(parts, k, rooms[k], driven_);
    if (status != RtStatus::kOk) return status;
  }
  const RtStatus status = open_law(parts, rooms[0].law);
  if (status != RtStatus::kOk) return status;
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    hands_[k].join(*motion_);
    const Pose start_wa = pose_of(parts.start_of(k));
    GripPose goal;
    goal.q_wa = start_wa.q_wa;
    goal.r_wa = start_wa.q_wa.toRotationMatrix();
    goal.x0_w = start_wa.p_wa + goal.r_wa * hands_[k].grip_a();
    motion_->lead(k, goal);
  }
  return RtStatus::kOk;
}

std::uint32_t Hands::follow(const DrivenInput& input) noexcept {
  if (count_ == 1) return hands_[0].follow(input) ? 1u : 0u;
  const std::uint32_t released = driven_.follow(input);
  for (std::uint32_t k = 0; k < kMostHands; ++k) hands_[k].driven_lost_ = (released & 1u << k) != 0;
  return released;
}

Hands::Each<StepResult> Hands::step(const Each<const StepInput*>& inputs) noexcept {
  if (count_ > 1) return step_two(inputs);
  return {inputs[0] != nullptr ? hands_[0].step(*inputs[0]) : StepResult{}, StepResult{}};
}

StepResult Hands::step(const StepInput& input) noexcept { return hands_[0].step(input); }

Pose Hands::felt_wa(std::uint32_t number) const noexcept {
  const PartHand& hand = hands_[number];
  if (motion_ == nullptr) return hand.felt_wa_;
  const SharedMotion& told = motion_->of_hand(number);
  if (!motion_->has_begun()) return pose_of(hand.places()[number]);
  return {told.pose.x0_w - told.pose.r_wa * hand.grip_a(), told.pose.q_wa};
}

void Hands::reset() noexcept {
  for (std::uint32_t k = 0; k < count_; ++k) hands_[k].reset();
}

/// A pose that is none is refused by the core of its hand; the hand keeps its goal then.
Hands::Each<StepResult> Hands::step_two(const Each<const StepInput*>& inputs) noexcept {
  Each<StepResult> results;
  Each<StepInput> given;
  Each<Goal> goals;
  Each<bool> aimed{};
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    if (inputs[k] == nullptr) continue;
    PartHand& hand = hands_[k];
    given[k] = hand.enter(*inputs[k]);
    aimed[k] = hand.core().aim(given[k], goals[k]) == RtStatus::kOk;
    if (aimed[k]) motion_->lead(k, goals[k].grip);
    if (!aimed[k]) results[k] = hand.leave(hand.core().step(given[k]));
  }
  if (!aimed[0] && !aimed[1]) return results;
  motion_->tick();
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    if (!aimed[k]) continue;
    results[k] = hands_[k].leave(hands_[k].core().render(given[k], goals[k]));
    hands_[k].take_given();
  }
  return results;
}

}  // namespace haptic
