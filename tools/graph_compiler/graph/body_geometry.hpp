// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Geometry of a body in the frame in which the core reads it: the moving body in A's axes about
/// the grip point, a static body in W's axes about a reference point near its centre. Computed in
/// 80-bit long double and rounded to Real once, so that a part far from its origin loses nothing
/// but that one rounding.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::tools {

/// Geometry of one piece; vertices and edges as numbered by its topology.
struct PieceGeometry {
  std::vector<std::array<Real, 3>> vertices;
  std::vector<EdgeDirection> edge_directions;
  double volume_m3 = 0.0;
  double radius_m = 0.0;
  std::array<double, 3> centre_m{0, 0, 0};  ///< mean of the vertices
};

struct BodyGeometry {
  std::array<double, 3> reference_m{0, 0, 0};  ///< BodyRecord::reference_m
  std::vector<PlaneRecord> planes;
  std::vector<PieceGeometry> pieces;
  std::vector<std::array<Real, 3>> directions;  ///< of the facets' cones
};

/// Geometry of the moving body: coordinates minus `grip_m` (both in A's mesh frame).
BodyGeometry moving_geometry(const PlacedBody& placed, const std::array<double, 3>& grip_m,
                             const std::vector<PieceTopology>& topologies);

/// Geometry of a static body in W about the centre of its bounding box, which is rounded to a
/// binary grid of about 1/32 of the size: with the identity pose the subtraction is then exact for
/// coordinates of ordinary parts.
BodyGeometry static_geometry(const PlacedBody& placed,
                             const std::vector<PieceTopology>& topologies);

/// Sets inertia and centre of a held part with a mass: that of the pieces of `placed`, of uniform
/// density, about `grip_m` (both in A's mesh frame). Nothing changes without a mass.
void set_held_part(HeldPartParameters& held, const PlacedBody& placed,
                   const std::array<double, 3>& grip_m);

/// Unit quaternion (w, x, y, z) of the same direction.
/// @throws InputError when it is not finite or its length is not within 1e-6 of 1.
std::array<long double, 4> unit_quaternion(const std::array<double, 4>& wxyz,
                                           const std::string& place);

/// A facet that is flat to within the rounding of its part's size, and not of its own coordinates.
class FacetNotFlat : public InputError {
 public:
  explicit FacetNotFlat(const std::string& text) : InputError(text) {}
};

/// Checks the rounded geometry by the rule of SceneView::open, with words: finite, planes unit,
/// every vertex within rounding of its own planes and inside all others, loops counter-clockwise.
/// `place` starts the messages.
/// @throws InputError naming piece, face, vertex and distance; FacetNotFlat. Cost: O(F V).
void check_geometry(const BodyGeometry& geometry, std::size_t piece, const PieceTopology& topology,
                    const std::string& place);

}  // namespace haptic::tools
