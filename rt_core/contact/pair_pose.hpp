// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Geometry of one pair at the current pose. A's vertices are turned into W axes once a tick for
/// each of its pieces that is near something, its normals and edges only where they are asked for;
/// every formula uses differences about local points, never absolute coordinates (METHOD section
/// 11).

#include <cstdint>

#include "rt_core/contact/lanes.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Turns the vertices of one piece of A: writes R a into `lanes_w`, three arrays of
/// piece.lane_count Reals, of which those are written that lane_points reads. Cost: a matrix
/// product per vertex.
void turn_vertices(const PieceView& piece, const Mat3& r_wa, Real* lanes_w) noexcept;

/// One pair at one configuration. `y_w` = x_0^A minus the reference of B's body: the C-space point
/// about B.
struct PairPose {
  const PairView* pair = nullptr;
  LanePoints points_a_w;  ///< R a, of this piece of A [m]
  Mat3 r_wa = Mat3::Identity();
  Vec3 y_w = Vec3::Zero();  ///< [m]
  /// c = mean(B) - R mean(A): inside the C-obstacle; zero of a part that never turns [m].
  Vec3 interior_w = Vec3::Zero();
  Real size_m = 0;  ///< sum of the two pieces' radii: the scale of tolerances
  /// Bound on the rounding error of a gap computed at this pose [m].
  Real rounding_m = 0;

  [[nodiscard]] Vec3 vertex_a(std::uint32_t v) const noexcept { return points_a_w.at(v); }
  [[nodiscard]] Vec3 normal_a(std::uint32_t f) const noexcept {
    return r_wa * pair->a.face_normal(f);
  }
  [[nodiscard]] Vec3 direction_a(std::uint32_t e) const noexcept {
    return r_wa * ConstVec3Map(pair->a.edge_directions[e].unit);
  }
  [[nodiscard]] ConstVec3Map vertex_b(std::uint32_t v) const noexcept { return pair->b.vertex(v); }
};

/// Gathers the pair's pose. `lanes_w` are the turned vertices of its piece of A.
[[nodiscard]] PairPose make_pair_pose(const PairView& pair, const Real* lanes_w, const Mat3& r_wa,
                                      const Vec3& y_w) noexcept;

/// Vertices of a piece as lanes in any axes: three arrays of piece.lane_count Reals, of which no
/// more vectors are read than hold vertices.
[[nodiscard]] inline LanePoints lane_points(const PieceView& piece, const Real* lanes) noexcept {
  return {lanes, lanes + piece.lane_count, lanes + 2 * piece.lane_count,
          (piece.vertex_count + kLanes - 1) / kLanes * kLanes};
}
/// The same in its own geometry frame, of a piece that is no facet.
[[nodiscard]] inline LanePoints lane_points(const PieceView& piece) noexcept {
  return lane_points(piece, piece.lanes);
}

}  // namespace haptic
