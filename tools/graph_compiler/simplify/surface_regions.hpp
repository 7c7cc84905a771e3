// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A surface as connected regions of faces that share a plane, the borders between them, and what
/// becomes of both when regions are united.

#include <cstdint>
#include <set>
#include <vector>

#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"
#include "tools/graph_compiler/polyhedron/plane_fit.hpp"

namespace haptic::tools {

/// Connected faces on one side of one plane.
struct Region {
  std::uint32_t plane = 0;  ///< index into a table of planes that the caller keeps
  std::vector<std::uint32_t> faces;
  std::vector<std::uint32_t> vertices;  ///< ascending
  std::set<std::uint32_t> neighbors;
  Point3 area{0, 0, 0};  ///< outward [m2], sum over faces
  double size = 0.0;     ///< sum of face areas [m2]
  bool alive = true;     ///< false: united with another
};

/// Indices of faces and vertices are those of the surface, which must outlive this.
class SurfaceRegions {
 public:
  /// Connected faces of one plane and side are a region. Cost: linear.
  SurfaceRegions(const Surface& surface, const FaceNeighbors& neighbors, const PlaneFit& fit);

  [[nodiscard]] std::size_t count() const { return regions_.size(); }
  [[nodiscard]] Region& region(std::uint32_t r) { return regions_[r]; }
  [[nodiscard]] const Region& region(std::uint32_t r) const { return regions_[r]; }
  /// The region that a face belongs to, trials aside.
  [[nodiscard]] std::uint32_t region_at(std::uint32_t face) const { return face_region_[face]; }
  [[nodiscard]] const std::vector<std::uint32_t>& faces_at(std::uint32_t vertex) const {
    return vertex_faces_[vertex];
  }
  [[nodiscard]] std::uint32_t across(std::uint32_t face, std::size_t edge) const {
    return neighbors_.across(face, edge);
  }
  /// Moves all of `smaller` into `larger`; the plane of `larger` stays.
  void unite(std::uint32_t larger, std::uint32_t smaller);

  /// From here on borders are as if `joining` belonged to `host`.
  void pretend(std::uint32_t joining, std::uint32_t host) {
    joining_ = joining;
    host_ = host;
  }
  void pretend_nothing() { pretend(kNone, kNone); }
  /// The other ends of the edges at `v` that lie between two regions.
  void border_ends(std::uint32_t v, std::vector<std::uint32_t>& ends) const;
  /// True where three regions or more meet.
  [[nodiscard]] bool is_corner(std::uint32_t v) const;
  /// The vertices of the border that leaves `from` towards `to`, up to the next corner, or back to
  /// `from` where there is none.
  void border_chain(std::uint32_t from, std::uint32_t to, std::vector<std::uint32_t>& chain) const;

 private:
  [[nodiscard]] std::uint32_t pretended(std::uint32_t face) const {
    const std::uint32_t r = face_region_[face];
    return r == joining_ ? host_ : r;
  }

  const Surface& s_;
  const FaceNeighbors& neighbors_;
  std::vector<Region> regions_;
  std::vector<std::uint32_t> face_region_;
  std::vector<std::vector<std::uint32_t>> vertex_faces_;
  std::uint32_t joining_ = kNone, host_ = kNone;
};

}  // namespace haptic::tools
