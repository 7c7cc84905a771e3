// SPDX-License-Identifier: Apache-2.0
// Planes of the screen: one fixed in W between a triangle of A and a facet of an obstacle.
#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/proxy/facet_screen.hpp"

namespace haptic {
namespace {

/// The face of the facet is taken at once where it leaves so many times what is needed.
constexpr Real kPlenty = 4;
/// Edges as parallel as this have no one line between them.
constexpr Real kParallelEdges = 1.0e-14_r;

Real lowest(const Vec3 (&corners_w)[3], const Vec3& normal_w) noexcept {
  return std::min(
      {normal_w.dot(corners_w[0]), normal_w.dot(corners_w[1]), normal_w.dot(corners_w[2])});
}

}  // namespace

/// The gap along a direction.
Real FacetScreen::gap_along(const Vec3& normal_w, const Placed& at,
                            std::uint32_t facet) const noexcept {
  Real height_m = -std::numeric_limits<Real>::max();
  for (const Vec3& corner : corners_of(facet)) height_m = std::max(height_m, normal_w.dot(corner));
  return lowest(at.corner_w, normal_w) - height_m;
}

/// The gaps along a direction, taken where they are the best so far.
FacetScreen::Plane FacetScreen::try_plane(const Vec3& normal_w, const Between& between,
                                          Tried& tried) const noexcept {
  const Placed* const at_q = between.at_q;
  Real height_m = -std::numeric_limits<Real>::max();
  for (const Vec3& corner : corners_of(between.facet)) {
    height_m = std::max(height_m, normal_w.dot(corner));
  }
  Plane plane;
  plane.normal_w = normal_w;
  plane.gap_p_m = lowest(between.at_p->corner_w, normal_w) - height_m;
  plane.gap_q_m = at_q != nullptr ? lowest(at_q->corner_w, normal_w) - height_m : plane.gap_p_m;
  if (plane.worth_m() > tried.best.worth_m()) tried.best = plane;
  if (plane.gap_p_m > tried.ends.gap_p_m) {
    tried.ends.gap_p_m = plane.gap_p_m;
    tried.ends.normal_p_w = normal_w;
  }
  if (plane.gap_q_m > tried.ends.gap_q_m) {
    tried.ends.gap_q_m = plane.gap_q_m;
    tried.ends.normal_q_w = normal_w;
  }
  return plane;
}

/// The unit direction between the closest points of their edges at one pose; zero: they meet.
Vec3 FacetScreen::closest_w(const Placed& at, std::uint32_t facet) const noexcept {
  const StaticFacet& of_b = b_.facets[facet];
  Real least2 = std::numeric_limits<Real>::max();
  Vec3 between = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vec3& a0 = at.corner_w[i];
    const Vec3 along_a = at.corner_w[(i + 1) % 3] - a0;
    const Real aa = along_a.squaredNorm();
    for (std::uint32_t j = 0; j < of_b.count; ++j) {
      const Vec3& b0 = b_.corners_w[of_b.begin + j];
      const Vec3 along_b = b_.corners_w[of_b.begin + (j + 1 == of_b.count ? 0 : j + 1)] - b0;
      const Vec3 from_b = a0 - b0;
      const Real bb = along_b.squaredNorm(), ab = along_a.dot(along_b);
      const Real fa = along_a.dot(from_b), fb = along_b.dot(from_b);
      const Real det = aa * bb - ab * ab;
      Real s = det > kParallelEdges * aa * bb ? std::clamp((ab * fb - fa * bb) / det, 0.0_r, 1.0_r)
                                              : 0.0_r;
      Real t = (ab * s + fb) / bb;
      if (t < 0) {
        t = 0;
        s = std::clamp(-fa / aa, 0.0_r, 1.0_r);
      } else if (t > 1) {
        t = 1;
        s = std::clamp((ab - fa) / aa, 0.0_r, 1.0_r);
      }
      const Vec3 way = from_b + s * along_a - t * along_b;
      const Real way2 = way.squaredNorm();
      if (way2 < least2) {
        least2 = way2;
        between = way;
      }
    }
  }
  const Real far = std::sqrt(least2);
  return far > 0 ? Vec3(between / far) : Vec3(Vec3::Zero());
}

