// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Checked, read-only access to a compiled scene. `SceneView::open` verifies every offset, index
/// and number once; the servo loop then reads the tables without further checks. The blob must
/// outlive the view; nothing is copied.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "rt_core/base/status.hpp"
#include "rt_core/scene/formed_pairs.hpp"
#include "rt_core/scene/node_marks.hpp"
#include "rt_core/scene/scene_format.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// One convex piece: pointers into the tables, indices local to the piece. Geometry frame: moving
/// body: A's axes about the grip point; static body: W's axes about the body's reference.
struct PieceView {
  const PieceRecord* record = nullptr;
  const Real* vertices = nullptr;  ///< 3 per vertex [m]
  /// The same, by coordinate: x at lanes[0 .. lane_count), y and z one lane_count on each [m]. What
  /// is beyond vertex_count repeats vertex 0. Null of a facet.
  const Real* lanes = nullptr;
  const FaceRecord* faces = nullptr;
  const EdgeRecord* edges = nullptr;
  const EdgeDirection* edge_directions = nullptr;
  const EdgeArc* arcs = nullptr;                     ///< by edge; null of a facet
  const std::uint32_t* vertex_edge_begin = nullptr;  ///< of vertex v from [v] to [v + 1]; absolute
  const std::uint16_t* vertex_edges = nullptr;       ///< whole table
  const std::uint16_t* loop_vertices = nullptr;      ///< whole table
  const std::uint16_t* loop_edges = nullptr;         ///< whole table
  const PlaneRecord* planes = nullptr;               ///< of the body
  const std::int32_t* source_vertices = nullptr;
  std::uint32_t vertex_count = 0, face_count = 0, edge_count = 0;
  std::uint32_t lane_count = 0;  ///< vertex_count rounded up to a multiple of kLanePadding
  /// Of a flat piece: of its vertices, then of its edges; else null.
  const ConeRange* cones = nullptr;
  const Real* cone_directions = nullptr;  ///< whole table, the sides of all facets first

