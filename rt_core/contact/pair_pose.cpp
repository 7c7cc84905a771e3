// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/pair_pose.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// Coordinate `row` of a turned vertex, or of several: in this order of sums for both.
template <typename Number>
Number turned_row(const Mat3& r_wa, int row, const Number& x, const Number& y, const Number& z) {
  return (x * r_wa(row, 0) + y * r_wa(row, 1)) + z * r_wa(row, 2);
}

void turn_facet(const PieceView& facet, const Mat3& r_wa, Real* lanes_w) noexcept {
  const std::uint32_t count = lane_points(facet, lanes_w).count;
  for (std::uint32_t k = 0; k < count; ++k) {
    const ConstVec3Map p = facet.vertex(k < facet.vertex_count ? k : 0);
    for (int row = 0; row < 3; ++row) {
      lanes_w[static_cast<std::uint32_t>(row) * facet.lane_count + k] =
          turned_row(r_wa, row, p[0], p[1], p[2]);
    }
  }
}

}  // namespace

void turn_vertices(const PieceView& piece, const Mat3& r_wa, Real* lanes_w) noexcept {
  if (piece.is_facet()) {
    turn_facet(piece, r_wa, lanes_w);
    return;
  }
  const LanePoints local = lane_points(piece);
  for (std::uint32_t k = 0; k < local.count; k += kLanes) {
    RealLanes x, y, z;
    load_lanes(local.x + k, x);
    load_lanes(local.y + k, y);
    load_lanes(local.z + k, z);
    for (int row = 0; row < 3; ++row) {
      const RealLanes turned = turned_row(r_wa, row, x, y, z);
      store_lanes(turned, lanes_w + static_cast<std::uint32_t>(row) * piece.lane_count + k);
    }
  }
}

PairPose make_pair_pose(const PairView& pair, const Real* lanes_w, const Mat3& r_wa,
                        const Vec3& y_w) noexcept {
  const PieceRecord& a = *pair.a.record;
  const PieceRecord& b = *pair.b.record;
  PairPose pose;
  pose.pair = &pair;
  pose.points_a_w = lane_points(pair.a, lanes_w);
  pose.r_wa = r_wa;
  pose.y_w = y_w;
  const Vec3 mean_a(static_cast<Real>(a.centre_m[0]), static_cast<Real>(a.centre_m[1]),
                    static_cast<Real>(a.centre_m[2]));
  const Vec3 mean_b(static_cast<Real>(b.centre_m[0]), static_cast<Real>(b.centre_m[1]),
                    static_cast<Real>(b.centre_m[2]));
  pose.interior_w = mean_b - r_wa * mean_a;
  pose.size_m = static_cast<Real>(a.radius_m + b.radius_m);
  const Real scale = static_cast<Real>(a.reach_m + b.reach_m) + std::sqrt(y_w.squaredNorm());
  pose.rounding_m = 16 * kRealEpsilon * scale;
  return pose;
}

}  // namespace haptic
