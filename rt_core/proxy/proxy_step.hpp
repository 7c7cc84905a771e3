// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inside of the proxy: one step and its check. Not for inclusion outside proxy/.

#include <limits>

#include "rt_core/proxy/pair_at.hpp"
#include "rt_core/proxy/proxy_law.hpp"

namespace haptic {

/// A configuration q = p (+) (dx, dtheta) that a pass considers.
struct Proxy::Step {
  GripPose q;
  Vec3 dx_m = Vec3::Zero(), dtheta_rad = Vec3::Zero();
};

/// The result of a check: every reached pair has kept a plane with a gap, or one lacks it most.
struct Proxy::Check {
  bool ok = true;
  Real lacking_m = 0;       ///< how far below the least allowed gap the worst pair is
  std::uint32_t worst = 0;  ///< index in the list of reached pairs
  /// Every pair has its gap at the end; the way there is certified if the step is shortened to this
  /// share of it, or less.
  Real share = 1;
};

/// A plane of a pair at the end of a step.
struct Proxy::PlaneWorth {
  PlaneId id;
  SupportPair support;
  Real gap_p_m = 0, gap_q_m = 0;  ///< at p, and at the step's end
  Real path_m = 0;                ///< on the way there, at least
  Real worth_m = 0;               ///< by how much these are enough
  Vec3 normal_q_w = Vec3::Zero();
};

/// What is left of a pair's gap along a direction that is held fixed, at least [m].
struct Proxy::HeldGap {
  Real at_end_m = 0, on_way_m = 0;
};

/// What the gap of a pair of facets is along a direction imposed for another pair.
struct Proxy::SharedGap {
  Real gap_p_m = 0, gap_q_m = 0;  ///< at p, and at the step's end
  Real path_m = 0;                ///< on the way there, at least
  /// By how much that is enough; the lowest number: no such direction separates the pair at the
  /// end.
  Real worth_m = -std::numeric_limits<Real>::max();
  Vec3 normal_q_w = Vec3::Zero();
};

/// The valid set of a pair with at least so many basic contacts takes long to find: it is certified
/// by a face, if one does, and where another pair lacks its set is not asked for.
inline constexpr std::uint32_t kManyNodes = 700;
/// Sums of motion are rounded up by this share.
inline constexpr double kOdometerUp = 1 + 64 * static_cast<double>(kRealEpsilon);

/// By how much the longest step shrinks where the budget has not sufficed, and grows where it has.
inline constexpr Real kTrustLess = 0.25_r, kTrustMore = 4;
/// The shortest of the longest steps, in tolerances.
inline constexpr Real kLastTolerances = 2;

/// Share of the energy that a step lowers it by at least, unless the planes are to be chosen again.
inline constexpr Real kIdleShare = sizeof(Real) == sizeof(float) ? 1.0e-6_r : 1.0e-9_r;

/// Share of the tolerance that a step that was corrected or shortened may be deep at its end.
inline constexpr Real kCorrectedShare = 0.75_r;

/// Calls `visit(id)` for the planes of B, and of A where it has few faces, until it returns false.
template <typename Visit>
void for_each_face(const PairView& pair, const Visit& visit) noexcept {
  for (std::uint32_t f = 0; f < plane_count(*pair.b.record); ++f) {
    if (!visit(PlaneId{ContactType::kB, 0, static_cast<std::uint16_t>(f), false})) return;
  }
  if (pair.a.face_count > kFewFaces) return;
  for (std::uint32_t f = 0; f < plane_count(*pair.a.record); ++f) {
    if (!visit(PlaneId{ContactType::kA, static_cast<std::uint16_t>(f), 0, false})) return;
  }
}

/// A plane counts as valid at p when p is no deeper behind it than this.
[[nodiscard]] inline Real valid_depth(const ProxyScale& scale) noexcept {
  return 1.5_r * scale.tolerance_m;
}

}  // namespace haptic
