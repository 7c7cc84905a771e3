// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact region of a pair along one C-face plane as points with gaps of their own: what the
/// two pieces turn towards the plane, clipped against each other (paper Sec. IV: the region H and
/// its App_i). The pieces may be apart or tilted to each other by a little; the points then are
/// where a small motion can make them meet.

#include <array>
#include <cstdint>

#include "rt_core/contact/c_face_plane.hpp"
#include "rt_core/proxy/convex_polygon.hpp"

namespace haptic {

/// Points of one manifold; of a region with more corners those are kept that tell most of it.
inline constexpr std::uint32_t kMaxManifoldPoints = 16;

/// A point of the contact region: the motion (dx, dtheta) of A about x_0^A changes its gap by
/// n.(dx + dtheta x App).
struct ManifoldPoint {
  Vec3 app_w = Vec3::Zero();  ///< on B (kA), on A (kB), midway (kC); about x_0^A, W axes [m]
  Real gap_m = 0;             ///< n.(a - b) of the points of the two features on its normal
};

/// Working memory of contact_manifold, placed once for a scene.
struct ManifoldScratch {
  ConvexPolygon polygon;
  bool overlap = false;  ///< of the last manifold: the two features overlap as seen along n

  /// `face_a`, `face_b`: the largest number of vertices of a face of A and of B.
  void place(Arena& arena, std::uint32_t face_a, std::uint32_t face_b) noexcept {
    polygon.place(arena, face_b, face_a);
  }
};

/// The single point at the support vertices of the plane; its gap is the plane's.
[[nodiscard]] ManifoldPoint support_row_point(const PairView& pair, const Mat3& r_wa,
                                              const Vec3& y_w, const PlaneGap& gap) noexcept;

/// What a small turn of A adds to a gap of two edges (kC), for each radian, beyond what it adds at
/// the row point: their plane turns with the edge of A, and the support vertices lie apart along it
/// [m]. Zero for the plane of a face.
[[nodiscard]] Vec3 plane_turn(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                              const PlaneGap& gap) noexcept;

/// Fills `points` with the contact region along the plane and returns their number, at least 1.
/// Each piece gives its support_feature within `height_m` of its support, the face of a kA or kB
/// plane being given; the region is the intersection of the two as seen along n. Where that is
/// empty (scratch.overlap tells), the corners of the feature across from the face of a kA or kB
/// plane, and of a kC plane the support pair's point. No gap is below the plane's except for
/// rounding. Points closer than a millionth of the smaller piece's radius are one, with the smaller
/// gap. Of more than kMaxManifoldPoints the one with the smallest gap is kept and, one by one, the
/// farthest outside the hull of the kept.
/// @param y_w  as for plane_gap [m].
/// @param gap  of the plane at this pose, defined.
/// @param height_m  > 0 [m].
/// Cost: the corners of the faces at the support vertices, a few times the corners of the two
/// features, and of a region with more corners than fit, those at most kMaxManifoldPoints times
/// (three or four times as a rule). Never their product.
[[nodiscard]] std::uint32_t contact_manifold(
    const PairView& pair, const Mat3& r_wa, const Vec3& y_w, const PlaneGap& gap, Real height_m,
    ManifoldScratch& scratch, std::array<ManifoldPoint, kMaxManifoldPoints>& points) noexcept;

}  // namespace haptic
