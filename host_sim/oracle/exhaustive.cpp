// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/exhaustive.hpp"

#include <algorithm>
#include <limits>

namespace haptic::sim {
namespace {

constexpr Wide kExactlyParallelSine =
    1e-15L;  // far above the rounding of Wide, far below any exact integer rotation

NodeValue type_a(const PlacedPair& p, std::uint32_t face, std::uint32_t vertex) {
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

NodeValue type_b(const PlacedPair& p, std::uint32_t vertex, std::uint32_t face) {
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

bool type_c(const PlacedPair& p, std::uint32_t e, std::uint32_t g, NodeValue& node) {
  const OracleEdge &ea = p.a.edges[e], &eb = p.b.edges[g];
  const WideVec u = p.va[ea.vertex[1]] - p.va[ea.vertex[0]];
  const WideVec v = p.b.vertices[eb.vertex[1]] - p.b.vertices[eb.vertex[0]];
  const WideVec m = cross(u, v);
  if (norm(m) < kExactlyParallelSine * norm(u) * norm(v)) return false;
  WideVec n = unit(m);
  const Wide plus = edge_violation(p, ea, eb, n), minus = edge_violation(p, ea, eb, -1.0L * n);
  if (minus < plus) n = -1.0L * n;
  node.node =
      static_cast<std::uint32_t>(p.a.loops.size() * p.b.vertices.size() +
                                 p.a.vertices.size() * p.b.loops.size() + e * p.b.edges.size() + g);
  node.normal = n;
  node.depth_m = dot(n, p.va[ea.vertex[0]] - p.b.vertices[eb.vertex[0]]);
  node.violation_m = std::min(plus, minus);
  return true;
}

/// Signs of the four heights of an edge pair over the plane spanned by its edges.
/// @return false when no orientation of `m` makes it applicable within `slack` (in units of |m|
/// times metres); `n_sign`: the orientation, `worst`: its largest height times |m|.
bool orient(const PlacedPair& p, const OracleEdge& ea, const OracleEdge& eb, const WideVec& m,
            Wide slack, Wide& n_sign, Wide& worst) {
  const WideVec& b0 = p.b.vertices[eb.vertex[0]];
  const Wide hb0 = dot(m, p.b.vertices[eb.apex[0]] - b0),
             hb1 = dot(m, p.b.vertices[eb.apex[1]] - b0);
  if ((hb0 > slack && hb1 < -slack) || (hb0 < -slack && hb1 > slack)) return false;
  const WideVec& a0 = p.va[ea.vertex[0]];
  const Wide ha0 = -dot(m, p.va[ea.apex[0]] - a0), ha1 = -dot(m, p.va[ea.apex[1]] - a0);
  const Wide plus = std::max({hb0, hb1, ha0, ha1}), minus = std::max({-hb0, -hb1, -ha0, -ha1});
  n_sign = minus < plus ? -1.0L : 1.0L;
  worst = std::min(plus, minus);
  return worst <= slack;
}

}  // namespace

std::vector<NodeValue> all_nodes(const OraclePiece& a, const OraclePiece& b,
                                 const OraclePose& pose) {
  const PlacedPair placed(a, b, pose);
  const auto count = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  std::vector<NodeValue> nodes;
  for (std::uint32_t f = 0; f < count(a.loops); ++f) {
    for (std::uint32_t v = 0; v < count(b.vertices); ++v) nodes.push_back(type_a(placed, f, v));
  }
  for (std::uint32_t v = 0; v < count(a.vertices); ++v) {
    for (std::uint32_t f = 0; f < count(b.loops); ++f) nodes.push_back(type_b(placed, v, f));
  }
  for (std::uint32_t e = 0; e < count(a.edges); ++e) {
    for (std::uint32_t g = 0; g < count(b.edges); ++g) {
      NodeValue node;
      if (type_c(placed, e, g, node)) nodes.push_back(node);
    }
  }
  return nodes;
}

Wide largest_ratio(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
                   const std::vector<NodeValue>& nodes, Wide violation_tolerance_m) {
  WideVec mean_a, mean_b;
  for (const WideVec& v : a.vertices) mean_a = mean_a + v;
  for (const WideVec& v : b.vertices) mean_b = mean_b + v;
  // x - c with c = mean(B) - R mean(A); f = n.x - h(n), hence h(n) - n.c = n.(x - c) - f.
  const WideVec x_c = (pose.x - (1.0L / static_cast<Wide>(b.vertices.size())) * mean_b) +
                      pose.r * ((1.0L / static_cast<Wide>(a.vertices.size())) * mean_a);
  Wide largest = -std::numeric_limits<Wide>::infinity();
  for (const NodeValue& node : nodes) {
    if (node.violation_m > violation_tolerance_m) continue;
    const Wide along = dot(node.normal, x_c);
    largest = std::max(largest, along / (along - node.depth_m));
  }
  return largest;
}

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

Precision precision_of_real() {
  if constexpr (sizeof(Real) == sizeof(double)) return {0x1p-52L, 1.5e-8L, 1e-12L, 1e-12L};
  return {0x1p-23L, 2.4e-4L, 1e-5L, 1e-5L};
}

PairSearch::PairSearch(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
                       Wide size_m, const Precision& precision)
    : placed_(a, b, pose), size_m_(size_m), precision_(precision) {
  constexpr Wide kNone = -std::numeric_limits<Wide>::infinity();
  truth_ = {kNone, kNone, kNone};
}

// Type A and B: a face snapped to the support vertex of the other body is always applicable, with
// value s(n).
void PairSearch::add_face_a(std::uint32_t f) {
  const WideVec n = -1.0L * placed_.na[f];
  add_face(n, placed_.gap_along(n, placed_.va[placed_.a.loops[f].front()]));
}

void PairSearch::add_face_b(std::uint32_t f) {
  const WideVec& n = placed_.b.normals[f];
  add_face(n, placed_.gap_along(n, placed_.b.vertices[placed_.b.loops[f].front()]));
}

void PairSearch::add_face(const WideVec& n, Wide value) {
  truth_.reference_m = std::max(truth_.reference_m, value);
  truth_.upper_m = std::max(truth_.upper_m, value);
  truth_.lower_m = std::max(truth_.lower_m, value);
  last_ = {value, n};
}

bool PairSearch::add_edge_pair(std::uint32_t e, std::uint32_t g) {
  const OracleEdge &ea = placed_.a.edges[e], &eb = placed_.b.edges[g];
  const WideVec& b0 = placed_.b.vertices[eb.vertex[0]];
  const WideVec u = placed_.va[ea.vertex[1]] - placed_.va[ea.vertex[0]];
  const WideVec v = placed_.b.vertices[eb.vertex[1]] - b0;
  const WideVec m = cross(u, v);
  // Rounding of the tested arithmetic moves heights over m by at most about this (lengths and
  // heights <= size).
  const Wide slack = 8 * precision_.unit_roundoff * size_m_ * norm(u) * norm(v);
  Wide n_sign = 1, worst = 0;
  if (!orient(placed_, ea, eb, m, slack, n_sign, worst)) return false;
  const Wide m_norm = norm(m);
  const Wide sine = m_norm / (norm(u) * norm(v));
  if (sine < precision_.parallel_sine) return false;
  const WideVec n = (n_sign / m_norm) * m;
  const Wide value = placed_.gap_along(n, b0);
  const WideVec w = placed_.va[ea.vertex[0]] - b0;
  const Wide turn = 4 * precision_.unit_roundoff / sine * norm(w);
  truth_.reference_m = std::max(truth_.reference_m, value);
  truth_.upper_m = std::max(truth_.upper_m, value + turn);
  if (worst < -slack && sine > precision_.optional_sine * 1.001L)
    truth_.lower_m = std::max(truth_.lower_m, value - turn);
  last_ = {value, n};
  return true;
}

PairTruth PairSearch::truth() const {
  PairTruth truth = truth_;
  if (truth.reference_m <= 0) truth.lower_m = truth.upper_m = truth.reference_m;
  return truth;
}

PairTruth search_pair(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
                      Wide size_m, const Precision& precision) {
  const auto count = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  PairSearch search(a, b, pose, size_m, precision);
  for (std::uint32_t f = 0; f < count(a.loops); ++f) search.add_face_a(f);
  for (std::uint32_t f = 0; f < count(b.loops); ++f) search.add_face_b(f);
  for (std::uint32_t e = 0; e < count(a.edges); ++e) {
    for (std::uint32_t g = 0; g < count(b.edges); ++g)
      static_cast<void>(search.add_edge_pair(e, g));
  }
  return search.truth();
}

}  // namespace haptic::sim