  [[nodiscard]] ConstVec3Map vertex(std::uint32_t v) const noexcept {
    return ConstVec3Map(vertices + 3 * std::size_t{v});
  }
  [[nodiscard]] std::span<const std::uint16_t> face_vertices(std::uint32_t f) const noexcept {
    return {loop_vertices + faces[f].loop_begin, faces[f].loop_count};
  }
  [[nodiscard]] std::span<const std::uint16_t> face_edges(std::uint32_t f) const noexcept {
    return {loop_edges + faces[f].loop_begin, faces[f].loop_count};
  }
  [[nodiscard]] std::span<const std::uint16_t> edges_at(std::uint32_t v) const noexcept {
    return {vertex_edges + vertex_edge_begin[v], vertex_edge_begin[v + 1] - vertex_edge_begin[v]};
  }
  /// A facet of a surface.
  [[nodiscard]] bool is_facet() const noexcept { return kSceneTraits.facets && cones != nullptr; }
  /// Calls `visit(unit direction)` for what the surface goes on along from vertex `v`, or from edge
  /// `e`, of a facet, until it returns false. @return whether it never has.
  template <typename Visit>
  [[nodiscard]] bool all_at_vertex(std::uint32_t v, const Visit& visit) const noexcept {
    return all_of_cone(cones[v], visit);
  }
  template <typename Visit>
  [[nodiscard]] bool all_at_edge(std::uint32_t e, const Visit& visit) const noexcept {
    return all_of_cone(cones[vertex_count + e], visit);
  }
  /// The end of edge `e` that is not `v`.
  [[nodiscard]] std::uint32_t other_end(std::uint32_t e, std::uint32_t v) const noexcept {
    const EdgeRecord& edge = edges[e];
    return edge.vertex[0] == v ? edge.vertex[1] : edge.vertex[0];
  }
  /// Outward unit normal of face `f`, geometry frame.
  [[nodiscard]] Vec3 face_normal(std::uint32_t f) const noexcept {
    const PlaneRecord& p = planes[faces[f].plane];
    const Real s = static_cast<Real>(faces[f].sign);
    return {s * p.normal[0], s * p.normal[1], s * p.normal[2]};
  }
  /// face_normal(f) . p for points p of the face [m].
  [[nodiscard]] Real face_offset(std::uint32_t f) const noexcept {
    return static_cast<Real>(faces[f].sign) * planes[faces[f].plane].offset_m;
  }
  /// Of plane `p`, below plane_count(*record): unit normal, geometry frame; its offset; a vertex on
  /// it. Planes of faces come first.
  [[nodiscard]] bool is_side(std::uint32_t p) const noexcept { return p >= face_count; }
  [[nodiscard]] std::uint32_t side_edge(std::uint32_t p) const noexcept { return p - face_count; }
  [[nodiscard]] Vec3 plane_normal(std::uint32_t p) const noexcept {
    return is_side(p) ? Vec3(side_normal(side_edge(p))) : face_normal(p);
  }
  /// Unit normal of a facet's side along edge `e`, in the facet's plane and out of it.
  [[nodiscard]] ConstVec3Map side_normal(std::uint32_t e) const noexcept {
    return ConstVec3Map(cone_directions + 3 * (std::size_t{record->flat_edges} + e));
  }
  /// Outward normal of face k of edge `e` times the distance of apex k from the edge's line [m].
  [[nodiscard]] Vec3 tilt(std::uint32_t e, std::size_t k) const noexcept {
    if (!is_facet()) return ConstVec3Map(arcs[e].tilt[k]);
    const EdgeRecord& edge = edges[e];
    const Real width_m = side_normal(e).dot(vertex(edge.vertex[0]) - vertex(edge.apex[k]));
    return width_m * face_normal(edge.face[k]);
  }
  [[nodiscard]] Real plane_offset(std::uint32_t p) const noexcept {
    return is_side(p) ? plane_normal(p).dot(vertex(plane_vertex(p))) : face_offset(p);
  }
  [[nodiscard]] std::uint32_t plane_vertex(std::uint32_t p) const noexcept {
    return is_side(p) ? edges[side_edge(p)].vertex[0] : face_vertices(p)[0];
  }

 private:
  template <typename Visit>
  [[nodiscard]] bool all_of_cone(const ConeRange& cone, const Visit& visit) const noexcept {
    const Real* const first = cone_directions + 3 * std::size_t{cone.begin};
    for (std::uint32_t k = 0; k < cone.count; ++k) {
      if (!visit(ConstVec3Map(first + 3 * std::size_t{k}))) return false;
    }
    return true;
  }
};

/// Neighbor lists of one pair in CSR form; 16- or 32-bit indices.
struct NeighborLists {
  const std::uint32_t* begin = nullptr;  ///< of the pair's node 0; absolute positions
  const void* table = nullptr;
  bool wide = false;  ///< 32-bit

  [[nodiscard]] std::uint32_t count(std::uint32_t node) const noexcept {
    return begin[node + 1] - begin[node];
  }
  [[nodiscard]] std::uint32_t at(std::uint32_t node, std::uint32_t k) const noexcept {
    const std::size_t i = std::size_t{begin[node]} + k;
    return wide ? static_cast<const std::uint32_t*>(table)[i]
                : static_cast<const std::uint16_t*>(table)[i];
  }
};

/// One pair: its record, its two pieces and its graph. A graph that is not stored has no tables
/// here; scene/graph_rule.hpp forms it from the pieces.
struct PairView {
  PairRecord record{};
  PieceView a, b;
  bool graph_stored = false;
  const NodeRecord* nodes = nullptr;  ///< null when not stored
  NeighborLists neighbors;            ///< empty when not stored
  NodeMarks marks;                    ///< not given: every node is live
  /// Gap that is held between the two, so that a facet, which has no thickness, has two sides [m];
  /// law proxy alone sets it.
  Real skin_m = 0;

