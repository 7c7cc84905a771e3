// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which pairs a tick must look at. A pair that a plane has separated stays separated while the
/// odometer has not used up the gap; until then it costs a subtraction and a comparison.

#include <cmath>
#include <cstdint>

#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/tracking/feature_bounds.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic {

/// How far A has come in all: the parts of the odometers that pairs share.
struct MotionSum {
  double path_m = 0;    ///< sum of |dx| of the grip point
  double turn_rad = 0;  ///< sum of twice the quaternion difference: bounds the chords of the turns
};

/// The plane that last separated a pair, fixed in A or in B, and how long it lasts.
struct GatePlane {
  /// Odometer of the plane's body at which the gap along it may have closed; the gap is at least
  /// clear_until - odometer.
  double clear_until = 0;
  double made_at = 0;          ///< odometer when its gap was computed
  Vec3 normal = Vec3::Zero();  ///< in A's axes when `of_a`, else in W axes; unit
  SupportPair support;         ///< where the part never turns `a` is the number of the plane
  bool of_a = false;
  bool face = false;   ///< a face of a piece: then the gap is a lower bound of D_near too
  bool known = false;  ///< false: `clear_until` is a bound without a plane

  [[nodiscard]] double odometer(const Odometer& now) const noexcept {
    return of_a ? now.of_a : now.of_b;
  }
  /// Lower bound of the signed distance now [m].
  [[nodiscard]] double gap_m(const Odometer& now) const noexcept {
    return clear_until - odometer(now) * (1 + kOdometerRounding);
  }
};

/// True if a gap proves that the pair lies beyond the exact band. A plane of an edge pair need not
/// be a C-face any more once the bodies have turned, so it is trusted at twice the distance only.
[[nodiscard]] constexpr bool is_far(double gap_m, bool face, double exact_band_m) noexcept {
  return gap_m > (face ? 1 : 2) * exact_band_m;
}

/// The plane of the nearest C-face, found at `now`.
[[nodiscard]] GatePlane gate_plane(const PairPose& pose, const NearResult& near,
                                   const Odometer& now) noexcept;

/// A bound for a pair that has never been looked at: the gap between the spheres round its pieces.
[[nodiscard]] GatePlane sphere_gate(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                                    const Odometer& now) noexcept;

/// Computes the gap along the plane again if it may lie beyond the band; false: it cannot, nothing
/// was computed. Cost: one support pair.
[[nodiscard]] bool renew_gate(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                              const Odometer& now, double exact_band_m, GatePlane& plane) noexcept;

}  // namespace haptic
