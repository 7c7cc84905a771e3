// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Faces of a surface that lie in one plane joined to polygons, still in double (METHOD section 3,
/// step 6), and the count of reflex edges by which too curved parts are refused before anything
/// exact is computed (step 5).

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

namespace haptic::tools {

/// "No corner", "no face".
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Larger movements of a corner, in plane tolerances, are refused.
inline constexpr double kMoveTolerances = 4.0;

/// The two faces at each edge of a surface; the k-th edge of a face runs from its k-th to its next
/// vertex.
class FaceNeighbors {
 public:
  /// @throws InputError when an edge has not exactly two faces that run it in opposite directions.
  explicit FaceNeighbors(const Surface& surface);
  [[nodiscard]] std::uint32_t across(std::uint32_t face, std::size_t edge) const {
    return neighbor_[first_[face] + edge];
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> neighbor_;
};

/// One polygon with holes: all faces of one shell on one side of one plane.
struct MergedFace {
  std::uint32_t shell = 0;
  std::uint32_t plane = 0;
  int sign = 1;
  std::uint32_t widest_face = kNone;  // index into Surface::faces
};

/// Edge between two merged faces; `left` runs it from u to v, `right` from v to u.
struct MergedEdge {
  std::uint32_t u = 0, v = 0;
  std::uint32_t left = 0, right = 0;
};

struct MergedSurface {
  std::vector<MergedFace> faces;
  std::vector<MergedEdge> edges;
  std::vector<std::vector<std::uint32_t>> vertex_planes;  // per vertex of the surface, ascending
  std::size_t vertices_gone = 0;                          // inside faces and edges
  double largest_gone_m = 0.0;  // distance of a vertex inside an edge from that edge
};

/// Joins the faces of each shell and side of a plane and takes vertices inside edges away.
/// @throws InputError where the surface is thinner than the plane tolerance. Cost: near linear.
MergedSurface merge_faces(const Surface& surface, const FaceNeighbors& neighbors,
                          const PlaneFit& fit);

/// Edges where the solid fills more than half a turn.
std::size_t count_reflex(const Surface& surface, const PlaneFit& fit, const MergedSurface& merged);

/// Planes of faces such that each reflex edge lies in one of them, the one with the most edges
/// first each time: cuts along them leave no reflex edge. The convex pieces of a solid are about
/// one more. Cost: O(n log n).
std::size_t planes_through_reflex(const Surface& surface, const PlaneFit& fit,
                                  const MergedSurface& merged);

/// @throws InputError "thinner than the plane tolerance".
[[noreturn]] void refuse_thin(const Surface& surface, const Point3& local_m);

/// "(x, y, z) m" in the file frame, for messages.
std::string place_text(const Surface& surface, const Point3& local_m);

}  // namespace haptic::tools
