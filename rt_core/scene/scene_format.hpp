// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Bytes of a compiled scene (`.rtscene`): one relocatable little-endian blob, written by the graph
/// compiler, read in place by the core. Header, table of sections, sections; every offset counts
/// from the first byte of the blob. Each section starts at a multiple of kSceneAlignment and holds
/// `count` elements of `element_bytes`; padding is zero. Sections with an unknown id are skipped.
/// Scalars named Real have the width that the header states.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/pair_records.hpp"
#include "rt_core/scene/scene_capacity.hpp"
#include "rt_core/scene/scene_parameters.hpp"

namespace haptic {

inline constexpr char kSceneMagic[8] = {'R', 'T', 'S', 'C', 'E', 'N', 'E', '\0'};
inline constexpr std::uint32_t kSceneVersion = 5;
inline constexpr std::size_t kSceneAlignment = 64;

/// Limits of the format; the compiler refuses beyond them and SceneView checks them.
inline constexpr std::uint32_t kMaxPieceFeatures =
    65535;                                               ///< vertices, edges or faces of one piece
inline constexpr std::uint32_t kMaxFaceVertices = 4096;  ///< vertices of one face
inline constexpr std::uint32_t kMaxSections = 64;

enum class SectionId : std::uint32_t {
  kParameters = 1,        ///< SceneParameters, exactly one
  kBodies = 2,            ///< BodyRecord; body 0 is the moving one
  kPlanes = 3,            ///< PlaneRecord, by body
  kPieces = 4,            ///< PieceRecord, by body
  kVertices = 5,          ///< Real[3], by piece
  kFaces = 6,             ///< FaceRecord, by piece
  kLoopVertices = 7,      ///< u16 vertices of the faces, counter-clockwise from outside
  kLoopEdges = 8,         ///< u16 edges of the faces: edge k joins loop vertices k and k + 1
  kEdges = 9,             ///< EdgeRecord, by piece
  kEdgeDirections = 10,   ///< EdgeDirection, by piece
  kVertexEdgeBegin = 11,  ///< u32, one per vertex of all pieces and one more
  kVertexEdges = 12,      ///< u16 edges at each vertex, ascending
  kPairs = 13,            ///< PairRecord
  kNodes = 14,            ///< NodeRecord, by pair whose graph is stored
  kNeighborBegin = 15,    ///< u32, one per node of all stored graphs and one more
  kNeighbors = 16,        ///< u16 or u32 (element_bytes): neighbor nodes within the pair, ascending
  kSourceVertices = 17,   ///< i32, by piece: vertex of the user's mesh, -1 when a cut made it
  kText = 18,             ///< bytes: names, UTF-8, not terminated
  kVertexLanes = 19,      ///< Real, by piece: all x, all y, all z of its vertices, each padded
  kEdgeArcs = 20,         ///< EdgeArc, by edge
  kNodeMarks = 21,        ///< u64, by pair that has marks (scene/node_marks.hpp)
  kFixedPairs = 22,       ///< FixedPairRecord, by pair; of a part that never turns
  kFixedPlanes = 23,      ///< FixedPlane, by pair (scene/fixed_planes.hpp)
  kFixedNodes = 24,       ///< FixedNode, by pair
  kSimplified = 25        ///< SimplifiedBody, by body; only where a simplification changed one
};

/// Vertices of a piece in kVertexLanes come in a multiple of this; the rest repeats vertex 0.
inline constexpr std::uint32_t kLanePadding = 8;
[[nodiscard]] constexpr std::uint32_t padded_lanes(std::uint32_t vertices) noexcept {
  return (vertices + kLanePadding - 1) / kLanePadding * kLanePadding;
}

struct SectionEntry {
  SectionId id;
  std::uint32_t element_bytes;
  std::uint64_t offset;
  std::uint64_t count;
};

struct SceneHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t header_bytes;  ///< sizeof(SceneHeader)
  std::uint64_t byte_count;    ///< of the whole blob
  std::uint64_t content_hash;  ///< scene_content_hash of the blob with this field zero
  std::uint32_t scalar_bytes;  ///< sizeof(Real): 8 or 4
  std::uint32_t section_count;
  std::uint64_t section_table;  ///< offset of SectionEntry[section_count]
  SceneCapacity capacity;
};

/// One rigid body. Geometry of the moving body is given in A's axes about the grip point; of a
/// static body in W's axes about `reference_m`.
struct BodyRecord {
  double
      reference_m[3];  ///< moving: grip point x_0^A in A's mesh frame; static: reference point in W
  double volume_m3;    ///< of the solid (pieces of a cover counted once each)
  double friction;     ///< static body: Coulomb coefficient against the moving body, 0 to 2;
                       ///< moving: 0
  std::uint32_t piece_begin, piece_count;
  std::uint32_t plane_begin, plane_count;
  std::uint32_t name_offset, name_bytes;  ///< in kText
};

