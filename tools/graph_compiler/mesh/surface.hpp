// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Meshes between the file and exact geometry: as read (RawMesh) and as cleaned, closed, oriented
/// polygon surfaces (Surface). Double precision; lengths in metres after the scale has been
/// applied.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace haptic::tools {

using Point3 = std::array<double, 3>;

/// One face as the file gives it: an n-gon, n >= 3, counter-clockwise seen from outside if the file
/// is right.
struct RawFace {
  std::vector<std::uint32_t> vertices;  ///< indices into RawMesh::vertices
  std::size_t source_place = 0;         ///< line number (text formats) or byte offset (binary
                                        ///< STL); 0: the mesh has no such place
  std::uint32_t group =
      0;  ///< object/group of the file (OBJ `o`, `g`; STL `solid`): parts the file keeps apart
};

/// A named part of a file: a node of a scene, an object, a group, a solid, a product.
struct MeshNode {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::string name;              ///< as tidy_name has it (mesh_nodes.hpp); several may share one
  std::uint32_t parent = kNone;  ///< node above it, of a lower index; kNone: there is none
  bool is_part = false;          ///< of an assembly; false: holds parts, or is a piece of one
};

/// A mesh exactly as a file holds it; nothing merged, nothing dropped.
struct RawMesh {
  std::string file;              ///< for messages
  bool indexed = false;          ///< OBJ, OFF: the file shares vertices by index; STL: it does not
  bool places_are_lines = true;  ///< false: RawFace::source_place is a byte offset
  double print_resolution =
      0.0;  ///< 10^-digits of the printed coordinates, in file units; 0 for binary STL
  std::vector<Point3> vertices;            ///< file units
  std::vector<std::size_t> vertex_places;  ///< line or byte offset of each vertex
  std::vector<RawFace> faces;
  std::vector<MeshNode> nodes;             ///< empty: the file names nothing in it
  std::vector<std::uint32_t> group_nodes;  ///< by RawFace::group, where there are nodes: of which
                                           ///< the faces are
  std::vector<std::string> warnings;       ///< what the reader left out of the file, and why
  /// Remarks for the person: what was taken otherwise than it stands in the file. "file: what; ..".
  std::vector<std::string> notes;
};

/// Largest deviations and counts of one cleaning step, for the report.
struct CleaningStep {
  std::string name;             ///< "recentre", "weld", "degenerate faces", ...
  std::size_t count = 0;        ///< elements changed
  double largest_move_m = 0.0;  ///< largest distance that a vertex moved in this step
};

/// One polygon of a cleaned surface. Oriented: counter-clockwise seen from outside of the solid.
struct SurfaceFace {
  std::vector<std::uint32_t>
      vertices;                   ///< indices into Surface::vertices; one simple loop, no repeats
  std::uint32_t shell = 0;        ///< index into Surface::shells
  std::uint32_t source_face = 0;  ///< 0-based index of the face in the file
};

/// A closed, edge-manifold, consistently oriented set of faces.
struct Shell {
  std::vector<std::uint32_t> faces;
  bool is_void = false;      ///< a cavity of the shell `parent`
  std::uint32_t parent = 0;  ///< index of the enclosing solid shell when is_void
  std::uint32_t solid =
      0;  ///< index of the solid (one outer shell and its voids) that the shell bounds
};

/// A place where parallel faces of two shells lie nearer than a solid's wall may be thin.
struct CloseFaces {
  std::uint32_t shell = 0, other_shell = 0;
  std::uint32_t source_face = 0, other_source_face = 0;  ///< 0-based, of the file
  double distance_m = 0.0;
  Point3 place{0, 0, 0};  ///< local [m]
};

/// Evidence of the last printed place about planes, where that place alone makes the plane
/// tolerance as large as it is.
struct PrintedPlanes {
  /// Corners this near to their plane were not rounded off it.
  double exact_m = 0.0;
  /// A plane that the file has exactly takes corners within this, and no others.
  double join_m = 0.0;
};

/// Result of the cleaning: welded, without degenerate or duplicate faces, T-junctions stitched,
/// oriented, every edge shared by exactly two faces of one shell. Coordinates in metres relative to
/// `centre_m` of the part's own (scaled) file frame; nothing has been flattened yet.
struct Surface {
  std::string file;
  Point3 centre_m{0, 0, 0};        ///< file frame (scaled) = local + centre_m
  double diagonal_m = 0.0;         ///< diagonal of the bounding box
  double plane_tolerance_m = 0.0;  ///< tol of METHOD section 3
  /// Absent: the tolerance is that of the size, or was asked for.
  std::optional<PrintedPlanes> printed;
  /// The last printed place, where it is so coarse that the coordinates are taken as exact; else 0.
  double taken_as_exact_m = 0.0;
  std::vector<Point3> vertices;  ///< local [m]
  std::vector<std::uint32_t>
      source_vertex;  ///< 0-based index in the file of one vertex welded into this one
  std::vector<SurfaceFace> faces;
  std::vector<Shell> shells;
  std::size_t solid_count = 0;
  std::vector<CleaningStep> steps;
  std::vector<std::string> warnings;
  std::vector<CloseFaces> close_faces;  ///< whether they become one plane, the plane fit decides
};

}  // namespace haptic::tools
