// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The sphere round a piece, and what rounding makes of a gap between two.

#include <cmath>

#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Interior point of a piece, in its body's geometry frame.
[[nodiscard]] inline Vec3 piece_centre(const PieceRecord& piece) noexcept {
  return {static_cast<Real>(piece.centre_m[0]), static_cast<Real>(piece.centre_m[1]),
          static_cast<Real>(piece.centre_m[2])};
}

/// What rounding can have added to a gap of the pair computed at y [m].
[[nodiscard]] inline Real gap_rounding(const PairView& pair, const Vec3& y_w) noexcept {
  const Real reach = static_cast<Real>(pair.a.record->reach_m + pair.b.record->reach_m);
  return 16 * kRealEpsilon * (reach + std::sqrt(y_w.squaredNorm()));
}

}  // namespace haptic