  /// One of the two is a facet.
  [[nodiscard]] bool has_facet() const noexcept { return a.is_facet() || b.is_facet(); }
  [[nodiscard]] bool has_lists() const noexcept { return graph_stored; }
};

/// Where SceneView::open found a blob at fault, for people who look for the damage. Holds for a
/// status of the tables; what is wrong with header and section table the status says itself.
struct SceneFault {
  SectionId section = SectionId::kParameters;  ///< 0: capacities in the header
  std::uint32_t index = 0;                     ///< of the element at which the check stopped
};

/// Index of a pair that the scene does not have.

class SceneView {
 public:
  /// Checks `blob` and fills `view`. On failure `view` is unchanged.
  /// Cost: O(bytes + stored arcs log degree + pairs times features), no allocation. Any byte
  /// sequence is safe. In an image (scene/scene_traits.hpp): kBlobNotOfImage for any other scene
  /// than its own; the tables are those that the graph compiler has checked, by their hash.
  [[nodiscard]] static RtStatus open(std::span<const std::byte> blob, SceneView& view) noexcept;
  /// The same; where it fails, `fault` tells the place.
  [[nodiscard]] static RtStatus open(std::span<const std::byte> blob, SceneView& view,
                                     SceneFault& fault) noexcept;

  /// What `open` checks of the first bytes alone, before a reader makes room for the others: the
  /// header, and whether the sections that it lists make up `byte_count` bytes.
  /// @param front  the first min(byte_count, kSceneFrontBytes) bytes, aligned to kSceneAlignment.
  [[nodiscard]] static RtStatus check_front(std::span<const std::byte> front,
                                            std::uint64_t byte_count) noexcept;

  [[nodiscard]] const SceneHeader& header() const noexcept { return *header_; }
  [[nodiscard]] const SceneParameters& parameters() const noexcept { return *parameters_; }
  [[nodiscard]] std::span<const BodyRecord> bodies() const noexcept { return bodies_; }
  [[nodiscard]] std::span<const PieceRecord> pieces() const noexcept { return tables_.pieces; }
  /// Those that the scene lists (scene/formed_pairs.hpp).
  [[nodiscard]] std::span<const PairRecord> listed_pairs() const noexcept { return graph_.pairs; }
  [[nodiscard]] bool lists_pairs() const noexcept {
    return haptic::lists_pairs(*parameters_, bodies_[0].piece_count, static_pieces(), facets_);
  }
  /// Some piece is a facet of a surface.
  [[nodiscard]] bool has_facets() const noexcept { return kSceneTraits.facets && facets_; }
  /// All of them, listed or not.
  [[nodiscard]] PairIndex pair_count() const noexcept {
    return lists_pairs() ? graph_.pairs.size()
                         : PairIndex{bodies_[0].piece_count} * static_pieces();
  }
  [[nodiscard]] PairRecord pair_record(PairIndex index) const noexcept;
  /// Bodies that a simplification changed, ascending; empty: none. Cost: O(sections).
  [[nodiscard]] std::span<const SimplifiedBody> simplified_bodies() const noexcept;
  /// The plan that leads the hand; null and empty: there is none. Cost: O(sections).
  [[nodiscard]] const GuideRecord* guide() const noexcept;
  [[nodiscard]] std::span<const GuideStation> guide_stations() const noexcept;
  /// Words of kNodeMarks; empty where no pair or piece has marks.
  [[nodiscard]] std::span<const std::uint64_t> marks() const noexcept { return graph_.marks; }
  [[nodiscard]] std::span<const SectionEntry> sections() const noexcept { return sections_; }
  [[nodiscard]] std::span<const std::byte> blob() const noexcept { return blob_; }
  /// The part never turns: its one orientation is that of parameters().envelope.
  [[nodiscard]] bool is_locked() const noexcept {
    return kSceneTraits.is_locked(is_one_orientation(parameters_->envelope));
  }
  /// Stored neighbors have 32 bits, else 16.
  [[nodiscard]] bool neighbors_wide() const noexcept { return graph_.wide; }
  /// Piece and pair by index; the index must be in range.
  [[nodiscard]] PieceView piece(std::uint32_t index) const noexcept;
  [[nodiscard]] PairView pair(PairIndex index) const noexcept;
  /// The pair of two pieces by their index; kNoPair where they can never meet. Cost: O(log pairs).
  [[nodiscard]] PairIndex find_pair(std::uint32_t piece_a, std::uint32_t piece_b) const noexcept;
  [[nodiscard]] std::string_view text(std::uint32_t offset, std::uint32_t bytes) const noexcept;

