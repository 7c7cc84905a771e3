// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Welding of repeated vertices, and the parts that must not be welded to each other.
///
/// A file may hold several closed solids that overlap or touch (boxes of a collision model). Welded
/// together they get edges with four faces that no geometry can sort out, so parts which the file
/// keeps apart stay apart. On the other hand one solid is often cut into groups (materials) or
/// repeats its vertices for every face or normal, and must be welded. What distinguishes the two
/// cases apart is whether a candidate is **closed by itself**:
///   1. a set of faces that is connected by vertex indices (OBJ, OFF) and has exactly two faces at
///   each edge;
///   2. of the remaining faces, a group of the file (OBJ `o`/`g`, STL `solid`) that is closed once
///   it is welded: an
///      even number of faces at each edge;
///   3. everything else together is one part.

#include <cstdint>
#include <span>
#include <vector>

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

/// For each of the points `subset` the index of the point it is welded to (itself if it is the
/// first at its place). A point joins the nearest earlier representative within `radius`, so no
/// vertex moves by more than `radius`. Exactly reproducible: depends on the order of `subset`
/// alone. Cost: O(n) for points that are not crowded.
std::vector<std::uint32_t> weld_points(const std::vector<Point3>& points,
                                       std::span<const std::uint32_t> subset, double radius);

/// Fills points, source vertices and faces of `mesh` from `mesh.raw`: parts, then a weld within
/// each of them.
/// @param local_points  all vertices of the file, local [m].
void weld_parts(WorkMesh& mesh, const std::vector<Point3>& local_points);

}  // namespace haptic::tools
