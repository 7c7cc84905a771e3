// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/corner_split.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/face_view.hpp"
#include "tools/graph_compiler/simplify/plane_corner.hpp"

namespace haptic::tools {
namespace {

constexpr std::size_t kMostFaces = 8;
constexpr double kLeastDeterminant = 5.0e-3;  // of three normals: flatter corners are no corners

using Triangle = std::array<std::size_t, 3>;  // indices into the faces around a corner, ascending
using Triangles = std::vector<Triangle>;

/// All ways to cut the polygon first..last (and the side last-first) into triangles.
std::vector<Triangles> all_triangulations(std::size_t first, std::size_t last) {
  if (last - first < 2) return {{}};
  std::vector<Triangles> out;
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    for (const Triangles& left : all_triangulations(first, apex)) {
      for (const Triangles& right : all_triangulations(apex, last)) {
        Triangles all{{first, apex, last}};
        all.insert(all.end(), left.begin(), left.end());
        all.insert(all.end(), right.begin(), right.end());
        out.push_back(std::move(all));
      }
    }
  }
  return out;
}

/// One corner: its faces counter-clockwise seen from outside; edge k lies between face k - 1 (right
/// of it, seen away from the corner) and face k.
struct Fan {
  std::vector<std::uint32_t> faces, edges;
};

class CornerSplitter {
 public:
  CornerSplitter(Surface& surface, const PlaneFit& fit, MergedSurface& merged, double max_move_m)
      : s_(surface),
        fit_(fit),
        merged_(merged),
        max_move_(max_move_m),
        edges_of_(s_.vertices.size()) {
    for (std::uint32_t e = 0; e < merged.edges.size(); ++e) {
      edges_of_[merged.edges[e].u].push_back(e);
      edges_of_[merged.edges[e].v].push_back(e);
    }
  }

  std::vector<std::uint32_t> run(double tolerance_m) {
    const auto vertices = static_cast<std::uint32_t>(s_.vertices.size());
    for (std::uint32_t v = 0; v < vertices; ++v) {
      if (edges_of_[v].size() < 4 || edges_of_[v].size() > kMostFaces) continue;
      if (miss(v) > tolerance_m) split(v);
    }
    return std::move(parents_);
  }

 private:
  [[nodiscard]] HessePlane plane_of(std::uint32_t face) const {
    const FittedPlane& p = fit_.planes[merged_.faces[face].plane];
    const int sign = merged_.faces[face].sign;
    return {vec::scaled(p.normal, sign), sign * p.offset_m};
  }
  [[nodiscard]] double miss(std::uint32_t v) const;
  [[nodiscard]] std::optional<Fan> fan_of(std::uint32_t v) const;
  [[nodiscard]] std::uint32_t far_end(std::uint32_t edge, std::uint32_t v) const {
    return merged_.edges[edge].u == v ? merged_.edges[edge].v : merged_.edges[edge].u;
  }
  [[nodiscard]] bool place(const Fan& fan, const Triangles& ways, const Point3& from,
                           std::vector<Point3>& corners, double& move) const;
  [[nodiscard]] bool borders_free(const Fan& fan, const Triangles& ways, std::uint32_t v,
                                  const std::vector<Point3>& corners) const;
  void split(std::uint32_t v);
  [[nodiscard]] static MergedEdge diagonal(const Fan& fan, std::size_t a, std::size_t b,
                                           std::uint32_t first, std::uint32_t second,
                                           const Triangle& at_second);
  void rebuild(std::uint32_t v, const Fan& fan, const Triangles& ways,
               const std::vector<Point3>& corners);