 private:
  [[nodiscard]] std::uint32_t static_pieces() const noexcept {
    return static_cast<std::uint32_t>(tables_.pieces.size()) - bodies_[0].piece_count;
  }
  [[nodiscard]] RtStatus bind(std::span<const std::byte> blob) noexcept;
  [[nodiscard]] RtStatus check_tables(SceneFault& fault) const noexcept;
  [[nodiscard]] RtStatus check_parameters() const noexcept;
  [[nodiscard]] RtStatus check_guide(SceneFault& fault) const noexcept;
  [[nodiscard]] RtStatus check_bodies(SceneFault& fault) const noexcept;
  [[nodiscard]] RtStatus check_piece(std::uint32_t index) const noexcept;
  /// @param stored_nodes  nodes of the stored graphs of all pairs before; grows by those of this.
  /// @param mark_words  words of the marks of all pairs before; grows by those of this.
  [[nodiscard]] RtStatus check_pair(std::uint32_t index, std::uint64_t& stored_nodes,
                                    std::uint64_t& mark_words) const noexcept;
  [[nodiscard]] RtStatus check_pairs(SceneFault& fault) const noexcept;
  /// Of a scene that does not list its pairs.
  [[nodiscard]] RtStatus check_formed_pairs(SceneFault& fault) const noexcept;
  [[nodiscard]] RtStatus check_sections() const noexcept;
  /// @param ranges  of all pieces before; grow by those of this.
  [[nodiscard]] RtStatus check_cones(std::uint32_t index, std::uint64_t& ranges) const noexcept;
  [[nodiscard]] RtStatus check_place(std::uint32_t index) const noexcept;
  [[nodiscard]] RtStatus check_capacity() const noexcept;

  /// Tables of all pieces.
  struct PieceTables {
    std::span<const PieceRecord> pieces;
    std::span<const PlaneRecord> planes;
    std::span<const Real> vertices;  ///< 3 per vertex
    std::span<const Real> lanes;
    std::span<const FaceRecord> faces;
    std::span<const std::uint16_t> loop_vertices, loop_edges;
    std::span<const EdgeRecord> edges;
    std::span<const EdgeDirection> edge_directions;
    std::span<const EdgeArc> arcs;
    std::span<const std::uint32_t> vertex_edge_begin;
    std::span<const std::uint16_t> vertex_edges;
    std::span<const ConeRange> cone_ranges;
    std::span<const Real> cone_directions;  ///< 3 per direction
    std::span<const std::int32_t> source_vertices;
  };
  /// Tables of the listed pairs and the graphs that are stored.
  struct GraphTables {
    std::span<const PairRecord> pairs;
    std::span<const NodeRecord> nodes;
    std::span<const std::uint32_t> neighbor_begin;
    std::span<const std::byte> neighbors;
    std::uint64_t neighbor_count = 0;
    bool wide = false;  ///< neighbors have 32 bits
    std::span<const std::uint64_t> marks;
  };

  std::span<const std::byte> blob_;
  const SceneHeader* header_ = nullptr;
  const SceneParameters* parameters_ = nullptr;
  std::span<const SectionEntry> sections_;
  std::span<const BodyRecord> bodies_;
  PieceTables tables_;
  GraphTables graph_;
  bool facets_ = false;               ///< some piece is one
  std::uint32_t found_sections_ = 0;  ///< bit of each SectionId that the blob has
  std::span<const std::byte> text_;
};

}  // namespace haptic
