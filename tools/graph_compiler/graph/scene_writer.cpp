// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/scene_writer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/graph_rule.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/blob_builder.hpp"
#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/graph/pair_graph.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"

namespace haptic::tools {
namespace {

/// Beyond this many neighbor entries (2 to 4 GiB) a scene is refused before its graph is built.
constexpr std::uint64_t kMaxNeighborEntries = std::uint64_t{1} << 30;
constexpr std::size_t kMaxPieces = 65535;

/// The sections as they grow, body by body and pair by pair.
struct SceneTables {
  std::vector<SceneParameters> parameters;
  std::vector<BodyRecord> bodies;
  std::vector<PlaneRecord> planes;
  std::vector<PieceRecord> pieces;
  std::vector<std::array<Real, 3>> vertices;
  std::vector<FaceRecord> faces;
  std::vector<std::uint16_t> loop_vertices, loop_edges;
  std::vector<EdgeRecord> edges;
  std::vector<EdgeDirection> edge_directions;
  std::vector<std::uint32_t> vertex_edge_begin{0};
  std::vector<std::uint16_t> vertex_edges;
  std::vector<PairRecord> pairs;
  std::vector<NodeRecord> nodes;
  std::vector<std::uint32_t> neighbor_begin{0};
  std::vector<std::uint32_t> neighbors;
  std::vector<std::int32_t> source_vertices;
  std::vector<char> text;
  std::vector<Real> lanes;
  std::vector<EdgeArc> arcs;
  std::vector<PieceTopology> topologies;  ///< of all pieces; not a section
};

template <typename T>
std::uint32_t size32(const std::vector<T>& v) {
  return static_cast<std::uint32_t>(v.size());
}

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

std::string piece_place(const Body& body, std::size_t piece) {
  return body.name + ": piece " + std::to_string(piece);
}

/// Offset of `words` in the text section, which grows by them.
std::uint32_t add_text(SceneTables& t, const std::string& words) {
  const std::uint32_t offset = size32(t.text);
  t.text.insert(t.text.end(), words.begin(), words.end());
  return offset;
}

void add_piece(SceneTables& t, const ConvexPiece& piece, const PieceTopology& topology,
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
  record.lane_begin = size32(t.lanes);
  record.lane_count = (record.vertex_count + kLanePadding - 1) / kLanePadding * kLanePadding;
  double reach2 = 0;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t v = 0; v < record.lane_count; ++v)
      t.lanes.push_back(geometry.vertices[v < record.vertex_count ? v : 0][k]);
  for (const auto& v : geometry.vertices)
    reach2 = std::max(reach2, double(v[0]) * v[0] + double(v[1]) * v[1] + double(v[2]) * v[2]);
  record.reach_m = std::sqrt(reach2) * (1 + 1e-6);
  const double eps = t.parameters[0].epsilon_m;
  record.vertex_relax_m = 17 * eps;
  record.edge_relax_ratio = 1;
  typedef long double W;
  struct V3 {
    W x, y, z;
  };
  auto sub = [](V3 a, V3 b) { return V3{a.x - b.x, a.y - b.y, a.z - b.z}; };
  auto dot = [](V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  auto crs = [](V3 a, V3 b) {
    return V3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  auto scl = [](V3 a, W s) { return V3{a.x * s, a.y * s, a.z * s}; };
  auto add = [](V3 a, V3 b) { return V3{a.x + b.x, a.y + b.y, a.z + b.z}; };
  auto vtx = [&](std::size_t v) {
    const auto& q = geometry.vertices[v];
    return V3{q[0], q[1], q[2]};
  };
  for (const EdgeRecord& e : topology.edges) {
    V3 d = sub(vtx(e.vertex[1]), vtx(e.vertex[0]));
    d = scl(d, 1 / std::sqrt(dot(d, d)));
    V3 n[2], in[2];
    W w[2], ext[2];
    for (int k = 0; k < 2; ++k) {
      V3 a = sub(vtx(e.apex[k]), vtx(e.vertex[0]));
      a = sub(a, scl(d, dot(a, d)));
      w[k] = std::sqrt(dot(a, a));
      in[k] = scl(a, 1 / w[k]);
      n[k] = k == 0 ? crs(in[k], scl(d, -1)) : crs(in[k], d);  // n = in x (-d): d = n x ...
      n[k] = k == 0 ? crs(d, scl(in[k], 1)) : crs(scl(in[k], 1), d);
      ext[k] = w[k] > eps ? std::asin(eps / w[k]) : 1.5707963267948966L;
    }
    // face[0] lies left of d: in = n x d, so n = d x in; face[1]: in = d x n, n = in x d
    W c = std::min<W>(1, std::max<W>(-1, dot(n[0], n[1])));
    W turn = std::acos(c);
    V3 m0 = add(n[0], n[1]);
    m0 = scl(m0, 1 / std::sqrt(dot(m0, m0)));
    V3 s0 = sub(n[1], scl(m0, dot(n[1], m0)));
    W sl = std::sqrt(dot(s0, s0));
    s0 = sl > 0 ? scl(s0, 1 / sl) : crs(d, m0);
    W lo = -turn / 2 - ext[0], hi = turn / 2 + ext[1];
    W middle = (lo + hi) / 2,
      phi = std::min<W>((hi - lo) / 2 + (sizeof(Real) == 8 ? 4e-15L : 2e-6L),
                        3.14159265358979323846L);
    V3 mid = add(scl(m0, std::cos(middle)), scl(s0, std::sin(middle)));
    V3 side = add(scl(s0, std::cos(middle)), scl(m0, -std::sin(middle)));
    EdgeArc arc{};
    arc.mid[0] = Real(mid.x);
    arc.mid[1] = Real(mid.y);
    arc.mid[2] = Real(mid.z);
    arc.side[0] = Real(side.x);
    arc.side[1] = Real(side.y);
    arc.side[2] = Real(side.z);
    arc.cosine = Real(std::cos(phi));
    arc.sine = Real(std::sin(phi));
    for (int k = 0; k < 2; ++k) {
      arc.tilt[k][0] = Real(n[k].x * w[k]);
      arc.tilt[k][1] = Real(n[k].y * w[k]);
      arc.tilt[k][2] = Real(n[k].z * w[k]);
    }
    t.arcs.push_back(arc);
    for (int k = 0; k < 2; ++k) {
      W a = (k == 0 ? lo : hi);
      V3 nn = add(scl(m0, std::cos(a)), scl(s0, std::sin(a)));
      W g = 0;
      for (std::size_t v = 0; v < record.vertex_count; ++v)
        g = std::max(g, dot(nn, sub(vtx(v), vtx(e.vertex[0]))));
      record.edge_relax_ratio = std::max(record.edge_relax_ratio, double(g / eps) * (1 + 1e-9));
    }
  }
  t.pieces.push_back(record);
  t.topologies.push_back(topology);
}

/// @param grip_m  null for a static body.
void add_body(SceneTables& t, const PlacedBody& placed, const std::array<double, 3>* grip_m) {
  const Body& body = placed.body;
  if (body.pieces.empty()) throw InputError(body.name + ": no convex piece; the part is empty");
  if (t.pieces.size() + body.pieces.size() > kMaxPieces) {
    throw InputError(body.name + ": more than " + std::to_string(kMaxPieces) +
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
  double sum = 0.0;
  for (std::size_t i = 0; i < body.pieces.size(); ++i) {
    check_geometry(geometry, i, topologies[i], piece_place(body, i));
    add_piece(t, body.pieces[i], topologies[i], geometry.pieces[i]);
    sum += geometry.pieces[i].volume_m3;
  }
  record.volume_m3 = body.volume_m3 > 0.0 ? body.volume_m3 : sum;
  if (!(std::abs(record.volume_m3 - sum) <= 1e-6 * sum)) {
    throw InputError(body.name + ": its volume is stated as " + std::to_string(record.volume_m3) +
                     " m3, its pieces sum to " + std::to_string(sum) +
                     " m3; the pieces do not make up the part");
  }
  append(t.planes, geometry.planes);
  t.bodies.push_back(record);
}

std::uint32_t largest_face(const PieceTopology& t) {
  std::uint32_t largest = 0;
  for (const FaceRecord& face : t.faces) largest = std::max(largest, face.loop_count);
  return largest;
}

void add_pair_graph(SceneTables& t, std::uint32_t piece_a, std::uint32_t piece_b) {
  const PieceTopology& a = t.topologies[piece_a];
  const PieceTopology& b = t.topologies[piece_b];
  const PairGraph graph = build_pair_graph(a.view(), b.view());
  PairRecord record{};
  record.piece_a = piece_a;
  record.piece_b = piece_b;
  record.node_begin = size32(t.nodes);
  record.node_count = size32(graph.nodes);
  record.node_count_a = graph.node_count_a;
  record.node_count_b = graph.node_count_b;
  record.max_degree = graph.max_degree;
  record.near_capacity = near_capacity(record.node_count, largest_face(a), largest_face(b));
  record.edge_pair_capacity = edge_pair_capacity(size32(a.edges), size32(b.edges));
  const std::uint32_t base = size32(t.neighbors);
  for (std::size_t i = 1; i < graph.neighbor_begin.size(); ++i) {
    t.neighbor_begin.push_back(base + graph.neighbor_begin[i]);
  }
  append(t.nodes, graph.nodes);
  append(t.neighbors, graph.neighbors);
  t.pairs.push_back(record);
}

/// Pairs in the order that SceneView expects: pieces of A first, the pieces of all statics within.
/// Returns true when a pair is too large for 16-bit neighbors.
bool add_pairs(SceneTables& t) {
  const std::uint32_t moving = t.bodies[0].piece_count;
  std::uint64_t entries = 0;
  bool wide = false;
  for (std::uint32_t a = 0; a < moving; ++a) {
    for (std::uint32_t b = moving; b < t.pieces.size(); ++b) {
      const GraphSize size = graph_size(t.topologies[a].view(), t.topologies[b].view());
      entries += size.neighbor_entries;
      wide = wide || size.nodes > std::numeric_limits<std::uint16_t>::max();
    }
  }
  if (entries > kMaxNeighborEntries) {
    throw InputError("the contact graph of the scene needs " + std::to_string(entries) +
                     " neighbor entries, the limit is " + std::to_string(kMaxNeighborEntries) +
                     "; use coarser meshes");
  }
  t.neighbors.reserve(entries);
  for (std::uint32_t a = 0; a < moving; ++a) {
    for (std::uint32_t b = moving; b < t.pieces.size(); ++b) add_pair_graph(t, a, b);
  }
  return wide;
}

SceneParameters finished_parameters(const SceneDescription& description,
                                    std::uint32_t name_offset) {
  SceneParameters p = description.parameters;
  if (p.epsilon_o_m == 0) p.epsilon_o_m = p.epsilon_m;
  if (p.exact_band_m == 0) p.exact_band_m = 0.005;
  const auto q = unit_quaternion(description.moving.quaternion_wxyz, "start pose");
  for (std::size_t k = 0; k < 3; ++k) {
    p.start_p_wa_m[k] = description.moving.position_m[k];
    p.start_q_wa_xyzw[k] = static_cast<double>(q[k + 1]);
  }
  p.start_q_wa_xyzw[3] = static_cast<double>(q[0]);
  p.name_offset = name_offset;
  p.name_bytes = static_cast<std::uint32_t>(description.name.size());
  return p;
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
  return blob;
}

SceneCapacity capacity_of(const SceneTables& t) {
  return scene_capacity(
      t.bodies, t.pieces, t.pairs,
      std::max<std::uint32_t>(1, std::min<std::uint32_t>(kDefaultPairVisits, size32(t.pairs))));
}

}  // namespace

std::vector<std::byte> write_scene(const SceneDescription& description) {
  if (description.statics.empty()) {
    throw InputError("scene '" + description.name +
                     "' has no static part; add at least one [[static]]");
  }
  SceneTables t;
  const std::uint32_t name_offset = add_text(t, description.name);
  t.parameters.push_back(finished_parameters(description, name_offset));
  add_body(t, description.moving, &description.grip_m);
  for (const PlacedBody& body : description.statics) add_body(t, body, nullptr);
  const bool wide = add_pairs(t);
  const BlobBuilder builder = sections_of(t, wide);
  SceneCapacity capacity = capacity_of(t);
  // The state's size depends on the opened scene, so the blob is opened once without it.
  const SceneBytes provisional{builder.finish(capacity)};
  SceneView view;
  const RtStatus status = SceneView::open(provisional.span(), view);
  if (status != RtStatus::kOk) {
    throw InputError("scene '" + description.name + "' is refused: " + to_text(status));
  }
  capacity.state_bytes = HapticCore::state_bytes(view);
  return builder.finish(capacity);
}

}  // namespace haptic::tools
