// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From a mesh as read to a surface part: a set of flat convex facets, exact with respect to the
/// triangles of the file. Nothing is asked of the mesh: it may be open, thin, non-manifold, torn or
/// pass through itself (METHOD section 15).

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// Facets and their neighbourhoods. Sheets have two sides: the normals tell the orientation of the
/// file, made consistent over edges with two facets, and nothing else.
struct SurfacePart {
  /// Convex planar polygon. Corners may be straight (180 degrees) where a neighbour has a corner.
  struct Facet {
    std::vector<std::uint32_t> loop;  ///< at least 3 vertices, counter-clockwise about `normal`
    Point3 normal{0, 0, 0};           ///< unit
  };

  std::vector<Point3> vertices_m;  ///< scaled file frame; each is used by a facet, no two are equal
  std::vector<Facet> facets;
  std::vector<std::uint32_t> source_face;  ///< of each facet: its first face in the file, from 0

  /// Local cone of each vertex, ring[ring_begin[v]] .. ring[ring_begin[v + 1]]: unit directions of
  /// the mesh edges that leave it. A vertex that lies inside an open edge of another facet
  /// (T-junction) has both directions of that edge too and the inward direction of its facet.
  /// A normal n can carry force at the vertex only if n.d >= 0 for all of them, or <= 0.
  std::vector<std::uint32_t> ring_begin;
  std::vector<Point3> ring;

  /// Side k of facet f, from loop[k] to loop[k + 1], is mesh edge edge_of[side_begin[f] + k].
  std::vector<std::uint32_t> side_begin, edge_of;
  std::vector<std::array<std::uint32_t, 2>> edges;  ///< end vertices, the smaller index first
  /// inward[inward_begin[e]] .. inward[inward_begin[e + 1]]: unit directions in the planes of the
  /// facets at edge e, at right angles to it, into each facet: one for an open edge, two as a rule,
  /// more for a non-manifold edge. An open edge also has those of the open edges that overlap it.
  std::vector<std::uint32_t> inward_begin;
  std::vector<Point3> inward;

  bool closed = false;  ///< every edge has exactly two facets, of opposite sense
};

/// Findings in a mesh and changes of it.
struct SurfaceAccount {
  std::size_t faces_read = 0;           ///< faces of the file
  std::size_t triangles_read = 0;       ///< after polygons have been cut into triangles
  std::size_t welded_vertices = 0;      ///< vertices of the file that became another one
  double largest_weld_move_m = 0.0;     ///< only ends of open edges are moved at all
  std::size_t duplicate_facets = 0;     ///< triangles over the same three vertices, removed
  std::size_t degenerate_absorbed = 0;  ///< triangles without area, covered by their neighbours
  std::size_t degenerate_loose = 0;     ///< triangles without area that nothing covers: wires
  std::size_t flipped = 0;              ///< triangles turned against the file
  std::size_t t_junction_edges = 0;     ///< open edges that other open edges overlap
  std::size_t open_edges = 0;           ///< with one facet, nothing that overlaps them all along
  std::size_t nonmanifold_edges = 0;    ///< with more than two facets
  std::size_t shells = 0;               ///< sets of facets connected by edges
  std::size_t closed_shells = 0;        ///< of these, without open and non-manifold edges, oriented
  /// No open and no non-manifold edge, and opposite senses at every edge and T-junction seam: the
  /// facets together enclose something.
  bool tight = false;
  /// Pairs of triangles that pass through each other, at most kMostCrossingsCounted; absent where
  /// counting would take long.
  std::optional<std::size_t> self_intersections;
  std::size_t triangles = 0;    ///< kept
  std::size_t facets = 0;       ///< after merging
  double widest_crack_m = 0.0;  ///< between the weld radius and a hundred of them; 0: none found
  double diagonal_m = 0.0;      ///< of the bounding box
  double weld_radius_m = 0.0;
};

inline constexpr std::size_t kMostCrossingsCounted = 1000;

struct SurfaceOptions {
  std::array<double, 3> scale_to_m = {1.0, 1.0, 1.0};  ///< metres per file unit: finite, positive
  /// Open edges nearer than this are joined [m]; absent: a half of plane_tolerance()
  /// (cleaning.hpp).
  std::optional<double> weld_radius_m = std::nullopt;
  bool merge = true;              ///< false: keep the triangles
  double flat_share = 1.0e-14;    ///< of the diagonal: merged facets are flat to within it
  std::size_t most_corners = 24;  ///< of a merged facet
  bool count_crossings = true;    ///< false: leave self_intersections absent
};

/// @throws InputError with file, place and fix: no face, not finite, all faces without area, scale
/// out of range, too many vertices or sides for 32-bit indices. Cost: O(n log n), about 2 s for 1e6
/// triangles. Equal input gives equal bits.
SurfacePart make_surface_part(const RawMesh& raw, const SurfaceOptions& options,
                              SurfaceAccount* account = nullptr);

}  // namespace haptic::tools
