// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/relaxation.hpp"

#include <algorithm>
#include <limits>

namespace haptic::tools {
namespace {

/// Rounding of all that is computed in long double, and of the reader's doubles, many times over.
constexpr Wide kUpwards = 1 + 1.0e-9L;
/// A direction that rises over an edge by this share of its length too much still counts: rounding
/// must not lose one.
constexpr Wide kSlack = 1.0e-12L;

}  // namespace

EdgeRelaxation edge_relaxation(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m, double radius_m) {
  const Wide epsilon = static_cast<Wide>(epsilon_m);
  EdgeRelaxation result;
  Wide largest = 0, narrowest = 0;
  for (std::uint32_t e = 0; e < arcs.size(); ++e) {
    const EdgeRecord& edge = piece.topology->edges[e];
    const Wide3& origin = piece.vertices[edge.vertex[0]];
    for (int k = 0; k < 2; ++k) {
      const Wide3 n = arcs[e].end(k);
      Wide height = arcs[e].full ? 2 * static_cast<Wide>(radius_m) : 0;
      if (!arcs[e].full) {
        for (const Wide3& v : piece.vertices) height = std::max(height, dot(n, v - origin));
      }
      const Wide ratio = height / epsilon;
      const bool narrower = ratio == largest && arcs[e].width_m[k] < narrowest;
      if (!(ratio > largest || narrower)) continue;
      narrowest = arcs[e].width_m[k];

      largest = ratio;
      result.edge = e;
      result.face = edge.face[k];
      result.width_m = static_cast<double>(arcs[e].width_m[k]);
    }
  }
  result.ratio = rounded_up(std::max<Wide>(1, largest) * kUpwards);
  return result;
}

VertexRise::VertexRise(const WidePiece& piece, std::uint32_t vertex) {
  const PieceTopology& topology = *piece.topology;
  const Wide3& b = piece.vertices[vertex];
  const std::uint32_t begin = topology.vertex_edge_begin[vertex];
  const std::size_t degree = topology.vertex_edge_begin[vertex + 1] - begin;
  all_held_ = degree <= kHeldNeighbors;
  const std::size_t held = std::min(degree, kHeldNeighbors);
  for (std::size_t i = 0; i < held; ++i) {
    const EdgeRecord& edge = topology.edges[topology.vertex_edges[begin + i * degree / held]];
    const std::uint16_t neighbor = edge.vertex[edge.vertex[0] == vertex ? 1 : 0];
    edges_.push_back(piece.vertices[neighbor] - b);
    lengths_.push_back(norm(edges_.back()));
  }
  for (std::uint32_t v = 0; v < piece.vertices.size(); ++v) {
    if (v != vertex) others_.push_back(piece.vertices[v] - b);
  }
}

bool VertexRise::allowed(const Wide3& n, Wide t_m) const {
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    if (dot(n, edges_[k]) > t_m + kSlack * lengths_[k]) return false;
  }
  return true;
}

Wide VertexRise::largest(Wide t_m) const {
  Wide largest = 0;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    for (std::size_t l = k + 1; l < edges_.size(); ++l) {
      // n = p + q with p in the span of the two edges, q across it.
      const Wide3 &a = edges_[k], &b = edges_[l];
      const Wide aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), det = aa * bb - ab * ab;
      if (!(det > 0)) continue;
      const Wide3 p = (t_m / det) * ((bb - ab) * a + (aa - ab) * b);
      const Wide square = 1 - dot(p, p);
      if (square < -kSlack) continue;
      const Wide3 q = std::sqrt(std::max<Wide>(0, square)) * unit(cross(a, b));
      for (const Wide3& n : {p + q, p - q}) {
        if (!allowed(n, t_m)) continue;
        for (const Wide3& d : others_) largest = std::max(largest, dot(n, d));
      }
    }
  }
  for (const Wide3& d : others_) {
    const Wide length = norm(d);
    if (length <= largest) continue;
    if (allowed((1 / length) * d, t_m)) {
      largest = length;
      continue;
    }
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      const Wide sine = t_m / lengths_[k];
      if (sine > 1) continue;
      const Wide3 e = (1 / lengths_[k]) * edges_[k];
      const Wide along = dot(d, e);
      const Wide3 rest = d - along * e;
      const Wide across = norm(rest);
      const Wide cosine = std::sqrt((1 - sine) * (1 + sine));
      const Wide value = sine * along + cosine * across;
      if (value <= largest || !(across > 0)) continue;
      if (allowed(sine * e + (cosine / across) * rest, t_m)) largest = value;
    }
  }
  return largest;
}

Wide VertexRise::depth_m() const {
  Wide depth = std::numeric_limits<Wide>::infinity();
  if (!all_held_) return depth;
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    for (std::size_t j = i + 1; j < edges_.size(); ++j) {
      for (std::size_t k = j + 1; k < edges_.size(); ++k) {
        // m . edge = 1 for all three.
        const Wide3 jk = cross(edges_[j], edges_[k]);
        const Wide volume = dot(edges_[i], jk);
        if (volume == 0) continue;
        const Wide3 sum = jk + cross(edges_[k], edges_[i]) + cross(edges_[i], edges_[j]);
        const Wide3 m = (1 / volume) * sum;
        const bool lowest = std::all_of(edges_.begin(), edges_.end(), [&](const Wide3& edge) {
          return dot(m, edge) <= 1 + kSlack;
        });
        if (lowest) depth = std::min(depth, 1 / norm(m));
      }
    }
  }
  return depth;
}

VertexRelaxation vertex_relaxation(const WidePiece& piece, double epsilon_m,
                                   const std::function<void(double)>& progress) {
  const Wide epsilon = static_cast<Wide>(epsilon_m);
  const auto count = static_cast<std::uint32_t>(piece.vertices.size());
  const int steps = count <= kFineVertices ? kRiseSteps : 1;
  VertexRelaxation result;
  Wide largest = 0;
  for (std::uint32_t v = 0; v < count; ++v) {
    if (progress && v % 64 == 0) progress(static_cast<double>(v) / count);
    const VertexRise rise(piece, v);
    Wide above = std::numeric_limits<Wide>::infinity();  // g at the end of the step after this one
    for (int i = steps; i-- > 0;) {
      const Wide from = epsilon * i / steps;
      if (above - from <= largest) continue;  // g rises: this step cannot matter
      above = rise.largest(epsilon * (i + 1) / steps);
      if (above - from <= largest) continue;
      largest = above - from;
      result.vertex = v;
    }
  }
  result.depth_m = static_cast<double>(VertexRise(piece, result.vertex).depth_m());
  result.relax_m = rounded_up((epsilon + largest) * kUpwards);
  return result;
}

}  // namespace haptic::tools
