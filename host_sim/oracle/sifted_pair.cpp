// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/sifted_pair.hpp"

#include <algorithm>
#include <limits>

namespace haptic::sim {
namespace {

/// Margin of the sieve in sizes: thousands of roundings of a double.
constexpr double kSieve = 1e-12;
/// Rounding of a type C value in double for edges at right angles, in levers.
constexpr double kEdgeSieve = 1e-14;

double height(const Columns& n, std::size_t k, const Columns& points, std::size_t i) {
  return n.x[k] * points.x[i] + n.y[k] * points.y[i] + n.z[k] * points.z[i];
}

/// Unit directions of the edges, and direction x (apex - first end) for both faces: the height of
/// an apex over the plane of this edge and a direction w is then w . rise, times the sine.
void fill_edges(const std::vector<OracleEdge>& edges, const std::vector<WideVec>& vertices,
                Columns& direction, Columns (&rise)[2]) {
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const OracleEdge& edge = edges[e];
    const WideVec& origin = vertices[edge.vertex[0]];
    const WideVec u = unit(vertices[edge.vertex[1]] - origin);
    direction.set(e, u);
    for (int k = 0; k < 2; ++k) rise[k].set(e, cross(u, vertices[edge.apex[k]] - origin));
  }
}

}  // namespace

SiftedPair::SiftedPair(const OraclePiece& a, const OraclePiece& b, Wide size_m)
    : a_(a),
      b_(b),
      size_m_(size_m),
      va_(a.vertices.size()),
      na_(a.normals.size()),
      vb_(b.vertices.size()),
      nb_(b.normals.size()),
      direction_a_(a.edges.size()),
      rise_a_{Columns(a.edges.size()), Columns(a.edges.size())},
      direction_b_(b.edges.size()),
      rise_b_{Columns(b.edges.size()), Columns(b.edges.size())},
      low_(b.edges.size()),
      high_(b.edges.size()) {
  for (std::size_t v = 0; v < vb_.size(); ++v) vb_.set(v, b.vertices[v]);
  for (std::size_t f = 0; f < nb_.size(); ++f) nb_.set(f, b.normals[f]);
  fill_edges(b.edges, b.vertices, direction_b_, rise_b_);
}

void SiftedPair::place(const PlacedPair& placed) {
  for (std::size_t v = 0; v < va_.size(); ++v) va_.set(v, placed.va[v]);
  for (std::size_t f = 0; f < na_.size(); ++f) na_.set(f, placed.na[f]);
  fill_edges(a_.edges, placed.va, direction_a_, rise_a_);
  pairs_.clear();
}

void SiftedPair::sift_edges(std::uint32_t e, double height_m) {
  const double ux = direction_a_.x[e], uy = direction_a_.y[e], uz = direction_a_.z[e];
  const double p0x = rise_a_[0].x[e], p0y = rise_a_[0].y[e], p0z = rise_a_[0].z[e];
  const double p1x = rise_a_[1].x[e], p1y = rise_a_[1].y[e], p1z = rise_a_[1].z[e];
  const Columns &v = direction_b_, &q0 = rise_b_[0], &q1 = rise_b_[1];
  const std::size_t count = v.size();
  for (std::size_t g = 0; g < count; ++g) {
    // With m = u x v: m . (apex_b - b0) = u . (v x (apex_b - b0)) and -m . (apex_a - a0) =
    // v . (u x (apex_a - a0)), so four products give the four heights.
    const double b0 = ux * q0.x[g] + uy * q0.y[g] + uz * q0.z[g];
    const double b1 = ux * q1.x[g] + uy * q1.y[g] + uz * q1.z[g];
    const double a0 = v.x[g] * p0x + v.y[g] * p0y + v.z[g] * p0z;
    const double a1 = v.x[g] * p1x + v.y[g] * p1y + v.z[g] * p1z;
    const double high_b = b0 > b1 ? b0 : b1, low_b = b0 > b1 ? b1 : b0;
    const double high_a = a0 > a1 ? a0 : a1, low_a = a0 > a1 ? a1 : a0;
    high_[g] = high_b > high_a ? high_b : high_a;
    low_[g] = low_b < low_a ? low_b : low_a;
  }
  for (std::size_t g = 0; g < count; ++g) {
    const bool plus = high_[g] <= height_m, minus = -low_[g] <= height_m;
    if (plus || minus) pairs_.push_back({e, static_cast<std::uint32_t>(g), plus, minus});
  }
}

