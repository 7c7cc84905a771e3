// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Outward normals of every feature of one piece: S(face) a point, S(edge) an arc, S(vertex) a
/// convex polygon of the sphere (METHOD section 11), as the piece alone has them and as the
/// other pieces of its body leave them, whether an envelope of orientations brings two of them
/// together, and with which normals a feature is near.

#include <numbers>
#include <optional>
#include <vector>

#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/pruning/feature_cones.hpp"
#include "tools/graph_compiler/pruning/spherical_sets.hpp"

namespace haptic::tools {

// Which basic contacts can occur while the orientation of the moving part stays in its envelope.
// A contact of features f_A and f_B is applicable at R iff -R S(f_A) meets S(f_B), S being the
// outward normals of a feature. A turn by at most alpha moves no direction by more than alpha, and
// some turn by beta brings together any two directions at angle beta: so a contact occurs in the
// envelope {R : angle(R R0^T) <= alpha} iff the angle between -R0 S(f_A) and S(f_B) is at most
// alpha.

/// Kept beyond the envelope [rad]: rounding, and ties of 1e-9 m over edges of 1 mm and more that
/// the loop counts as applicable.
inline constexpr double kEnvelopeMargin_rad = 1.0e-6;

/// Rotation, or rotation and inversion, as a matrix by rows.
using Rotation = std::array<std::array<double, 3>, 3>;
/// Rotation of a unit quaternion (x, y, z, w).
Rotation rotation_of(const std::array<double, 4>& xyzw);
Direction rotated(const Rotation& r, const Direction& v);

/// R0, and the angle about it; identity and pi where every orientation is allowed.
Rotation middle_of(const std::optional<OrientationEnvelope>& envelope);
double max_angle_of(const std::optional<OrientationEnvelope>& envelope);

/// True when a rotation of the envelope brings two sets of normals together; `of_a` has been turned
/// by -R0. One of the sets is an arc or a polygon, as the type of contact has it.
template <typename OfA, typename OfB>
bool within_envelope(const OfA& of_a, const OfB& of_b, double max_angle_rad) {
  return max_angle_rad >= std::numbers::pi ||
         angle_to(of_a, of_b) <= max_angle_rad + kEnvelopeMargin_rad;
}

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

  /// The exposed part of each: nothing of a hidden feature, several arcs of an edge that is covered
  /// in part.
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

// Normals with which a feature can be near, not only touch. The loop weighs basic contacts that
// are not applicable by less than epsilon (rt_core/tracking/near_set.hpp): no neighbour of a vertex
// rises higher than that over the plane of contact, no apex of a face next to an edge. Their
// normals lie in the feature's own cone or a little way beyond it, farther where edges are short.

/// Normals of an edge; `all_round`: every direction square to it.
struct NearArc {
  SphericalArc arc;
  bool all_round = false;
};

/// Cones of one piece, numbered as in its PieceShape.
struct NearCones {
  /// Largest angle [rad] of such a normal to the vertex's cone; pi where all may be.
  std::vector<double> vertex_reach_rad;
  std::vector<NearArc> edges;  ///< the edges' arcs, longer by what is near
  /// The exposed part, as in PieceShape: arcs longer by what is near, and the cone of a hidden
  /// vertex at which an open edge ends.
  std::vector<std::vector<NearArc>> open_edges;
  std::vector<std::vector<SphericalPolygon>> open_vertices;
};

/// `epsilon_m` as the loop has it. Cost: cube of the edges at each vertex.
NearCones near_cones(const PieceShape& shape, double epsilon_m);

}  // namespace haptic::tools
