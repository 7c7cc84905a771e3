// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Separated or colliding, with a certificate that is checked before it is returned and that anyone
/// can check again (METHOD section 7.3). Separated: a direction along which the supports of the two
/// pieces leave a gap. Colliding: three points b - R a of the C-obstacle that span, with its
/// interior point c, a tetrahedron that holds x.

#include <array>
#include <cstdint>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic {

enum class Verdict : std::uint8_t {
  kSeparated,  ///< `normal_w` separates: its gap is positive
  kColliding,  ///< x = c + sum l_k (b_k - R a_k - c), l_k >= 0, sum l_k <= 1, checked
  kTouching,   ///< x within `thickness_m` of the boundary
  kUndecided   ///< no certificate within the cap; x within `thickness_m` of the boundary
};

/// Rounding that the barycentric coordinates of a collision certificate are allowed.
inline constexpr Real kCertificateSlack = 4 * kRealEpsilon;

/// What the verdict keeps between ticks: the three support pairs of the last portal.
struct VerdictMemory {
  std::array<SupportPair, 3> portal;
  bool warm = false;
};

struct VerdictResult {
  Verdict verdict = Verdict::kUndecided;
  Vec3 normal_w = Vec3::Zero();  ///< separated: separating direction; else outward normal; unit
  Real separation_bound_m = 0;   ///< separated: gap along normal_w, a lower bound of the distance
  Real thickness_m = 0;          ///< touching, undecided
  std::uint32_t support_pairs = 0;  ///< computed; at most kMaxSupportPairsPerVerdict
};

/// Verdict at the pair's pose, from the nearest C-face that the search has found there: its plane
/// is the certificate when it separates; else last tick's portal, if it still holds x, or a new
/// one. Cost: a few products, or at most kMaxSupportPairsPerVerdict support pairs.
[[nodiscard]] VerdictResult pair_verdict(const PairPose& pose, const NearResult& near,
                                         VerdictMemory& memory) noexcept;

/// Verdict of a pair that no search has looked at: from last tick's portal, if it still holds x, or
/// a new one; of a part that never turns, from the nearest plane. `plane`: the separating direction
/// and the gap along it, as a search names them (of a part that never turns the nearest plane in
/// every case); d_near_m is kNoDepth where there is none. The normal of a colliding pair means
/// nothing. Cost: at most kMaxSupportPairsPerVerdict support pairs, or one pass over the planes.
[[nodiscard]] VerdictResult verdict_alone(const PairPose& pose, VerdictMemory& memory,
                                          NearResult& plane) noexcept;

/// Verdict by portal refinement alone: the ray from c through x leaves the C-obstacle through a
/// portal of three support points, which is refined until x is on one side of it. Starts from the
/// last portal if it is warm, else from x. Cost: at most kMaxSupportPairsPerVerdict support pairs.
[[nodiscard]] VerdictResult portal_verdict(const PairPose& pose, VerdictMemory& memory) noexcept;

}  // namespace haptic
