// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From the motion that a search found to a plan: straight ways instead of detours, then the way
/// that costs a hand least (way_cost.hpp: short, and with room), each change proved before it is
/// kept; and the plan with its stations.

#include <cstdint>
#include <functional>

#include "tools/plan/plan_check.hpp"
#include "tools/plan/search/step_prover.hpp"

namespace haptic::tools {

/// Work of the shortening (StepProver::work) where nothing else is asked for.
inline constexpr std::uint64_t kShorteningWork = 6'000'000'000;

/// What was done so far, and what it has come to.
struct ShorteningState {
  std::uint64_t work = 0;   ///< of ShorteningLimits::work
  std::size_t corners = 0;  ///< of the motion
};

/// No time: the same motion, seed and limits give the same corners on a machine however slow.
struct ShorteningLimits {
  std::uint64_t work = kShorteningWork;  ///< of the prover; then it ends with what it has
  std::uint32_t tries = 300;             ///< of straight ways between two places of the motion
  std::uint64_t seed = 1;
};

using ShorteningProgress = std::function<void(const ShorteningState&)>;

/// Shortens a proved motion and leads it where there is room. `turn_m`: what a turn of 1 rad
/// counts. `progress`, if any, is called often, and decides nothing.
[[nodiscard]] CorneredMotion shortened(const CorneredMotion& motion, StepProver& prover,
                                       double turn_m, const ShorteningLimits& limits,
                                       const ShorteningProgress& progress = {});

/// What a plan says of itself.
struct PlanTitle {
  std::string scene;
  std::uint64_t seed = 0;
  double tolerance_m = 0, contact_m = 0, turn_m = 0;
};

/// The plan along a motion, with stations at its corners and between them, each step proved with
/// the best planes and checked in long double. @throws std::runtime_error when a step of the motion
/// cannot be proved, which contradicts its maker.
[[nodiscard]] Plan make_plan(const CorneredMotion& motion, StepProver& prover,
                             const PlanCheck& check, const PlanTitle& title);

}  // namespace haptic::tools
