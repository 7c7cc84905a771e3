// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From the motion that a search found to a plan: straight ways instead of detours, then the way
/// that costs a hand least (way_cost.hpp: short, and with room), each change proved before it is
/// kept; and the plan with its stations.

#include <cstdint>

#include "host_sim/plan/step_prover.hpp"
#include "tools/plan/plan_check.hpp"

namespace haptic::sim {

struct ShorteningLimits {
  double seconds = 30;        ///< then it ends with what it has
  std::uint32_t tries = 300;  ///< of straight ways between two places of the motion
  std::uint64_t seed = 1;
};

/// A motion as corners with a proved straight way between each two.
struct CorneredMotion {
  std::vector<PlanPose> corners;
  [[nodiscard]] double length_m(double turn_m) const;
};

/// Shortens a proved motion and leads it where there is room. `turn_m`: what a turn of 1 rad
/// counts.
[[nodiscard]] CorneredMotion shortened(const PlanPose& start, const ProvedMotion& motion,
                                       StepProver& prover, double turn_m,
                                       const ShorteningLimits& limits);

/// What a plan says of itself.
struct PlanTitle {
  std::string scene;
  std::uint64_t seed = 0;
  double tolerance_m = 0, contact_m = 0, turn_m = 0;
};

/// The plan along a motion, with stations at its corners and between them, each step proved with
/// the best planes and checked in long double. @throws std::runtime_error when a step of the motion
/// cannot be proved, which contradicts its maker.
[[nodiscard]] tools::Plan make_plan(const CorneredMotion& motion, StepProver& prover,
                                    const tools::PlanCheck& check, const PlanTitle& title);

}  // namespace haptic::sim
