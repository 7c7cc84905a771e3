// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/pair_gate.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
GatePlane gate_plane(const PairPose& pose, const NearResult& near, const Odometer& now) noexcept {
  GatePlane plane;
  const NearNode& best = near.best;
  plane.of_a = best.type == ContactType::kA;
  plane.face = best.type != ContactType::kC;
  plane.known = true;
  plane.normal = plane.of_a ? Vec3(-pose.pair->a.face_normal(best.i)) : best.normal_w;
  plane.support = near.support;
  plane.made_at = plane.odometer(now);
  plane.clear_until = plane.made_at + static_cast<double>(std::min(near.d_near_m, best.f_m)) -
                      static_cast<double>(pose.rounding_m);
  return plane;
}

GatePlane sphere_gate(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                      const Odometer& now) noexcept {
  const PieceRecord& a = *pair.a.record;
  const PieceRecord& b = *pair.b.record;
  const Vec3 between = (y_w - piece_centre(b)) + r_wa * piece_centre(a);
  const Real distance = std::sqrt(between.squaredNorm());
  const Real radii = static_cast<Real>(a.radius_m + b.radius_m);
  GatePlane plane;
  plane.made_at = now.of_b;
  plane.clear_until = now.of_b + static_cast<double>(distance - radii - gap_rounding(pair, y_w) -
                                                     kRealEpsilon * radii);
  return plane;
}

bool renew_gate(const PairView& pair, const Mat3& r_wa, const Vec3& y_w, const Odometer& now,
                double exact_band_m, GatePlane& plane) noexcept {
  const double odometer = plane.odometer(now);
  // The gap has grown by no more than the odometer since it was computed.
  const double at_most = plane.clear_until + odometer - 2 * plane.made_at;
  if (!plane.known || !is_far(at_most, plane.face, exact_band_m)) return false;
  const Vec3 n_w = plane.of_a ? Vec3(r_wa * plane.normal) : plane.normal;
  const Vec3 n_a = plane.of_a ? plane.normal : Vec3(r_wa.transpose() * plane.normal);
  plane.support.a = highest_vertex(pair.a, -n_a, plane.support.a);
  plane.support.b = highest_vertex(pair.b, n_w, plane.support.b);
  const Real gap =
      n_w.dot(y_w - pair.b.vertex(plane.support.b)) + n_a.dot(pair.a.vertex(plane.support.a));
  plane.made_at = odometer;
  plane.clear_until = odometer + static_cast<double>(gap - gap_rounding(pair, y_w));
  return true;
}

}  // namespace haptic
