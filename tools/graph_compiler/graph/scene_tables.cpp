// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/scene_tables.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/graph_limits.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/graph/pair_graph.hpp"
#include "tools/graph_compiler/graph/relaxation.hpp"

namespace haptic::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "the blob is little-endian");

std::size_t align_up(std::size_t offset) {
  return (offset + kSceneAlignment - 1) / kSceneAlignment * kSceneAlignment;
}

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

std::string piece_place(const Body& body, std::size_t piece) {
  return body.name + ": piece " + std::to_string(piece);
}

/// Appends the vertices by coordinate, each padded with vertex 0; nothing of a facet.
void add_lanes(SceneTables& t, const PieceGeometry& geometry, PieceRecord& record) {
  record.lane_begin = size32(t.lanes);
  record.lane_count = padded_lanes(record.vertex_count);
  if (is_flat(record)) return;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t v = 0; v < record.lane_count; ++v) {
      const std::size_t from = v < record.vertex_count ? v : 0;
      t.lanes.push_back(geometry.vertices[from][k]);
    }
  }
}

/// Appends the arcs of the edges, or the sides of a facet, and fills what bounds the search: reach
/// and relaxations.
void add_bounds(SceneTables& t, const WidePiece& piece, PieceRecord& record,
                const std::function<void(double)>& progress) {
  const double epsilon_m = t.parameters[0].epsilon_m;
  Wide reach = 0;
  for (const Wide3& v : piece.vertices) reach = std::max(reach, norm(v));
  record.reach_m = rounded_up(reach);
  std::vector<WideArc> arcs;
  for (std::uint32_t e = 0; e < record.edge_count; ++e) {
    arcs.push_back(wide_arc(piece, e, epsilon_m));
  }
  record.flat_edges = size32(t.side_normals);
  if (is_flat(record)) {
    append(t.side_normals, arc_middles(arcs));
  } else {
    append(t.arcs, edge_arcs(piece, arcs, epsilon_m));
  }
  t.account.edges.push_back(edge_relaxation(piece, arcs, epsilon_m, record.radius_m));
  t.account.vertices.push_back(vertex_relaxation(piece, epsilon_m, progress));
  record.edge_relax_ratio = t.account.edges.back().ratio;
  record.vertex_relax_m = t.account.vertices.back().relax_m;
}

PieceRecord piece_record(const SceneTables& t, const PieceTopology& topology,
                         const PieceGeometry& geometry) {
  PieceRecord record{};
  record.body = size32(t.bodies);
  record.vertex_begin = size32(t.vertices);
  record.vertex_count = topology.vertex_count;
  record.face_begin = size32(t.faces);
  record.face_count = size32(topology.faces);
  record.edge_begin = size32(t.edges);
  record.edge_count = size32(topology.edges);
  record.loop_begin = size32(t.loop_vertices);
  record.loop_count = size32(topology.loop_vertices);
  record.volume_m3 = geometry.volume_m3;
  record.radius_m = geometry.radius_m;
  std::copy(geometry.centre_m.begin(), geometry.centre_m.end(), record.centre_m);
  return record;
}

/// Appends the cones of a facet's vertices, then of its edges in the topology's order.
void add_cones(SceneTables& t, const ConvexPiece& piece, const PieceTopology& topology,
               PieceRecord& record) {
  const std::vector<std::uint32_t>& loop = piece.faces[0].loop;
  if (piece.vertex_cones.size() != loop.size() || piece.side_cones.size() != loop.size()) {
    throw std::logic_error("a facet without the cones of its vertices and sides");
  }
  record.cone_begin = size32(t.cone_ranges);
  const auto add = [&](const SurfaceCone& cone) {
    t.cone_ranges.push_back({t.cone_base + cone.begin, cone.count});
  };
  for (const SurfaceCone& cone : piece.vertex_cones) add(cone);
  const std::uint16_t* const sides = topology.loop_edges.data() + topology.faces[0].loop_begin;
  std::vector<std::size_t> side_of(loop.size());
  for (std::size_t k = 0; k < loop.size(); ++k) side_of[sides[k]] = k;
  for (const std::size_t k : side_of) add(piece.side_cones[k]);
}

