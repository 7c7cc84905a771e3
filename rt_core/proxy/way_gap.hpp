// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a gap is on the way between two poses, from what it is at both ends.

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Directions from B to A at both ends of a way, along each of which a pair has a gap.
struct WayEnds {
  Vec3 normal_p_w = Vec3::Zero(), normal_q_w = Vec3::Zero();  ///< unit
  Real gap_p_m = 0, gap_q_m = 0;
};

/// Lower bound of the gap of a pair on the straight way from p to q (place and turn at constant
/// speed, by `dx_m` and `dtheta_rad`), `lever_m` that of its piece of A about the grip point.
///
/// Let n(s) = (1 - s) n_p + s n_q be the direction on the way, d(s) the way from a vertex of B to
/// one of A, M = n.d. n'' = 0, |d'| <= |dx| + r |dtheta| with the lever r of A's piece, and
/// |n.d''| <= r |dtheta| |n x dtheta|, so |M''| <= K = 2 (|n'.dx| + |n'| r |dtheta|) + r |dtheta| a
/// with a the larger |n x dtheta| of both ends: a turn about the normal dips nowhere. M lies no
/// lower than the parabola of curvature K through its ends; n is no shorter than
/// sqrt(1 - |n'|^2 / 4).
/// A plane that turns by more than 60 degrees certifies nothing: it may have come round to the
/// other side of both pieces.
[[nodiscard]] Real gap_on_way_m(const WayEnds& ends, Real lever_m, const Vec3& dx_m,
                                const Vec3& dtheta_rad) noexcept;

}  // namespace haptic
