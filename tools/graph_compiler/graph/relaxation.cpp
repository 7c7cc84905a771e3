// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/relaxation.hpp"

#include <algorithm>
#include <array>

namespace haptic::tools {
namespace {

/// Rounding of all that is computed in long double, and of the reader's doubles, many times over.
constexpr Wide kUpwards = 1 + 1.0e-9L;
/// Beyond this degree cones and pairs are not tried: their number grows with its cube.
constexpr std::size_t kTriedDegree = 96;
constexpr Wide kSlack = 1.0e-12L;

/// Rows of the inverse of the matrix with columns a, b, c; false when they span no volume.
bool invert(const Wide3& a, const Wide3& b, const Wide3& c, Wide3 (&row)[3]) {
  const Wide3 bc = cross(b, c);
  const Wide volume = dot(a, bc);
  if (!(std::abs(volume) > 0)) return false;
  row[0] = (1 / volume) * bc;
  row[1] = (1 / volume) * cross(c, a);
  row[2] = (1 / volume) * cross(a, b);
  for (const Wide3& r : row) {
    if (!std::isfinite(r[0]) || !std::isfinite(r[1]) || !std::isfinite(r[2])) return false;
  }
  return true;
}

}  // namespace

EdgeRelaxation edge_relaxation(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m, double radius_m) {
  const Wide epsilon = static_cast<Wide>(epsilon_m);
  EdgeRelaxation result;
  Wide largest = 0;
  for (std::uint32_t e = 0; e < arcs.size(); ++e) {
    const EdgeRecord& edge = piece.topology->edges[e];
    const Wide3& origin = piece.vertices[edge.vertex[0]];
    for (int k = 0; k < 2; ++k) {
      const Wide3 n = arcs[e].end(k);
      Wide height = 0;
      for (const Wide3& v : piece.vertices) height = std::max(height, dot(n, v - origin));
      Wide ratio = height / std::min(epsilon, arcs[e].width_m[k]);
      if (arcs[e].width_m[k] <= epsilon) {
        ratio = std::max(ratio, 2 * static_cast<Wide>(radius_m) / epsilon);
      }
      if (!(ratio > largest)) continue;
      largest = ratio;
      result.edge = e;
      result.face = edge.face[k];
      result.width_m = static_cast<double>(arcs[e].width_m[k]);
    }
  }
  result.ratio = rounded_up(std::max<Wide>(1, largest) * kUpwards);
  return result;
}

VertexCone::VertexCone(const WidePiece& piece, std::uint32_t vertex) {
  const PieceTopology& topology = *piece.topology;
  const Wide3& b = piece.vertices[vertex];
  for (std::uint32_t i = topology.vertex_edge_begin[vertex];
       i < topology.vertex_edge_begin[vertex + 1]; ++i) {
    const EdgeRecord& edge = topology.edges[topology.vertex_edges[i]];
    edges_.push_back(piece.vertices[edge.vertex[0] == vertex ? edge.vertex[1] : edge.vertex[0]] -
                     b);
  }
  for (std::uint32_t v = 0; v < piece.vertices.size(); ++v) {
    if (v != vertex) others_.push_back(piece.vertices[v] - b);
  }
  add_cones();
  for (const Wide3& d : others_) {
    Line line{0, norm(d), norm(d)};
    Wide best = std::numeric_limits<Wide>::infinity();
    for (const Cone& cone : cones_) {
      // Outside its cone a negative weight is dropped; what then is left of d is added.
      Wide sum = 0, negative = 0;
      Wide3 rest = d;
      for (int i = 0; i < 3; ++i) {
        const Wide lambda = dot(cone.row[i], d);
        negative = std::min(negative, lambda);
        if (lambda <= 0) continue;
        sum += lambda;
        rest = rest - lambda * edges_[cone.k[i]];
      }
      if (negative < -kSlack) continue;
      const Wide left = norm(rest);
      if (sum + left / depth_m_ >= best) continue;
      best = sum + left / depth_m_;
      line = {sum, left, line.distance_m};
    }
    lines_.push_back(line);
  }
}

void VertexCone::add_cones() {
  depth_m_ = std::numeric_limits<Wide>::infinity();
  const std::size_t degree = edges_.size();
  if (degree > kTriedDegree) {
    depth_m_ = 0;
    return;
  }
  for (std::uint32_t i = 0; i < degree; ++i) {
    for (std::uint32_t j = i + 1; j < degree; ++j) {
      for (std::uint32_t k = j + 1; k < degree; ++k) {
        Cone cone{{i, j, k}, {}};
        if (!invert(edges_[i], edges_[j], edges_[k], cone.row)) continue;
        const Wide3 n = cone.row[0] + cone.row[1] + cone.row[2];  // n . edge = 1 for all three
        const bool lower = std::all_of(edges_.begin(), edges_.end(), [&](const Wide3& edge) {
          return dot(n, edge) <= 1 + kSlack;
        });
        if (!lower) continue;
        cones_.push_back(cone);
        depth_m_ = std::min(depth_m_, 1 / norm(n));
      }
    }
  }
  if (cones_.empty()) depth_m_ = 0;
}

std::vector<VertexCone::Corner> VertexCone::corners_at(Wide t_m) const {
  std::vector<Corner> corners;
  if (edges_.size() > kTriedDegree) return corners;
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    for (std::size_t l = k + 1; l < edges_.size(); ++l) {
      // n = p + q with p in the span of the two edges, q across it.
      const Wide3 &a = edges_[k], &b = edges_[l];
      const Wide aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), det = aa * bb - ab * ab;
      if (!(det > 0)) continue;
      const Wide3 p = (t_m / det) * ((bb - ab) * a + (aa - ab) * b);
      const Wide across = 1 - dot(p, p);
      if (!(across > 0)) continue;
      const Wide3 q = std::sqrt(across) * unit(cross(a, b));
      for (const Wide3& n : {p + q, p - q}) {
        const bool allowed = std::all_of(edges_.begin(), edges_.end(), [&](const Wide3& edge) {
          return dot(n, edge) <= t_m + kSlack * norm(edge);
        });
        Corner corner{};
        if (allowed && invert(a, b, n, corner.row)) corners.push_back(corner);
      }
    }
  }
  return corners;
}

