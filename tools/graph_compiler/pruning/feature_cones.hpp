// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Outward normals of every feature of one piece: S(face) a point, S(edge) an arc, S(vertex) a
/// convex polygon of the sphere (METHOD section 11), as the piece alone has them and as the
/// other pieces of its body leave them.

#include <optional>
#include <vector>

#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/pruning/orientation_envelope.hpp"

namespace haptic::tools {

/// One piece where the pruning looks at it: vertices of a piece of A in A's axes about the grip
/// point, those of a static piece in W.
struct PieceShape {
  PieceTopology topology;
  std::vector<std::array<double, 3>> vertices;  ///< [m]
  std::vector<Direction> normals;               ///< outward, by face
  bool moving = false;

  /// From the axes of `vertices` to those of the cones.
  Rotation to_cones{};
  /// Normals in W; those of a piece of A turned by -R0, so that two features can touch at R0 where
  /// their sets meet.
  std::vector<Direction> face_cones;
  std::vector<SphericalArc> edge_cones;
  std::vector<SphericalPolygon> vertex_cones;

  /// What the body leaves of them: nothing of a hidden feature, several arcs of an edge that is
  /// covered in part.
  std::vector<std::vector<Direction>> open_faces;
  std::vector<std::vector<SphericalArc>> open_edges;
  std::vector<std::vector<SphericalPolygon>> open_vertices;
  std::vector<std::uint32_t> edge_ends;  ///< hidden vertices at which an open edge ends
  /// True where the body leaves all of a face, all of a vertex's cone.
  std::vector<bool> whole_faces, whole_vertices;
};

/// Shapes of all pieces of a body. `grip_m`: of the moving body in its mesh frame; null for a
/// static one, which stands at its pose. `exposure`: of the body's pieces, or null where nothing is
/// hidden.
/// @throws InputError when a piece is not one closed polyhedron.
std::vector<PieceShape> piece_shapes(const PlacedBody& placed, const std::array<double, 3>* grip_m,
                                     const PieceExposure* exposure,
                                     const std::optional<OrientationEnvelope>& envelope);

}  // namespace haptic::tools
