// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the gate keeps from tick to tick, and the pairs that it lets through. Not for inclusion
/// outside rt_core.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/contact/pair_gate.hpp"

namespace haptic {

/// What the gate reads of each pair in every tick: kept apart, so that far pairs cost little.
struct PairGateState {
  GatePlane plane;
  double reach_a_m = 0, reach_b_m = 0;  ///< levers of the odometers
  std::uint32_t body_b = 0;
};

/// A static body's share of the odometers.
struct BodyMotion {
  Vec3 reference_w = Vec3::Zero();
  double swept_m = 0;  ///< sum of the turn times the distance of the grip point from the reference
};

/// A pair that must be looked at, and how near it may be.
struct Candidate {
  double gap_m = 0;
  std::uint32_t pair = 0;
};

}  // namespace haptic
