// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Convex pieces in double: what the graph builder and the scene writer consume. Whoever makes them
/// (the exact decomposition, a test, a reader of golden vectors) decides the numbering of vertices
/// and faces; it is kept.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace haptic::tools {

/// A plane of a body: n.x = d, n of unit length. Index in Body::planes = identity: two faces that
/// lie in one plane name the same index, with a sign.
struct BodyPlane {
  std::array<double, 3> normal{0, 0, 1};
  double offset_m = 0.0;
};

/// One face of a convex piece.
struct PieceFace {
  std::uint32_t plane = 0;          ///< index into Body::planes
  int sign = 1;                     ///< +1: outward normal = plane normal; -1: its opposite
  std::vector<std::uint32_t> loop;  ///< vertices, counter-clockwise seen from outside
  std::int64_t source_face =
      -1;  ///< 0-based face of the user's mesh that it comes from; -1: made by a cut
};

/// Where a facet's surface goes on: directions in Body::directions.
struct SurfaceCone {
  std::uint32_t begin = 0, count = 0;
};

/// One convex polyhedron; or a facet of a surface, which has two faces of the same loop, one the
/// other way round, and no volume.
struct ConvexPiece {
  std::vector<std::array<double, 3>> vertices;  ///< body frame [m]
  std::vector<std::int64_t>
      source_vertex;  ///< 0-based vertex of the user's mesh, -1: made by a cut
  std::vector<PieceFace> faces;
  double volume_m3 = 0.0;
  /// Cones of a facet. By vertex: the mesh's edges there, away from it. By side k of faces[0],
  /// which joins its loop's vertices k and k + 1: the ways into all facets there, orthogonal to the
  /// edge.
  std::vector<SurfaceCone> vertex_cones, side_cones;

  [[nodiscard]] bool is_facet() const { return faces.size() == 2; }
};

/// One rigid body as convex pieces that share their planes.
struct Body {
  std::string name;               ///< for people: mesh file name
  std::vector<BodyPlane> planes;  ///< body frame [m]
  std::vector<ConvexPiece> pieces;
  std::vector<std::array<double, 3>> directions;      ///< unit, body frame; of the facets' cones
  double volume_m3 = 0.0;                             ///< 0: a surface
  std::array<double, 3> centre_of_volume_m{0, 0, 0};  ///< body frame [m]; of a surface: of its area
};

}  // namespace haptic::tools