/// A body that is not the solid of its mesh: bevels, fillets and rounds gave way. For people, who
/// are reported when the scene is loaded; no tick reads it.
struct SimplifiedBody {
  std::uint32_t body;
  std::uint32_t reserved;
  double distance_m;        ///< proved: no point of either surface is farther from the other
  double volume_change_m3;  ///< volume of the body minus that of the mesh
};

struct PlaneRecord {
  Real normal[3];  ///< unit
  Real offset_m;   ///< normal . p = offset for points p of the plane, in the body's geometry frame
};

struct PieceRecord {
  std::uint32_t body;
  std::uint32_t vertex_begin, vertex_count;
  std::uint32_t face_begin, face_count;
  std::uint32_t edge_begin, edge_count;
  std::uint32_t loop_begin, loop_count;  ///< in kLoopVertices and kLoopEdges
  std::uint32_t reserved;
  double volume_m3;
  double radius_m;     ///< largest distance of a vertex from `centre_m`
  double centre_m[3];  ///< mean of the vertices, geometry frame: interior point for the verdict
  double reach_m;      ///< largest distance of a vertex from the frame's origin
  /// For every vertex and every unit direction in which no neighbour rises by epsilon: how much
  /// farther than D_near - epsilon the support of a near node's plane can lie behind it [m].
  double vertex_relax_m;
  /// Largest ratio, over all edges, of the height that the piece can rise over a plane through the
  /// edge to the height of the adjoining face that rises, while that is at most epsilon; >= 1.
  double edge_relax_ratio;
  std::uint32_t lane_begin;  ///< in kVertexLanes
  std::uint32_t lane_count;  ///< padded vertices: x at lane_begin, y and z one lane_count on each
};

struct FaceRecord {
  std::uint32_t plane;       ///< index within the body's planes
  std::int32_t sign;         ///< +1 or -1: outward normal = sign * plane normal
  std::uint32_t loop_begin;  ///< in kLoopVertices, absolute
  std::uint32_t loop_count;
  std::int32_t source_face;  ///< face of the user's mesh, -1 when a cut made it
};

/// Edge v0 < v1; edges of a piece are sorted by (v0, v1). v0 -> v1 is counter-clockwise round
/// face[0].
struct EdgeRecord {
  std::uint16_t vertex[2];
  std::uint16_t face[2];
  std::uint16_t apex[2];  ///< vertex of face[k] farthest from the edge's line
};

struct EdgeDirection {
  Real unit[3];  ///< from vertex[0] to vertex[1]
  Real length_m;
};

/// The arc of an edge on the Gauss sphere, between the normals of its two faces, extended at each
/// end by the angle at which the adjoining face rises by epsilon over a plane through the edge; the
/// whole circle (cosine -1, sine 0) where a face is too narrow to rise by epsilon. The arc is
/// `cos(t) mid + sin(t) side`, |t| <= the half angle, which is at most pi.
struct EdgeArc {
  Real mid[3], side[3];  ///< orthonormal, orthogonal to the edge; `side` towards face[1]
  Real cosine, sine;     ///< of the half angle
  /// Outward normal of face[k] times the distance of apex[k] from the edge's line [m].
  Real tilt[2][3];
  /// 1 where, as far as the arc reaches beyond face[k], no vertex rises farther over a plane
  /// through the edge than apex[k]; 0 where one does.
  Real apex_rules[2];
};

static_assert(sizeof(SectionEntry) == 24 && sizeof(SceneCapacity) == 104 &&
              sizeof(SceneHeader) == 152);
static_assert(sizeof(DeviceParameters) == 96 && sizeof(CouplingParameters) == 96 &&
              sizeof(EnvelopeParameters) == 96 && sizeof(SceneParameters) == 416);
static_assert(sizeof(BodyRecord) == 64 && sizeof(PieceRecord) == 112 && sizeof(FaceRecord) == 20 &&
              sizeof(SimplifiedBody) == 24);
static_assert(sizeof(EdgeRecord) == 12 && sizeof(PairRecord) == 40 && sizeof(NodeRecord) == 8);
static_assert(sizeof(PlaneRecord) == 4 * sizeof(Real) &&
              sizeof(EdgeDirection) == 4 * sizeof(Real) && sizeof(EdgeArc) == 16 * sizeof(Real));
static_assert(std::is_trivially_copyable_v<SceneHeader> &&
              std::is_trivially_copyable_v<SceneParameters>);

/// 64-bit hash of a whole blob, its content_hash field taken as zero (FNV-1a over 8-byte words,
/// then bytes). `blob` must hold at least a header. O(bytes); deterministic on every platform.
[[nodiscard]] std::uint64_t scene_content_hash(std::span<const std::byte> blob) noexcept;

}  // namespace haptic
