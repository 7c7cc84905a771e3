// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/placed_pair.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

constexpr Wide kExactlyParallelSine =
    1e-15L;  // far above the rounding of Wide, far below any exact integer rotation

/// Largest height by which the edges fail as a contact with normal `n`.
Wide edge_violation(const PlacedPair& p, const OracleEdge& ea, const OracleEdge& eb,
                    const WideVec& n) {
  Wide violation = -std::numeric_limits<Wide>::infinity();
  const WideVec &a0 = p.va[ea.vertex[0]], &b0 = p.b.vertices[eb.vertex[0]];
  for (int k = 0; k < 2; ++k) {
    for (const std::uint32_t v : p.b.loops[eb.face[k]]) {
      if (v == eb.vertex[0] || v == eb.vertex[1]) continue;
      violation = std::max(violation, dot(n, p.b.vertices[v] - b0));
    }
    for (const std::uint32_t v : p.a.loops[ea.face[k]]) {
      if (v == ea.vertex[0] || v == ea.vertex[1]) continue;
      violation = std::max(violation, -dot(n, p.va[v] - a0));
    }
  }
  return violation;
}

}  // namespace

PlacedPair::PlacedPair(const OraclePiece& piece_a, const OraclePiece& piece_b,
                       const OraclePose& pose)
    : a(piece_a), b(piece_b) {
  va.reserve(a.vertices.size());
  na.reserve(a.normals.size());
  for (const WideVec& v : a.vertices) va.push_back(pose.x + pose.r * v);
  for (const WideVec& n : a.normals) na.push_back(pose.r * n);
}

Wide PlacedPair::gap_along(const WideVec& n, const WideVec& origin) const {
  Wide low_a = std::numeric_limits<Wide>::infinity();
  for (const WideVec& v : va) low_a = std::min(low_a, dot(n, v - origin));
  Wide high_b = -std::numeric_limits<Wide>::infinity();
  for (const WideVec& v : b.vertices) high_b = std::max(high_b, dot(n, v - origin));
  return low_a - high_b;
}

Wide PlacedPair::gap_of_face_a(std::size_t face) const {
  return gap_along(-1.0L * na[face], va[a.loops[face].front()]);
}

Wide PlacedPair::gap_of_face_b(std::size_t face) const {
  return gap_along(b.normals[face], b.vertices[b.loops[face].front()]);
}

NodeValue node_of_type_a(const PlacedPair& p, std::uint32_t face, std::uint32_t vertex) {
  NodeValue node;
  node.node = static_cast<std::uint32_t>(face * p.b.vertices.size() + vertex);
  node.normal = -1.0L * p.na[face];
  const WideVec& b = p.b.vertices[vertex];
  node.depth_m = dot(node.normal, p.va[p.a.loops[face].front()] - b);
  node.violation_m = -std::numeric_limits<Wide>::infinity();
  for (const std::uint32_t other : p.b.vertex_neighbors[vertex]) {
    node.violation_m = std::max(node.violation_m, dot(node.normal, p.b.vertices[other] - b));
  }
  return node;
}

NodeValue node_of_type_b(const PlacedPair& p, std::uint32_t vertex, std::uint32_t face) {
  NodeValue node;
  node.node = static_cast<std::uint32_t>(p.a.loops.size() * p.b.vertices.size() +
                                         vertex * p.b.loops.size() + face);
  node.normal = p.b.normals[face];
  const WideVec& a = p.va[vertex];
  node.depth_m = dot(node.normal, a - p.b.vertices[p.b.loops[face].front()]);
  node.violation_m = -std::numeric_limits<Wide>::infinity();
  for (const std::uint32_t other : p.a.vertex_neighbors[vertex]) {
    node.violation_m = std::max(node.violation_m, -dot(node.normal, p.va[other] - a));
  }
  return node;
}

bool node_of_type_c(const PlacedPair& p, std::uint32_t e, std::uint32_t g, NodeValue& node) {
  const OracleEdge &ea = p.a.edges[e], &eb = p.b.edges[g];
  const WideVec u = p.va[ea.vertex[1]] - p.va[ea.vertex[0]];
  const WideVec v = p.b.vertices[eb.vertex[1]] - p.b.vertices[eb.vertex[0]];
  const WideVec m = cross(u, v);
  const Wide sine = norm(m) / (norm(u) * norm(v));
  if (sine < kExactlyParallelSine) return false;
  WideVec n = unit(m);
  const Wide plus = edge_violation(p, ea, eb, n), minus = edge_violation(p, ea, eb, -1.0L * n);
  if (minus < plus) n = -1.0L * n;
  node.node =
      static_cast<std::uint32_t>(p.a.loops.size() * p.b.vertices.size() +
                                 p.a.vertices.size() * p.b.loops.size() + e * p.b.edges.size() + g);
  node.normal = n;
  node.depth_m = dot(n, p.va[ea.vertex[0]] - p.b.vertices[eb.vertex[0]]);
  node.violation_m = std::min(plus, minus);
  node.sine = sine;
  return true;
}

}  // namespace haptic::sim
