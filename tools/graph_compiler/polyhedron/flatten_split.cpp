// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/flatten_split.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

// Least sine at a corner of a quad whose diagonals both lie well inside.
constexpr double kConvexSine = 1e-3;

bool strictly_convex(const Surface& s, const Point3& outward,
                     const std::vector<std::uint32_t>& loop) {
  const std::size_t n = loop.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Point3 a = vec::sub(s.vertices[loop[(k + 1) % n]], s.vertices[loop[k]]);
    const Point3 b = vec::sub(s.vertices[loop[(k + 2) % n]], s.vertices[loop[(k + 1) % n]]);
    if (!(vec::dot(vec::cross(a, b), outward) > kConvexSine * vec::norm(a) * vec::norm(b)))
      return false;
  }
  return true;
}

void note_bits(Realisation& real, std::size_t plane) {
  for (const Rational& q : real.normals[plane])
    real.largest_bits = std::max(real.largest_bits, bit_size(q));
  real.largest_bits = std::max(real.largest_bits, bit_size(real.offsets[plane]));
}

}  // namespace

std::vector<LooseFace> find_loose_faces(const Surface& surface, const PlaneFit& fit,
                                        const MergedSurface& merged,
                                        const std::vector<std::uint32_t>& vertex_corner,
                                        const CornerPlaneGraph& graph, bool crowded_only) {
  std::vector<std::size_t> faces_on_plane(fit.planes.size(), 0);
  for (const MergedFace& face : merged.faces) ++faces_on_plane[face.plane];
  std::vector<std::map<std::uint32_t, std::uint32_t>> next(merged.faces.size());
  std::vector<std::size_t> edge_count(merged.faces.size(), 0);
  for (const MergedEdge& e : merged.edges) {
    next[e.left][e.u] = e.v;
    next[e.right][e.v] = e.u;
    ++edge_count[e.left];
    ++edge_count[e.right];
  }
  std::vector<LooseFace> out;
  for (std::uint32_t f = 0; f < merged.faces.size(); ++f) {
    const MergedFace& face = merged.faces[f];
    const std::size_t n = edge_count[f];
    if (n < 3 || n > 4 || next[f].size() != n || faces_on_plane[face.plane] != 1) continue;
    LooseFace loose;
    loose.face = f;
    bool crowded = false;
    auto at = next[f].begin();
    for (std::size_t k = 0; k < n && at != next[f].end(); ++k) {
      loose.loop.push_back(at->first);
      loose.corners.push_back(vertex_corner[at->first]);
      crowded = crowded || graph.corner_planes[loose.corners.back()].size() > 3;
      at = next[f].find(at->second);
    }
    if (loose.loop.size() != n || at != next[f].begin() || (crowded_only && !crowded)) continue;
    const Point3 outward = vec::scaled(fit.planes[face.plane].normal, face.sign);
    if (strictly_convex(surface, outward, loose.loop)) out.push_back(std::move(loose));
  }
  return out;
}

CornerPlaneGraph without_faces(const CornerPlaneGraph& graph, const MergedSurface& merged,
                               const std::vector<LooseFace>& loose) {
  CornerPlaneGraph out = graph;
  out.wishes.clear();
  std::vector<bool> gone(graph.planes.size(), false);
  for (const LooseFace& face : loose) gone[merged.faces[face.face].plane] = true;
  for (std::vector<std::uint32_t>& own : out.corner_planes) {
    own.erase(std::remove_if(own.begin(), own.end(), [&](std::uint32_t p) { return gone[p]; }),
              own.end());
  }
  return out;
}

std::size_t close_faces(const std::vector<LooseFace>& loose, PlaneFit& fit, MergedSurface& merged,
                        Realisation& real, bool& ok) {
  ok = true;
  std::size_t split = 0;
  std::vector<std::vector<std::uint32_t>> face_edges(merged.faces.size());
  for (std::uint32_t e = 0; e < merged.edges.size(); ++e) {
    face_edges[merged.edges[e].left].push_back(e);
    face_edges[merged.edges[e].right].push_back(e);
  }
  for (const LooseFace& face : loose) {
    const auto x = [&](std::size_t k) -> const Rational3& { return real.corners[face.corners[k]]; };
    Rational fourth(0);
    if (face.loop.size() == 4) {
      fourth = dot(cross(subtract(x(1), x(0)), subtract(x(2), x(0))), subtract(x(3), x(0)));
    }
    // Corner 3 inside of the plane 0 1 2: the diagonal 0-2 sticks out; else 1-3 does.
    const std::size_t a = fourth > 0 ? 1 : 0;
    const std::size_t b = a + 1, c = a + 2;
    const std::uint32_t plane = merged.faces[face.face].plane;
    ok = plane_through(x(a), x(b), x(c), real.normals[plane], real.offsets[plane]);
    if (!ok) return split;
    note_bits(real, plane);
    if (fourth == 0) continue;
    ++split;
    const std::size_t d = (a + 3) % 4;
    const auto new_plane = static_cast<std::uint32_t>(fit.planes.size());
    const auto new_face = static_cast<std::uint32_t>(merged.faces.size());
    fit.planes.push_back(FittedPlane(fit.planes[plane]));
    real.normals.emplace_back();
    real.offsets.emplace_back();
    ok = plane_through(x(a), x(c), x(d), real.normals.back(), real.offsets.back());
    if (!ok) return split;
    note_bits(real, new_plane);
    MergedFace second = merged.faces[face.face];
    second.plane = new_plane;
    merged.faces.push_back(second);
    for (const std::uint32_t id : face_edges[face.face]) {
      MergedEdge& e = merged.edges[id];
      // The sides that meet in corner d belong to the second triangle.
      if (e.u != face.loop[d] && e.v != face.loop[d]) continue;
      (e.left == face.face ? e.left : e.right) = new_face;
    }
    merged.edges.push_back({face.loop[a], face.loop[c], new_face, face.face});
  }
  return split;
}

}  // namespace haptic::tools
