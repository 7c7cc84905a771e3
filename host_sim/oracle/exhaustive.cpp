// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/exhaustive.hpp"

#include <algorithm>
#include <limits>

namespace haptic::sim {
namespace {

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
    for (std::uint32_t v = 0; v < count(b.vertices); ++v)
      nodes.push_back(node_of_type_a(placed, f, v));
  }
  for (std::uint32_t v = 0; v < count(a.vertices); ++v) {
    for (std::uint32_t f = 0; f < count(b.loops); ++f)
      nodes.push_back(node_of_type_b(placed, v, f));
  }
  for (std::uint32_t e = 0; e < count(a.edges); ++e) {
    for (std::uint32_t g = 0; g < count(b.edges); ++g) {
      NodeValue node;
      if (node_of_type_c(placed, e, g, node)) nodes.push_back(node);
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

Precision precision_of_real() {
  if constexpr (sizeof(Real) == sizeof(double)) return {0x1p-52L, 1.5e-8L, 1e-12L, 1e-12L};
  // The search takes heights for rounding up to 64 roundings of the sum of two radii, at most twice
  // the size: in single precision motions meet that band. Two unit directions, each off by a few
  // roundings, turn the normal of their cross product by as many over the sine.
  return {0x1p-23L, 2.4e-4L, 1e-5L, 1e-5L, 128, 4};
}

void count_edge_pair(const PlacedPair& placed, std::uint32_t edge_a, std::uint32_t edge_b,
                     Wide size_m, const Precision& precision, PairTruth& truth) {
  const OracleEdge &ea = placed.a.edges[edge_a], &eb = placed.b.edges[edge_b];
  const WideVec u = placed.va[ea.vertex[1]] - placed.va[ea.vertex[0]];
  const WideVec& b0 = placed.b.vertices[eb.vertex[0]];
  const WideVec v = placed.b.vertices[eb.vertex[1]] - b0;
  const WideVec m = cross(u, v);
  // Rounding of the tested arithmetic moves heights over m by at most about this (lengths and
  // heights <= size).
  const Wide rounding = precision.unit_roundoff * size_m * norm(u) * norm(v);
  const Wide slack = 8 * rounding;
  Wide n_sign = 1, worst = 0;
  if (!orient(placed, ea, eb, m, precision.height_roundings * rounding, n_sign, worst)) return;
  const Wide m_norm = norm(m);
  const Wide sine = m_norm / (norm(u) * norm(v));
  // The tested arithmetic knows the sine to a few roundings: at the limit it may see a node or
  // none.
  const Wide doubt = 8 * precision.unit_roundoff;
  if (sine < precision.parallel_sine - doubt) return;
  const WideVec n = (n_sign / m_norm) * m;
  const Wide value = placed.gap_along(n, b0);
  const WideVec w = placed.va[ea.vertex[0]] - b0;
  const Wide turn = 4 * precision.unit_roundoff / sine * norm(w);
  if (sine >= precision.parallel_sine && worst <= slack) {
    truth.reference_m = std::max(truth.reference_m, value);
  }
  truth.upper_m = std::max(truth.upper_m, value + turn);
  if (worst < -slack && sine > precision.optional_sine * 1.001L)
    truth.lower_m = std::max(truth.lower_m, value - turn);
}

PairTruth search_pair(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
                      Wide size_m, const Precision& precision) {
  const PlacedPair placed(a, b, pose);
  Wide faces = -std::numeric_limits<Wide>::infinity();
  // Type A and B: a face snapped to the support vertex of the other body is always applicable, with
  // value s(n).
  for (std::size_t f = 0; f < a.loops.size(); ++f) faces = std::max(faces, placed.gap_of_face_a(f));
  for (std::size_t f = 0; f < b.loops.size(); ++f) faces = std::max(faces, placed.gap_of_face_b(f));
  PairTruth truth{faces, faces, faces};
  for (std::uint32_t e = 0; e < a.edges.size(); ++e) {
    for (std::uint32_t g = 0; g < b.edges.size(); ++g)
      count_edge_pair(placed, e, g, size_m, precision, truth);
  }
  if (truth.reference_m <= 0) truth.lower_m = truth.upper_m = truth.reference_m;
  return truth;
}

}  // namespace haptic::sim