void add_piece(SceneTables& t, const ConvexPiece& piece, const PieceTopology& topology,
               const BodyGeometry& body, std::size_t index,
               const std::function<void(double)>& progress) {
  const PieceGeometry& geometry = body.pieces[index];
  PieceRecord record = piece_record(t, topology, geometry);
  const WidePiece wide(topology, body, index);
  add_lanes(t, geometry, record);
  add_bounds(t, wide, record, progress);
  for (FaceRecord face : topology.faces) {
    face.loop_begin += record.loop_begin;
    t.faces.push_back(face);
  }
  const std::uint32_t edge_base = size32(t.vertex_edges);
  for (std::uint32_t v = 1; v <= topology.vertex_count; ++v) {
    t.vertex_edge_begin.push_back(edge_base + topology.vertex_edge_begin[v]);
  }
  append(t.vertices, geometry.vertices);
  append(t.loop_vertices, topology.loop_vertices);
  append(t.loop_edges, topology.loop_edges);
  append(t.edges, topology.edges);
  append(t.edge_directions, geometry.edge_directions);
  append(t.vertex_edges, topology.vertex_edges);
  for (std::size_t v = 0; v < topology.vertex_count; ++v) {
    const std::int64_t source = piece.source_vertex.empty() ? -1 : piece.source_vertex[v];
    t.source_vertices.push_back(static_cast<std::int32_t>(source));
  }
  record.mark_begin = kNotMarked;
  record.cone_begin = kNoCones;
  if (piece.is_facet()) add_cones(t, piece, topology, record);
  t.pieces.push_back(record);
  t.topologies.push_back(topology);
}

}  // namespace

void BlobBuilder::add_bytes(SectionId id, std::uint32_t element_bytes, std::uint64_t count,
                            std::span<const std::byte> bytes) {
  sections_.push_back({id, element_bytes, count, {bytes.begin(), bytes.end()}});
}

std::vector<std::byte> BlobBuilder::finish(const SceneCapacity& capacity) const {
  std::vector<SectionEntry> table;
  std::size_t end = sizeof(SceneHeader) + sections_.size() * sizeof(SectionEntry);
  for (const Section& s : sections_) {
    const std::size_t offset = align_up(end);
    table.push_back({s.id, s.element_bytes, offset, s.count});
    end = offset + s.bytes.size();
  }
  std::vector<std::byte> blob(end, std::byte{0});
  SceneHeader header{};
  std::memcpy(header.magic, kSceneMagic, sizeof(kSceneMagic));
  header.version = kSceneVersion;
  header.header_bytes = sizeof(SceneHeader);
  header.byte_count = blob.size();
  header.scalar_bytes = sizeof(Real);
  header.section_count = static_cast<std::uint32_t>(sections_.size());
  header.section_table = sizeof(SceneHeader);
  header.capacity = capacity;
  std::memcpy(blob.data(), &header, sizeof(header));
  std::memcpy(blob.data() + sizeof(header), table.data(), table.size() * sizeof(SectionEntry));
  for (std::size_t i = 0; i < sections_.size(); ++i) {
    if (sections_[i].bytes.empty()) continue;
    std::memcpy(blob.data() + table[i].offset, sections_[i].bytes.data(),
                sections_[i].bytes.size());
  }
  header.content_hash = scene_content_hash(blob);
  std::memcpy(blob.data(), &header, sizeof(header));
  return blob;
}

std::uint32_t add_text(SceneTables& t, const std::string& words) {
  const std::uint32_t offset = size32(t.text);
  t.text.insert(t.text.end(), words.begin(), words.end());
  return offset;
}

void add_body(SceneTables& t, const PlacedBody& placed, const std::array<double, 3>* grip_m,
              const std::function<void(double)>& progress) {
  const Body& body = placed.body;
  if (body.pieces.empty()) throw InputError(body.name + ": no convex piece; the part is empty");
  if (t.pieces.size() + body.pieces.size() > kMostPieces) {
    throw InputError(body.name + ": more than " + std::to_string(kMostPieces) +
                     " convex pieces in the scene; use a coarser mesh");
  }
  std::vector<PieceTopology> topologies;
  for (std::size_t i = 0; i < body.pieces.size(); ++i) {
    topologies.push_back(build_topology(body, body.pieces[i], piece_place(body, i)));
  }
  const BodyGeometry geometry = grip_m != nullptr ? moving_geometry(placed, *grip_m, topologies)
                                                  : static_geometry(placed, topologies);
  BodyRecord record{};
  std::copy(geometry.reference_m.begin(), geometry.reference_m.end(), record.reference_m);
  record.piece_begin = size32(t.pieces);
  record.piece_count = size32(body.pieces);
  record.plane_begin = size32(t.planes);
  record.plane_count = size32(body.planes);
  record.name_bytes = static_cast<std::uint32_t>(body.name.size());
  record.name_offset = add_text(t, body.name);
  record.friction = placed.friction;
  record.friction_static = std::max(placed.friction, placed.friction_static);
  double sum = 0.0;
  for (std::size_t i = 0; i < body.pieces.size(); ++i) {
    check_geometry(geometry, i, topologies[i], piece_place(body, i));
    add_piece(t, body.pieces[i], topologies[i], geometry, i, progress);
    sum += geometry.pieces[i].volume_m3;
  }
  record.volume_m3 = body.volume_m3 > 0.0 ? body.volume_m3 : sum;
  if (!(std::abs(record.volume_m3 - sum) <= 1e-6 * sum)) {
    throw InputError(body.name + ": its volume is stated as " + std::to_string(record.volume_m3) +
                     " m3, its pieces sum to " + std::to_string(sum) +
                     " m3; the pieces do not make up the part");
  }
  append(t.planes, geometry.planes);
  append(t.cone_directions, geometry.directions);
  t.cone_base = size32(t.cone_directions);
  t.bodies.push_back(record);
}

