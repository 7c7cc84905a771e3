// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/corner_graph.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

constexpr double kParallelSine = 0.02;  // below: a wish would only tilt two almost equal planes

}  // namespace

void add_wishes(const Surface& s, double scale, CornerPlaneGraph& graph) {
  const double tol = s.plane_tolerance_m * scale;
  for (std::uint32_t c = 0; c < graph.corners.size(); ++c) {
    const std::vector<std::uint32_t>& own = graph.corner_planes[c];
    for (std::uint32_t p = 0; p < graph.planes.size(); ++p) {
      const WantedPlane& plane = graph.planes[p];
      const double distance = std::abs(vec::dot(plane.normal, graph.corners[c]) - plane.offset);
      if (distance > tol || std::binary_search(own.begin(), own.end(), p)) continue;
      const bool parallel = std::any_of(own.begin(), own.end(), [&](std::uint32_t q) {
        return vec::norm(vec::cross(plane.normal, graph.planes[q].normal)) < kParallelSine;
      });
      if (!parallel) graph.wishes.push_back({c, p, distance});
    }
  }
}

CornerGraph build_graph(const Surface& s, const PlaneFit& fit, const MergedSurface& merged,
                        double scale) {
  CornerGraph out;
  out.vertex_corner.assign(s.vertices.size(), kNone);
  std::map<Point3, std::uint32_t> at_position;
  std::vector<bool> kept(s.vertices.size(), false);
  for (const MergedEdge& e : merged.edges) kept[e.u] = kept[e.v] = true;
  for (std::uint32_t v = 0; v < s.vertices.size(); ++v) {
    if (!kept[v]) continue;
    Point3 x = vec::scaled(s.vertices[v], scale);
    for (double& c : x) c += 0.0;  // -0 and +0 are one position
    const auto [it, fresh] =
        at_position.emplace(x, static_cast<std::uint32_t>(out.corner_vertex.size()));
    if (fresh) {
      out.corner_vertex.push_back(v);
      out.graph.corners.push_back(x);
      out.graph.corner_planes.emplace_back();
    }
    out.vertex_corner[v] = it->second;
    std::vector<std::uint32_t>& own = out.graph.corner_planes[it->second];
    own.insert(own.end(), merged.vertex_planes[v].begin(), merged.vertex_planes[v].end());
  }
  for (std::vector<std::uint32_t>& own : out.graph.corner_planes) {
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
  }
  for (const FittedPlane& p : fit.planes) {
    out.graph.planes.push_back(
        {p.normal, p.normal_tail, p.offset_m * scale, p.offset_tail_m * scale, p.axis});
  }
  return out;
}

}  // namespace haptic::tools
