// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What two convex pieces of one body have in common on a face or an edge of one of them, exactly.

#include <optional>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/separation.hpp"

namespace haptic::tools {

/// A plane of the table and the side that is outward.
struct OrientedPlane {
  std::uint32_t plane = 0;
  int sign = 1;
  bool operator==(const OrientedPlane&) const = default;
};

/// A piece prepared for overlaps: planes, vertices, and a box of rounded coordinates.
struct BoxedPiece {
  BoxedPiece(const ExactWorld& world, const Solid& piece);
  PieceHull hull;
  vec::Box box;  ///< local units, wider than the rounding
  [[nodiscard]] bool has_plane(const OrientedPlane& plane) const;
};

/// Cuts away from `polygons` (strictly convex, in the plane `own`) what `piece` covers of their
/// interiors. A piece that only touches leaves them as they are. True when something was cut.
bool cut_away(ExactWorld& world, const BoxedPiece& piece, const OrientedPlane& own,
              std::vector<Loop>& polygons);

/// Part of the segment (u, v) within a piece, ends included.
struct SegmentOverlap {
  std::uint32_t begin = 0, end = 0;   ///< vertices of the world, from u to v; never equal
  std::vector<OrientedPlane> active;  ///< planes of the piece that hold the whole part
};

/// Nothing where the piece meets the segment in a point at most.
std::optional<SegmentOverlap> overlap_of(ExactWorld& world, const BoxedPiece& piece,
                                         std::uint32_t u, std::uint32_t v);

/// True when the vertex lies in the piece, its boundary included.
bool contains(ExactWorld& world, const BoxedPiece& piece, std::uint32_t vertex);

}  // namespace haptic::tools
