// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Cost of uniting two regions of a surface: how far the surface would move.

#include <limits>
#include <tuple>
#include <vector>

#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/simplify/face_triangles.hpp"
#include "tools/graph_compiler/simplify/plane_corner.hpp"
#include "tools/graph_compiler/simplify/surface_regions.hpp"

namespace haptic::tools {

/// Corners nearer to each other than this part of the diagonal are one.
inline constexpr double kSamePlace = 1.0e-9;

/// Two regions that may be united, and how.
struct Union {
  double cost_m = std::numeric_limits<double>::infinity();  ///< infinite: refused
  std::uint32_t larger = 0, smaller = 0;
  bool new_plane = false;  ///< false: the smaller one takes the plane of the larger one
  std::uint32_t stamp_larger = 0, stamp_smaller = 0;  ///< for the caller
  bool operator>(const Union& o) const {
    return std::tie(cost_m, larger, smaller, new_plane) >
           std::tie(o.cost_m, o.larger, o.smaller, o.new_plane);
  }
};

/// Through the vertices of both, by least squares, then moved to the middle of their distances.
HessePlane plane_of_both(const Surface& surface, const Region& a, const Region& b);

/// The cost of unions of a map of regions. Everything it is given must outlive it; map, planes and
/// positions may change between calls.
class UnionJudge {
 public:
  /// @param planes       of the regions
  /// @param position     of the vertices [m], with the planes as they are
  /// @param allowance_m  per vertex, at most `distance_m`
  UnionJudge(const Surface& surface, SurfaceRegions& map, const std::vector<HessePlane>& planes,
             const std::vector<Point3>& position, double distance_m,
             const std::vector<double>& allowance_m);
  /// The cheaper way to unite two regions. Cost: the vertices of both, each with the triangles
  /// within the distance of it.
  [[nodiscard]] Union judged(std::uint32_t a, std::uint32_t b);

 private:
  [[nodiscard]] double cost_of(std::uint32_t larger, std::uint32_t smaller, const HessePlane& plane,
                               bool new_plane);
  [[nodiscard]] double vertex_cost(std::uint32_t v, std::uint32_t larger, std::uint32_t smaller,
                                   const HessePlane& plane, bool new_plane, double known);
  std::size_t plane_at(std::uint32_t face, std::uint32_t larger, std::uint32_t smaller,
                       const HessePlane& plane, std::vector<HessePlane>& own);
  [[nodiscard]] double distance_to_faces(std::uint32_t v, std::uint32_t larger,
                                         std::uint32_t smaller, const HessePlane& plane,
                                         std::vector<HessePlane>& own);
  [[nodiscard]] bool edges_stay(const std::vector<std::uint32_t>& affected);
  [[nodiscard]] const Point3& position(std::uint32_t v) const {
    return trial_stamp_[v] == trial_ ? trial_position_[v] : position_[v];
  }
  [[nodiscard]] double distance_from_surface(const Point3& p);

  const Surface& s_;
  SurfaceRegions& map_;
  const std::vector<HessePlane>& planes_;
  const std::vector<Point3>& position_;
  double distance_;
  const std::vector<double>& allowance_;
  std::vector<FaceTriangle> triangles_;
  BoxTree tree_;
  std::vector<std::uint32_t> found_, around_, ends_, chain_;
  // The union under trial, and where it would move its vertices.
  std::uint32_t joined_plane_ = kNone, trial_ = 0;
  std::vector<std::uint32_t> trial_stamp_;
  std::vector<Point3> trial_position_;
};

}  // namespace haptic::tools