/// Tries planes until one has the gap that is needed: the face of the facet, and that of the
/// triangle at either end. None of them turns with the part.
bool FacetScreen::find_plane(const Between& between, Tried& tried) noexcept {
  work_ += kDirectionWork;
  const StaticFacet& of_b = b_.facets[between.facet];
  constexpr Real kLowest = -std::numeric_limits<Real>::max();
  tried.best.gap_p_m = tried.best.gap_q_m = kLowest;
  for (WayEnds* const ends : {&tried.of_a, &tried.closest, &tried.ends}) {
    ends->gap_p_m = ends->gap_q_m = kLowest;
  }
  Real side_m = -3 * of_b.offset_m;
  for (const Vec3& corner : between.at_p->corner_w) side_m += of_b.normal.dot(corner);
  const Vec3 normal_b = side_m < 0 ? Vec3(-of_b.normal) : of_b.normal;
  const Plane of_face = try_plane(normal_b, between, tried);
  if (of_face.worth_m() >= kPlenty * between.need_m) return true;
  const auto face_of_a = [&](const GripPose& pose, const Placed& at) {
    work_ += kDirectionWork;
    const Vec3 normal_a = pose.r_wa * a_.shape[between.row].normal;
    const Real ahead_m = normal_a.dot(at.corner_w[0]) - normal_a.dot(b_.corners_w[of_b.begin]);
    return ahead_m < 0 ? Vec3(-normal_a) : normal_a;
  };
  if (between.at_q != nullptr) {
    tried.of_a.normal_q_w = face_of_a(*between.q, *between.at_q);
    tried.of_a.gap_q_m = try_plane(tried.of_a.normal_q_w, between, tried).gap_q_m;
    if (tried.best.worth_m() >= between.need_m) return true;
  }
  tried.of_a.normal_p_w = face_of_a(*between.p, *between.at_p);
  tried.of_a.gap_p_m = try_plane(tried.of_a.normal_p_w, between, tried).gap_p_m;
  return tried.best.worth_m() >= between.need_m;
}

/// Goes on with the direction between their closest points at one end.
bool FacetScreen::find_closest(const Placed& at, const Between& between, Tried& tried) noexcept {
  work_ += kClosestWork;
  const Vec3 normal_w = closest_w(at, between.facet);
  if (normal_w.isZero(0)) return false;
  const Plane plane = try_plane(normal_w, between, tried);
  if (&at == between.at_q) {
    tried.closest.normal_q_w = normal_w;
    tried.closest.gap_q_m = plane.gap_q_m;
  } else {
    tried.closest.normal_p_w = normal_w;
    tried.closest.gap_p_m = plane.gap_p_m;
  }
  return tried.best.worth_m() >= between.need_m;
}

/// True if a plane that turns on the way keeps them apart: from a direction that does so at p to
/// one that does at q.
bool FacetScreen::turns_past(const Row& row, Real lever_m, const Way& way, const Tried& tried,
                             Vec3& normal_q_w) const noexcept {
  const Real rounding_m = static_cast<Real>(row.rounding_m);
  for (const WayEnds* const ends : {&tried.of_a, &tried.closest, &tried.ends}) {
    if (!(ends->gap_q_m >= way.least_m + rounding_m)) continue;
    const Real least_m = gap_on_way_m(*ends, lever_m, way.dx_m, way.dtheta_rad);
    if (!(least_m >= way.least_m - way.dip_m + rounding_m)) continue;
    normal_q_w = ends->normal_q_w;
    return true;
  }
  return false;
}

}  // namespace haptic
