// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a way costs a hand: its length, times more where little room is left. A way in contact is
/// worth a detour of many times its length, and in a hole the part is led where its clearance is
/// largest.

#include "tools/plan/search/step_prover.hpp"

namespace haptic::tools {

class WayCost {
 public:
  /// `turn_m`: what a turn of 1 rad counts. The prover must outlive it.
  WayCost(StepProver& prover, double turn_m) : prover_(prover), turn_m_(turn_m) {}

  [[nodiscard]] double length_m(const PlanPose& from, const PlanPose& to) const;
  /// What a metre costs at a pose: 1 far from everything, some hundreds in contact.
  [[nodiscard]] double weight(const PlanPose& pose) const;
  /// The weight along a straight way, by its values at places that lie close together [m].
  [[nodiscard]] double of(const PlanPose& from, const PlanPose& to) const;

 private:
  StepProver& prover_;
  double turn_m_;
};

}  // namespace haptic::tools
