// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Geometry of one pair at the current pose. A's features are turned into W axes once a tick for
/// the whole moving body; every formula then uses differences about local points, never absolute
/// coordinates (method section 11).

#include <cstdint>

#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// A's features in W axes about the grip point x_0^A, for the current orientation. Flat arrays over
/// all pieces of A, indexed by PieceRecord::vertex_begin and so on; 3 Reals each. Memory is placed
/// by the core.
struct MovingGeometry {
  Real* vertices_w = nullptr;    ///< R a [m]
  Real* normals_w = nullptr;     ///< outward unit face normals
  Real* directions_w = nullptr;  ///< unit edge directions
};

/// Turns the features of one piece of A. Cost: vertices + faces + edges matrix products.
void turn_piece(const PieceView& piece, const Mat3& r_wa, const MovingGeometry& out) noexcept;

/// One pair at one configuration. `y_w` = x_0^A minus the reference of B's body: the C-space point
/// about B.
struct PairPose {
  const PairView* pair = nullptr;
  const Real* vertices_w = nullptr;  ///< of this piece of A
  const Real* normals_w = nullptr;
  const Real* directions_w = nullptr;
  Vec3 y_w = Vec3::Zero();         ///< [m]
  Vec3 interior_w = Vec3::Zero();  ///< c = mean(B) - R mean(A): inside the C-obstacle [m]
  Real size_m = 0;                 ///< sum of the two pieces' radii: the scale of tolerances

  [[nodiscard]] ConstVec3Map vertex_a(std::uint32_t v) const noexcept {
    return ConstVec3Map(vertices_w + 3 * std::size_t{v});
  }
  [[nodiscard]] ConstVec3Map normal_a(std::uint32_t f) const noexcept {
    return ConstVec3Map(normals_w + 3 * std::size_t{f});
  }
  [[nodiscard]] ConstVec3Map direction_a(std::uint32_t e) const noexcept {
    return ConstVec3Map(directions_w + 3 * std::size_t{e});
  }
  [[nodiscard]] ConstVec3Map vertex_b(std::uint32_t v) const noexcept { return pair->b.vertex(v); }
};

/// Gathers the pair's pose: A's turned features, the C-space point and the interior point.
[[nodiscard]] PairPose make_pair_pose(const PairView& pair, const MovingGeometry& moving,
                                      const Mat3& r_wa, const Vec3& y_w) noexcept;

}  // namespace haptic