/// Best bound with one positive weight: the unit normal in the plane of d and the edge over which
/// the edge rises by t.
Wide VertexCone::one_neighbor(const Wide3& d, Wide t_m) const {
  Wide best = norm(d);
  for (const Wide3& edge : edges_) {
    const Wide length = norm(edge);
    const Wide sine = t_m / length;
    if (!(sine < 1)) continue;
    const Wide along = dot(d, edge) / length;
    const Wide across = std::sqrt(std::max<Wide>(0, dot(d, d) - along * along));
    const Wide cosine = std::sqrt((1 - sine) * (1 + sine));
    const Wide lambda = (along - sine * across / cosine) / length;
    if (lambda > 0) best = std::min(best, t_m * lambda + norm(d - lambda * edge));
  }
  return best;
}

Wide VertexCone::largest_rise(Wide t_m, bool refined) const {
  const bool curved = refined && t_m > depth_m_;
  const std::vector<Corner> corners = curved ? corners_at(t_m) : std::vector<Corner>{};
  Wide largest = 0;
  for (std::size_t v = 0; v < others_.size(); ++v) {
    const Line& line = lines_[v];
    Wide bound = std::min(line.distance_m, line.slope * t_m + line.rest_m);
    if (bound <= largest || !curved) {
      largest = std::max(largest, bound);
      continue;
    }
    const Wide3& d = others_[v];
    for (const Corner& corner : corners) {
      const Wide k = dot(corner.row[0], d), l = dot(corner.row[1], d), mu = dot(corner.row[2], d);
      if (k >= 0 && l >= 0) bound = std::min(bound, t_m * (k + l) + std::abs(mu));
    }
    if (bound > largest) bound = std::min(bound, one_neighbor(d, t_m));
    largest = std::max(largest, bound);
  }
  return largest;
}

VertexRelaxation vertex_relaxation(const WidePiece& piece, double epsilon_m,
                                   const std::function<void(double)>& progress) {
  const Wide epsilon = static_cast<Wide>(epsilon_m);
  const auto count = static_cast<std::uint32_t>(piece.vertices.size());
  const auto excess = [&](const VertexCone& cone, bool refined, Wide floor) {
    Wide largest = 0;
    for (int i = kRiseSteps; i-- > 0;) {
      const Wide from = epsilon * i / kRiseSteps, to = epsilon * (i + 1) / kRiseSteps;
      // The unrefined bound first: often it is small enough.
      Wide rise = cone.largest_rise(to, false) - from;
      if (refined && rise > std::max(largest, floor)) rise = cone.largest_rise(to, true) - from;
      largest = std::max(largest, rise);
    }
    return largest;
  };
  VertexRelaxation result;
  Wide largest = 0;
  for (std::uint32_t v = 0; v < count; ++v) {
    if (progress && v % 64 == 0) progress(static_cast<double>(v) / count);
    const VertexCone cone(piece, v);
    const bool refined = count <= kRefinedVertices && epsilon > cone.depth_m();
    const Wide beyond = excess(cone, refined, largest);
    if (v > 0 && !(beyond > largest)) continue;
    largest = std::max(largest, beyond);
    result.vertex = v;
    result.depth_m = static_cast<double>(cone.depth_m());
  }
  result.relax_m = rounded_up((epsilon + largest) * kUpwards);
  return result;
}

}  // namespace haptic::tools