  Surface& s_;
  const PlaneFit& fit_;
  MergedSurface& merged_;
  double max_move_;
  std::vector<std::vector<std::uint32_t>> edges_of_;
  std::vector<std::uint32_t> parents_;
};

double CornerSplitter::miss(std::uint32_t v) const {
  double largest = 0.0;
  for (const std::uint32_t p : merged_.vertex_planes[v]) {
    const FittedPlane& plane = fit_.planes[p];
    largest = std::max(largest, std::abs(vec::dot(plane.normal, s_.vertices[v]) - plane.offset_m));
  }
  return largest;
}

std::optional<Fan> CornerSplitter::fan_of(std::uint32_t v) const {
  std::map<std::uint32_t, std::uint32_t> by_right;
  const auto left_of = [&](std::uint32_t e) {
    return merged_.edges[e].u == v ? merged_.edges[e].left : merged_.edges[e].right;
  };
  for (const std::uint32_t e : edges_of_[v]) {
    const MergedEdge& edge = merged_.edges[e];
    if (edge.u == edge.v) return std::nullopt;
    if (!by_right.emplace(edge.u == v ? edge.right : edge.left, e).second) return std::nullopt;
  }
  Fan fan;
  std::uint32_t e = edges_of_[v][0];
  do {
    fan.edges.push_back(e);
    fan.faces.push_back(left_of(e));
    const auto next = by_right.find(left_of(e));
    if (next == by_right.end()) return std::nullopt;
    e = next->second;
  } while (e != fan.edges[0] && fan.edges.size() < edges_of_[v].size());
  if (e != fan.edges[0] || fan.edges.size() != edges_of_[v].size()) return std::nullopt;
  return fan;
}

bool CornerSplitter::place(const Fan& fan, const Triangles& ways, const Point3& from,
                           std::vector<Point3>& corners, double& move) const {
  corners.clear();
  move = 0.0;
  for (const Triangle& t : ways) {
    const std::vector<HessePlane> planes{plane_of(fan.faces[t[0]]), plane_of(fan.faces[t[1]]),
                                         plane_of(fan.faces[t[2]])};
    const double det = vec::dot(planes[0].normal, vec::cross(planes[1].normal, planes[2].normal));
    if (std::abs(det) < kLeastDeterminant) return false;
    corners.push_back(nearest_corner(planes, from).point);
    move = std::max(move, vec::distance(corners.back(), from));
    if (move > max_move_) return false;
  }
  return true;
}

/// The border of each face runs from the far end of its first edge over its corners to the far end
/// of its second one, without crossing itself.
bool CornerSplitter::borders_free(const Fan& fan, const Triangles& ways, std::uint32_t v,
                                  const std::vector<Point3>& corners) const {
  const std::size_t n = fan.faces.size();
  for (std::size_t i = 0; i < n; ++i) {
    // Triangles at face i, by their side neighbours: from face i - 1 round to face i + 1.
    std::vector<std::pair<std::size_t, std::size_t>> order;
    for (std::size_t t = 0; t < ways.size(); ++t) {
      std::size_t farthest = 0;
      bool has = false;
      for (const std::size_t f : ways[t]) {
        has = has || f == i;
        if (f != i) farthest = std::max(farthest, (f + n - i) % n);
      }
      if (has) order.emplace_back(farthest, t);
    }
    // Away from face i + 1 (distance 1) lies the triangle with the largest distance: at face i - 1.
    std::sort(order.rbegin(), order.rend());
    const HessePlane plane = plane_of(fan.faces[i]);
    const FaceView view(plane.normal);
    std::vector<ViewPoint> path{view.of(s_.vertices[far_end(fan.edges[i], v)])};
    for (const auto& [distance, t] : order) path.push_back(view.of(corners[t]));
    path.push_back(view.of(s_.vertices[far_end(fan.edges[(i + 1) % n], v)]));
    for (std::size_t a = 0; a + 1 < path.size(); ++a) {
      for (std::size_t b = a + 2; b + 1 < path.size(); ++b) {
        if (segments_cross(path[a], path[a + 1], path[b], path[b + 1])) return false;
      }
    }
    // An edge that would turn over.
    const Point3& first = s_.vertices[far_end(fan.edges[i], v)];
    const Point3& corner = corners[order.front().second];
    if (!(vec::dot(vec::sub(first, corner), vec::sub(first, s_.vertices[v])) > 0.0)) return false;
  }
  return true;
}

void CornerSplitter::split(std::uint32_t v) {
  const std::optional<Fan> fan = fan_of(v);
  if (!fan) return;
  const Triangles* best = nullptr;
  double best_move = 0.0;
  std::vector<Point3> corners, best_corners;
  const std::vector<Triangles> all = all_triangulations(0, fan->faces.size() - 1);
  for (const Triangles& ways : all) {
    double move = 0.0;
    if (!place(*fan, ways, s_.vertices[v], corners, move)) continue;
    if (best != nullptr && move >= best_move) continue;
    if (!borders_free(*fan, ways, v, corners)) continue;
    best = &ways;
    best_move = move;
    best_corners = corners;
  }
  if (best != nullptr) rebuild(v, *fan, *best, best_corners);
}

/// The edge between faces a < b. Seen from outside, the corner of the faces from a up to b lies to
/// its one side and that of the others to the other: away from the corner whose third face is
/// outside [a, b], face b is on the left.
MergedEdge CornerSplitter::diagonal(const Fan& fan, std::size_t a, std::size_t b,
                                    std::uint32_t first, std::uint32_t second,
                                    const Triangle& at_second) {
  std::size_t third = at_second[0];
  for (const std::size_t f : at_second) {
    if (f != a && f != b) third = f;
  }
  const bool second_inside = a < third && third < b;
  const std::uint32_t outside = second_inside ? first : second;
  const std::uint32_t inside = second_inside ? second : first;
  return {outside, inside, fan.faces[b], fan.faces[a]};
}

void CornerSplitter::rebuild(std::uint32_t v, const Fan& fan, const Triangles& ways,
                             const std::vector<Point3>& corners) {
  const std::size_t n = fan.faces.size();
  // Ends of the old edges at v, before any of them is given another vertex.
  std::vector<bool> starts_here;
  for (const std::uint32_t e : fan.edges) starts_here.push_back(merged_.edges[e].u == v);
  std::map<std::pair<std::size_t, std::size_t>, std::uint32_t> diagonals;
  for (std::size_t t = 0; t < ways.size(); ++t) {
    std::uint32_t vertex = v;  // the first corner keeps the vertex
    if (t > 0) {
      vertex = static_cast<std::uint32_t>(s_.vertices.size());
      s_.vertices.push_back({});
      s_.source_vertex.push_back(s_.source_vertex[v]);
      merged_.vertex_planes.emplace_back();
      edges_of_.emplace_back();
      parents_.push_back(v);
    }
    s_.vertices[vertex] = corners[t];
    std::vector<std::uint32_t>& own = merged_.vertex_planes[vertex];
    own.clear();
    for (const std::size_t f : ways[t]) own.push_back(merged_.faces[fan.faces[f]].plane);
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = std::min(ways[t][k], ways[t][(k + 1) % 3]);
      const std::size_t b = std::max(ways[t][k], ways[t][(k + 1) % 3]);
      if (b - a == 1 || b - a == n - 1) {
        const std::size_t side = b - a == 1 ? b : a;
        MergedEdge& edge = merged_.edges[fan.edges[side]];
        (starts_here[side] ? edge.u : edge.v) = vertex;
        edges_of_[vertex].push_back(fan.edges[side]);
        continue;
      }
      const auto [other, fresh] = diagonals.emplace(std::make_pair(a, b), vertex);
      if (fresh) continue;
      merged_.edges.push_back(diagonal(fan, a, b, other->second, vertex, ways[t]));
    }
  }
}

}  // namespace

std::vector<std::uint32_t> split_corners(Surface& surface, const PlaneFit& fit,
                                         MergedSurface& merged, double tolerance_m,
                                         double max_move_m) {
  return CornerSplitter(surface, fit, merged, max_move_m).run(tolerance_m);
}

}  // namespace haptic::tools
