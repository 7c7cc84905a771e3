// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Separated or colliding, with a certificate that is checked before it is returned (method
/// section 7.3): the ray from the interior point c through x leaves the C-obstacle through a portal
/// of three support points, which is refined until x is on one side of it. Warm-started with the
/// last tick's directions; nothing depends on history.

#include <array>
#include <cstdint>

#include "rt_core/contact/support.hpp"
#include "rt_core/scene/capacity.hpp"

namespace haptic {

enum class Verdict : std::uint8_t {
  kSeparated,  ///< `normal_w` separates: its gap is positive
  kColliding,  ///< x = c + sum l_i (s_i - c), l_i >= 0, sum l_i <= 1, checked
  kTouching,   ///< x within `thickness_m` of the boundary
  kUndecided   ///< the cap was reached; x within `thickness_m` of the boundary
};

/// What the verdict keeps between ticks: three directions and where their supports were.
struct VerdictMemory {
  std::array<Vec3, 3> direction_w{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  SupportPair last_support;
  bool warm = false;
};

struct VerdictResult {
  Verdict verdict = Verdict::kUndecided;
  Vec3 normal_w =
      Vec3::Zero();  ///< separated: separating direction, unit; colliding: portal normal, unit
  Real separation_bound_m = 0;  ///< separated: gap along normal_w, a lower bound of the distance
  Real thickness_m = 0;         ///< touching, undecided
  std::uint32_t support_pairs = 0;  ///< computed; at most kMaxSupportPairsPerPair
};

/// Verdict at the pair's pose. Colliding includes contained. Cost: at most kMaxSupportPairsPerPair
/// support pairs.
[[nodiscard]] VerdictResult pair_verdict(const PairPose& pose, VerdictMemory& memory) noexcept;

}  // namespace haptic
