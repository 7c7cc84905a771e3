// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Rounding of the screen's bounds. Not for inclusion outside law/.

#include "rt_core/base/float_lanes.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic {

/// The gap of a row that has no facets.
inline constexpr float kNoGap = 3.0e38f;
/// What a subtraction of a motion rounds off.
inline constexpr float kKept = 1 - kFloatRound;
/// A motion and a least gap in single precision are rounded up by this share.
inline constexpr Real kScreenRoundedUp = 1 + 1.0e-6_r;
/// Longer than any range.
inline constexpr Real kLongest = 1.0e6_r;

/// A length in all lanes, rounded up.
inline FloatLanes lanes_above(Real x) noexcept {
  return all_lanes(static_cast<float>(x * kScreenRoundedUp));
}

}  // namespace haptic
