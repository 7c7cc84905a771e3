// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Simplification of a surface part: edges are collapsed while every point of the given and of the
/// resulting surface is proved to lie within a tolerance of the other one.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools {

/// A surface as triangles.
struct TriangleMesh {
  std::vector<Point3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// By point: not 0 where it must stay, as at seams of which no triangle knows.
  std::vector<std::uint8_t> fixed;

  [[nodiscard]] std::array<Point3, 3> corners(std::size_t triangle) const {
    const auto& t = triangles[triangle];
    return {points[t[0]], points[t[1]], points[t[2]]};
  }
};

/// Triangles of a part that was made without merging of facets. Points at T-junctions are fixed.
TriangleMesh triangle_mesh(const SurfacePart& part);
/// The mesh as if a file had it, in metres. `like` gives its name.
RawMesh raw_mesh(const TriangleMesh& mesh, const RawMesh& like);

/// Result of a collapse of edges.
struct CollapseAccount {
  double limit_m = 0.0;            ///< the tolerance asked for
  double given_to_result_m = 0.0;  ///< proved: no point of the given surface is farther from the
                                   ///< result
  double result_to_given_m = 0.0;  ///< proved: no point of the result is farther from the given one
  std::size_t triangles_before = 0, triangles_after = 0;
  std::size_t facets_before = 0, facets_after = 0;  ///< of the parts made from them
  /// Edges that were kept at the last attempt because the distance could not be proved; because a
  /// hole, a wall or a border would have changed, or too many triangles meet at a point; because
  /// triangles would have crossed or turned over.
  std::size_t kept_by_distance = 0, kept_by_topology = 0, kept_by_crossing = 0;
  double volume_change_m3 = 0.0;  ///< of closed surfaces; else 0

  [[nodiscard]] double hausdorff_m() const {
    return given_to_result_m > result_to_given_m ? given_to_result_m : result_to_given_m;
  }
  [[nodiscard]] bool changed() const { return triangles_after < triangles_before; }
};

/// Collapses edges u -> v, cheapest first by the quadric error of Garland and Heckbert: the
/// triangles at u go over to v, so all points of the result are points of the given mesh.
///
/// Each triangle of the result keeps the given triangles that it answers for, and the other way
/// round; a collapse is done only where `ReachProof` holds for all that it changes, in both
/// directions. The surface keeps its topology (link condition), borders stay borders, and no new
/// triangle meets one that it has no corner in common with; those that could are found through the
/// given triangles next to it, each of which knows the triangles that stand for it.
/// Cost: about O(n log n) for n triangles.
class EdgeCollapse {
 public:
  explicit EdgeCollapse(TriangleMesh given);
  ~EdgeCollapse();
  EdgeCollapse(const EdgeCollapse&) = delete;
  EdgeCollapse& operator=(const EdgeCollapse&) = delete;

  /// May be called again with a larger tolerance. Stops early at `enough` triangles.
  /// @param tell  called now and then with the part of the edges that were looked at.
  void run(double tolerance_m, std::size_t enough, const std::function<void(double)>& tell);
  [[nodiscard]] std::size_t triangles() const;
  [[nodiscard]] TriangleMesh result() const;
  /// Proves all distances again, for the figures. Cost: one proof for each triangle of both.
  CollapseAccount account();

 private:
  class Work;
  std::unique_ptr<Work> work_;
};

/// Two facets, or two open edges, opposite each other.
struct NarrowPassage {
  double width_m = 0.0;  ///< where it is narrowest
  Point3 at{0, 0, 0};    ///< in its middle there
  bool is_wall = false;  ///< material between them, of a closed surface; else a hole or gap
};

/// The narrowest passage below `reach_m` between facets that look at each other (normals less than
/// 20 degrees from opposite) and have no corner in common: the least height over a triangle, along
/// its normal, of what stands over it. Facets that come as near as `touching_m` there are closed
/// already. Where the mesh is open, also between open edges whose triangles lie away from each
/// other: the hole in a sheet.
/// @param closed  the normals are those of a solid.
/// Cost: the pairs of triangles, and of open edges, nearer than the reach.
std::optional<NarrowPassage> narrowest_passage(const TriangleMesh& mesh, bool closed,
                                               double touching_m, double reach_m);

}  // namespace haptic::tools
