// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a piece turns towards a C-face plane: a face, an edge or a vertex, seen along the plane's
/// normal. Coordinates in the plane and heights over it are differences from the support vertices.

#include <cstdint>

#include "rt_core/base/plane_point.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/contact/pair_pose.hpp"

namespace haptic {

/// A face counts as turned towards the plane when the cosine between their normals exceeds this.
inline constexpr Real kMinFaceCosine = 0.9_r;
/// An edge does when the sine between it and the plane is below this: about the same angle.
inline constexpr Real kMaxEdgeSlope = 0.43_r;

/// A piece seen along the normal of a plane. Vectors are in the piece's geometry frame.
struct PieceShadow {
  const PieceView* piece = nullptr;
  Vec3 e1 = Vec3::Zero(), e2 = Vec3::Zero();  ///< plane_basis
  Vec3 outward = Vec3::Zero();                ///< unit, towards the plane: n for B, -n for A
  Vec3 origin = Vec3::Zero();                 ///< the support vertex
  PlanePoint at;                              ///< of the support vertex [m]
  Real height_m = 0;                          ///< of the support vertex along n
  Real sense = 1;                             ///< n = sense outward: 1 for B, -1 for A

  /// Coordinates in the plane of a vertex.
  [[nodiscard]] PlanePoint spot(std::uint32_t v) const noexcept {
    const Vec3 p = piece->vertex(v) - origin;
    return {at.x + e1.dot(p), at.y + e2.dot(p)};
  }
  /// How far a vertex lies behind the support vertex; never below 0 except for rounding. [m]
  [[nodiscard]] Real drop_m(std::uint32_t v) const noexcept {
    return outward.dot(origin - piece->vertex(v));
  }
};

/// A feature of a shadow and its height over the plane, linear in the spot.
struct SupportFeature {
  FeatureKind kind = FeatureKind::kVertex;
  std::uint32_t index = 0;  ///< of the vertex, edge or face within the piece
  PlanePoint foot;          ///< spot of the support vertex [m]
  Real height_m = 0;        ///< of the support vertex along n
  PlanePoint slope;         ///< change of the height with the spot

  [[nodiscard]] Real height_at(const PlanePoint& spot) const noexcept {
    return height_m + dot(slope, spot - foot);
  }
};

/// Face `f`, whose normal is the plane's: level at the height of the support vertex.
[[nodiscard]] SupportFeature level_face(const PieceShadow& shadow, std::uint32_t f) noexcept;

/// The feature at the support vertex `v`: of its faces within kMinFaceCosine, all of whose vertices
/// are at most `height_m` behind it, the one turned most squarely towards the plane; if none, the
/// flattest of its edges within kMaxEdgeSlope whose other end is not further behind; else the
/// vertex. Ties go to the first. Cost: the corners of the faces at the vertex.
[[nodiscard]] SupportFeature support_feature(const PieceShadow& shadow, std::uint32_t v,
                                             Real height_m) noexcept;

}  // namespace haptic
