// SPDX-License-Identifier: Apache-2.0
// Parts that the hand of a page holds one after another.
#include "host_sim/view/wasm/view_core.hpp"

namespace haptic::sim {
namespace {

Vec3 grip_of(const SceneView& scene) {
  const double* const grip = scene.bodies()[0].reference_m;
  return {static_cast<Real>(grip[0]), static_cast<Real>(grip[1]), static_cast<Real>(grip[2])};
}

}  // namespace

std::uint32_t ViewCore::hold(std::uint32_t part) {
  answer.clear();
  if (parts_ == nullptr || part >= parts_->scenes.count() || !parts_->scenes.may_be_taken(part))
    return kHoldRefused;
  PartHand& hand = parts_->hand();
  hand.release();
  if (hand.phase() != PartHand::Phase::kEmpty) return kHoldWaits;
  // Its scene was opened before, and a pose that was felt is a pose.
  SceneView held;
  if (SceneView::open(parts_->scenes.scene_of(part), held) != RtStatus::kOk ||
      hand.prepare(part) != RtStatus::kOk)
    return kHoldRefused;
  Pose lead = pose_of(hand.places()[part]);
  lead.p_wa += lead.q_wa * (grip_of(held) - grip_of(view_));
  for (int k = 0; k < 3; ++k) answer.numbers.push_back(static_cast<double>(lead.p_wa[k]));
  for (int k = 0; k < 4; ++k) answer.numbers.push_back(static_cast<double>(lead.q_wa.coeffs()[k]));
  return kHoldTakes;
}

void ViewCore::release() {
  if (parts_ != nullptr) parts_->hand().release();
}

void ViewCore::describe_parts() {
  answer.clear();
  if (parts_ == nullptr) return;
  const PartScenes& parts = parts_->scenes;
  const PartHand& hand = parts_->hand();
  const PartHand::Phase phase = hand.phase();
  const bool holds = phase == PartHand::Phase::kHolding || phase == PartHand::Phase::kLettingGo;
  answer.counts = {holds ? hand.part() : 0xFFFFFFFFu, hand.part()};
  for (std::uint32_t k = 0; k < parts.count(); ++k) {
    answer.counts.push_back(parts.may_be_taken(k) ? 1 : 0);
    answer.text.append(parts.name(k)).append("\n");
  }
  for (const std::uint32_t other : parts.others_of(hand.part())) answer.counts.push_back(other);
}

}  // namespace haptic::sim
