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

#include "rt_core/scene/scene_parameters.hpp"
#include "rt_core/scene/scene_records.hpp"

namespace haptic {

inline constexpr char kSceneMagic[8] = {'R', 'T', 'S', 'C', 'E', 'N', 'E', '\0'};
inline constexpr std::uint32_t kSceneVersion = 4;
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
  kFixedNodes = 24        ///< FixedNode, by pair
};

struct SectionEntry {
  SectionId id;
  std::uint32_t element_bytes;
  std::uint64_t offset;
  std::uint64_t count;
};

/// Fixed capacities and bounds of one tick, computed from the tables (scene/capacity.hpp). A tick
/// visits at most `max_pair_visits` pairs, nearest first; the other bounds hold for any such
/// choice.
struct SceneCapacity {
  std::uint64_t state_bytes;   ///< memory of one HapticCore for this scene, 64-bit addresses
  std::uint32_t moving_lanes;  ///< padded vertices of all pieces of A
  std::uint32_t pair_count;
  std::uint32_t total_features;  ///< faces and edges of both pieces, over all pairs
  std::uint32_t largest_pair_features;
  std::uint32_t largest_near;     ///< largest near capacity of a pair
  std::uint32_t max_pair_visits;  ///< pairs searched in one tick
  std::uint32_t max_support_pairs;
  std::uint32_t max_feature_evaluations;  ///< faces and edges whose bound is computed
  std::uint32_t max_edge_pairs;           ///< pairs of active edges tested
  std::uint32_t max_near_nodes;           ///< of all near sets together
  std::uint32_t max_hull_points;          ///< points of one contact polygon
  /// Law kProxy, else 0: gaps along C-face planes, nodes of valid sets, searches without history.
  std::uint32_t max_plane_gaps, max_valid_nodes, max_full_searches;
  std::uint32_t max_search_work;  ///< of those searches: as StepCounters::search_work
  std::uint32_t max_proxy_passes, max_proxy_rejected;
  std::uint32_t max_proxy_rounds;                ///< of one pass
  std::uint32_t max_qp_rows, max_qp_iterations;  ///< of one quadratic program
  std::uint32_t max_qp_programs, max_qp_steps;   ///< programs, and iterations of them all together
  std::uint32_t reserved;
  std::uint32_t unproven;  ///< UnprovenBound, bit set = cannot be defended

  friend constexpr bool operator==(const SceneCapacity&, const SceneCapacity&) noexcept = default;
};

/// Why a scene cannot be certified. The work of a tick is bounded in every case; these bits say
/// that a tick might have to give up exactness, with a flag, to keep to it.
enum UnprovenBound : std::uint32_t {
  kUnprovenEdgePairs = 1u << 0,  ///< a pair has more pairs of edges than a tick may test
  kUnprovenNearSet = 1u << 1,    ///< a pair has more nodes than its near set may hold
  kUnprovenPairVisits = 1u << 2  ///< more pairs can be near at once than a tick may visit
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

static_assert(sizeof(SectionEntry) == 24 && sizeof(SceneCapacity) == 104 &&
              sizeof(SceneHeader) == 152);
static_assert(std::is_trivially_copyable_v<SceneHeader>);

/// 64-bit hash of a whole blob, its content_hash field taken as zero (FNV-1a over 8-byte words,
/// then bytes). `blob` must hold at least a header. O(bytes); deterministic on every platform.
[[nodiscard]] std::uint64_t scene_content_hash(std::span<const std::byte> blob) noexcept;

}  // namespace haptic
