// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Last resort on doubly curved surfaces made of quadrilaterals (spheres, tori, fillets around a
/// bend): there every corner lies on four planes and every plane has four corners, so that exact
/// coordinates grow exponentially along any order of placement, or no order exists. Such faces are
/// cut along the diagonal that sticks out: two triangles, each exactly plane, no new reflex edge.

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {

/// A merged face with three or four corners, alone on its plane: its plane can be put through the
/// corners afterwards.
struct LooseFace {
  std::uint32_t face = 0;              ///< index into MergedSurface::faces
  std::vector<std::uint32_t> loop;     ///< vertices of the surface, counter-clockwise from outside
  std::vector<std::uint32_t> corners;  ///< of the graph
};

/// Cost: linear in edges. Strictly convex ones only: either diagonal must lie inside.
/// `crowded_only`: at least one corner lies on more than three planes.
std::vector<LooseFace> find_loose_faces(const Surface& surface, const PlaneFit& fit,
                                        const MergedSurface& merged,
                                        const std::vector<std::uint32_t>& vertex_corner,
                                        const CornerPlaneGraph& graph, bool crowded_only);

/// The graph without the planes of these faces and without wishes.
CornerPlaneGraph without_faces(const CornerPlaneGraph& graph, const MergedSurface& merged,
                               const std::vector<LooseFace>& loose);

/// Puts the planes of these faces through their realised corners; where four corners are not
/// exactly in one plane, a second face, a second plane and the diagonal are added to `merged`,
/// `fit` and `real`. Returns the number of faces split; `ok` is false when corners of a face are in
/// line.
std::size_t close_faces(const std::vector<LooseFace>& loose, PlaneFit& fit, MergedSurface& merged,
                        Realisation& real, bool& ok);

}  // namespace haptic::tools