void add_pair(SceneTables& t, std::uint32_t piece_a, std::uint32_t piece_b, bool stored,
              const std::vector<std::uint64_t>& marks) {
  const PieceView a = t.topologies[piece_a].view(), b = t.topologies[piece_b].view();
  const NodeNumbering numbers = numbering(a, b);
  const LargestFeatures largest_a = largest_features(a), largest_b = largest_features(b);
  PairRecord record{};
  record.piece_a = piece_a;
  record.piece_b = piece_b;
  record.node_begin = kGraphNotStored;
  record.node_count = static_cast<std::uint32_t>(numbers.count());
  record.node_count_a = numbers.count_a();
  record.node_count_b = numbers.count_b();
  record.max_degree = static_cast<std::uint32_t>(largest_degree(largest_a, largest_b));
  record.mark_begin = marks.empty() ? kNotMarked : size32(t.marks);
  const PieceRecord &of_a = t.pieces[piece_a], &of_b = t.pieces[piece_b];
  const NodeMarks view = marks.empty() ? NodeMarks{} : marks_at(marks.data(), record, of_a, of_b);
  const LiveCounts reachable = live_counts(view, NodeScope::kReachable, record, of_a, of_b);
  const LiveCounts live = live_counts(view, NodeScope::kLive, record, of_a, of_b);
  record.near_capacity =
      near_capacity(static_cast<std::uint32_t>(live.nodes), largest_a.face, largest_b.face);
  record.edge_pair_capacity = edge_pair_capacity(reachable.edge_pairs);
  append(t.marks, marks);
  if (stored) {
    record.node_begin = size32(t.nodes);
    const PairGraph graph = build_pair_graph(a, b);
    const std::uint32_t base = size32(t.neighbors);
    for (std::size_t i = 1; i < graph.neighbor_begin.size(); ++i) {
      t.neighbor_begin.push_back(base + graph.neighbor_begin[i]);
    }
    append(t.nodes, graph.nodes);
    append(t.neighbors, graph.neighbors);
  }
  t.pairs.push_back(record);
}

BlobBuilder sections_of(const SceneTables& t, bool wide) {
  BlobBuilder blob;
  blob.add(SectionId::kParameters, t.parameters);
  blob.add(SectionId::kBodies, t.bodies);
  blob.add(SectionId::kPlanes, t.planes);
  blob.add(SectionId::kPieces, t.pieces);
  blob.add(SectionId::kVertices, t.vertices);
  blob.add(SectionId::kFaces, t.faces);
  blob.add(SectionId::kLoopVertices, t.loop_vertices);
  blob.add(SectionId::kLoopEdges, t.loop_edges);
  blob.add(SectionId::kEdges, t.edges);
  blob.add(SectionId::kEdgeDirections, t.edge_directions);
  blob.add(SectionId::kVertexEdgeBegin, t.vertex_edge_begin);
  blob.add(SectionId::kVertexEdges, t.vertex_edges);
  blob.add(SectionId::kPairs, t.pairs);
  blob.add(SectionId::kNodes, t.nodes);
  blob.add(SectionId::kNeighborBegin, t.neighbor_begin);
  if (wide) {
    blob.add(SectionId::kNeighbors, t.neighbors);
  } else {
    std::vector<std::uint16_t> narrow;
    narrow.reserve(t.neighbors.size());
    for (const std::uint32_t n : t.neighbors) narrow.push_back(static_cast<std::uint16_t>(n));
    blob.add(SectionId::kNeighbors, narrow);
  }
  blob.add(SectionId::kSourceVertices, t.source_vertices);
  blob.add(SectionId::kText, t.text);
  blob.add(SectionId::kVertexLanes, t.lanes);
  blob.add(SectionId::kEdgeArcs, t.arcs);
  if (!t.marks.empty()) blob.add(SectionId::kNodeMarks, t.marks);
  if (!t.cone_ranges.empty()) {
    std::vector<ConeRange> ranges = t.cone_ranges;
    for (ConeRange& cone : ranges) cone.begin += size32(t.side_normals);
    std::vector<std::array<Real, 3>> directions = t.side_normals;
    append(directions, t.cone_directions);
    blob.add(SectionId::kConeRanges, ranges);
    blob.add(SectionId::kConeDirections, directions);
  }
  return blob;
}

}  // namespace haptic::tools
