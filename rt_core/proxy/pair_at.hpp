// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact layer asked of a pair: A at a pose, as the pair's obstacle sees it. Normals, points
/// and turns come back along the axes of W.

#include "rt_core/contact/c_face_plane.hpp"
#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/contact_manifold.hpp"
#include "rt_core/proxy/edge_lines.hpp"
#include "rt_core/proxy/proxy_parts.hpp"
#include "rt_core/proxy/valid_planes.hpp"

namespace haptic {

/// Valid while the pose and the pair's view are.
struct PairAt {
  const PairView& view;
  const Mat3& r_wa;  ///< turn of A against the obstacle
  Vec3 y_w;          ///< grip point of A over the obstacle's reference [m]
};

/// `pair` must have its view.
[[nodiscard]] inline PairAt pair_at(const ProxyPair& pair, const GripPose& pose) noexcept {
  return {*pair.view, pose.r_wa, pose.x0_w - pair.reference_w};
}

[[nodiscard]] inline PlaneGap plane_gap(const PairAt& at, const PlaneId& id,
                                        SupportPair support) noexcept {
  return plane_gap(at.view, at.r_wa, at.y_w, id, support);
}
[[nodiscard]] inline DirectionGap direction_gap(const PairAt& at, const Vec3& normal_w,
                                                SupportPair support) noexcept {
  return direction_gap(at.view, at.r_wa, at.y_w, normal_w, support);
}
[[nodiscard]] inline Vec3 plane_normal(const PairAt& at, const PlaneId& id) noexcept {
  return plane_normal(at.view, at.r_wa, id);
}
[[nodiscard]] inline Real face_bound(const PairAt& at, const PlaneId& id,
                                     SupportPair support) noexcept {
  return face_bound(at.view, at.r_wa, at.y_w, id, support);
}
[[nodiscard]] inline bool plane_applies(const PairAt& at, const PlaneId& id) noexcept {
  return plane_applies(at.view, at.r_wa, id);
}
[[nodiscard]] inline Real gap_rounding(const PairAt& at) noexcept {
  return gap_rounding(at.view, at.y_w);
}
[[nodiscard]] inline Vec3 plane_turn(const PairAt& at, const PlaneGap& gap) noexcept {
  return plane_turn(at.view, at.r_wa, at.y_w, gap);
}
[[nodiscard]] inline ManifoldPoint support_row_point(const PairAt& at,
                                                     const PlaneGap& gap) noexcept {
  return support_row_point(at.view, at.r_wa, at.y_w, gap);
}

}  // namespace haptic