SiftedPair::CrossedEdges SiftedPair::cross_edges(const EdgePair& pair) const {
  const Columns &u = direction_a_, &v = direction_b_;
  const std::uint32_t e = pair.a, g = pair.b;
  const std::uint32_t i = a_.edges[e].vertex[0], j = b_.edges[g].vertex[0];
  const double wx = va_.x[i] - vb_.x[j], wy = va_.y[i] - vb_.y[j], wz = va_.z[i] - vb_.z[j];
  const double mx = u.y[e] * v.z[g] - u.z[e] * v.y[g];
  const double my = u.z[e] * v.x[g] - u.x[e] * v.z[g];
  const double mz = u.x[e] * v.y[g] - u.y[e] * v.x[g];
  CrossedEdges crossed;
  crossed.sine = std::sqrt(mx * mx + my * my + mz * mz);
  const double lever = std::sqrt(wx * wx + wy * wy + wz * wz) + static_cast<double>(size_m_);
  crossed.blur_m = kEdgeSieve * lever / crossed.sine;
  crossed.f_m = (mx * wx + my * wy + mz * wz) / crossed.sine;
  return crossed;
}

double SiftedPair::highest_value(const EdgePair& pair, double margin_m) const {
  const CrossedEdges crossed = cross_edges(pair);
  const double top = pair.plus && pair.minus ? std::abs(crossed.f_m)
                     : pair.plus             ? crossed.f_m
                                             : -crossed.f_m;
  const double value = top + crossed.blur_m + margin_m;
  return value == value ? value : std::numeric_limits<double>::infinity();  // sine 0
}

PairTruth SiftedPair::search(const OraclePose& pose, const Precision& precision) {
  const PlacedPair placed(a_, b_, pose);
  place(placed);
  const double margin = kSieve * static_cast<double>(size_m_);
  // Faces: the gap in double, then in long double for those within the margin of the largest.
  std::vector<double> gaps;
  for (std::size_t f = 0; f < na_.size(); ++f) {
    double high = -std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < vb_.size(); ++v) high = std::max(high, -height(na_, f, vb_, v));
    gaps.push_back(-height(na_, f, va_, a_.loops[f].front()) - high);
  }
  for (std::size_t f = 0; f < nb_.size(); ++f) {
    double low = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < va_.size(); ++v) low = std::min(low, height(nb_, f, va_, v));
    gaps.push_back(low - height(nb_, f, vb_, b_.loops[f].front()));
  }
  const double largest = *std::max_element(gaps.begin(), gaps.end());
  Wide faces = -std::numeric_limits<Wide>::infinity();
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    if (gaps[k] < largest - margin) continue;
    faces = std::max(
        faces, k < na_.size() ? placed.gap_of_face_a(k) : placed.gap_of_face_b(k - na_.size()));
  }
  PairTruth truth{faces, faces, faces};
  for (std::uint32_t e = 0; e < a_.edges.size(); ++e) sift_edges(e, margin);
  for (const EdgePair& pair : pairs_) {
    if (highest_value(pair, margin) < static_cast<double>(faces)) continue;  // raises nothing
    count_edge_pair(placed, pair.a, pair.b, size_m_, precision, truth);
  }
  if (truth.reference_m <= 0) truth.lower_m = truth.upper_m = truth.reference_m;
  return truth;
}

std::vector<NodeValue> SiftedPair::near_candidates(const OraclePose& pose, Wide d_m, Wide epsilon_m,
                                                   Wide margin_m, Wide least_sine) {
  const PlacedPair placed(a_, b_, pose);
  place(placed);
  const double d = static_cast<double>(d_m);
  const double reach = static_cast<double>(epsilon_m + margin_m + widen(kSieve) * size_m_);
  std::vector<NodeValue> nodes;
  for (std::uint32_t f = 0; f < na_.size(); ++f) {
    const double offset = -height(na_, f, va_, a_.loops[f].front());
    for (std::uint32_t v = 0; v < vb_.size(); ++v) {
      if (std::abs(offset + height(na_, f, vb_, v) - d) < reach)
        nodes.push_back(node_of_type_a(placed, f, v));
    }
  }
  for (std::uint32_t v = 0; v < va_.size(); ++v) {
    for (std::uint32_t f = 0; f < nb_.size(); ++f) {
      const double offset = height(nb_, f, vb_, b_.loops[f].front());
      if (std::abs(height(nb_, f, va_, v) - offset - d) < reach)
        nodes.push_back(node_of_type_b(placed, v, f));
    }
  }
  for (std::uint32_t e = 0; e < a_.edges.size(); ++e) sift_edges(e, reach);
  for (const EdgePair& pair : pairs_) {
    const CrossedEdges crossed = cross_edges(pair);
    if (crossed.sine < 0.5 * static_cast<double>(least_sine)) continue;
    const double blur = reach + crossed.blur_m;
    const bool outward = pair.plus && std::abs(crossed.f_m - d) < blur;
    const bool inward = pair.minus && std::abs(crossed.f_m + d) < blur;
    if (!outward && !inward) continue;
    NodeValue node;
    if (node_of_type_c(placed, pair.a, pair.b, node) && node.sine >= least_sine)
      nodes.push_back(node);
  }
  return nodes;
}

}  // namespace haptic::sim
