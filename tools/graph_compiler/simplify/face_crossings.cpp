// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/simplify/face_crossings.hpp"

#include <algorithm>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/simplify/face_view.hpp"

namespace haptic::tools {
namespace {

/// A side of a face as seen along its normal; `u`, `v`: its ends in the caller's numbering.
struct Border {
  ViewPoint a, b;
  double low = 0.0, high = 0.0;
  std::uint32_t u = 0, v = 0;
};

Border border_of(const FaceView& view, const Point3& a, const Point3& b, std::uint32_t u,
                 std::uint32_t v) {
  const ViewPoint p = view.of(a), q = view.of(b);
  return {p, q, std::min(p.x, q.x), std::max(p.x, q.x), u, v};
}

/// Appends the ends of sides that cross another side.
void add_crossed(std::vector<Border>& borders, std::vector<std::uint32_t>& out) {
  std::stable_sort(borders.begin(), borders.end(),
                   [](const Border& p, const Border& q) { return p.low < q.low; });
  for (std::size_t i = 0; i < borders.size(); ++i) {
    const Border& p = borders[i];
    for (std::size_t k = i + 1; k < borders.size() && borders[k].low <= p.high; ++k) {
      const Border& q = borders[k];
      if (segments_cross(p.a, p.b, q.a, q.b)) out.insert(out.end(), {p.u, p.v, q.u, q.v});
    }
  }
}

void sort_once(std::vector<std::uint32_t>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

}  // namespace

std::vector<std::uint32_t> crossing_vertices(const Surface& before, const Surface& after,
                                             const PlaneFit& fit, const MergedSurface& merged) {
  std::vector<std::uint32_t> out;
  std::vector<std::vector<const MergedEdge*>> of_face(merged.faces.size());
  for (const MergedEdge& e : merged.edges) {
    const Point3 now = vec::sub(after.vertices[e.v], after.vertices[e.u]);
    if (vec::norm(now) == 0.0) continue;
    const Point3 old = vec::sub(before.vertices[e.v], before.vertices[e.u]);
    if (vec::norm(old) > 0.0 && !(vec::dot(old, now) > 0.0)) out.insert(out.end(), {e.u, e.v});
    of_face[e.left].push_back(&e);
    of_face[e.right].push_back(&e);
  }
  for (std::size_t f = 0; f < merged.faces.size(); ++f) {
    const MergedFace& face = merged.faces[f];
    const FaceView view(vec::scaled(fit.planes[face.plane].normal, face.sign));
    std::vector<Border> borders;
    for (const MergedEdge* e : of_face[f]) {
      borders.push_back(border_of(view, after.vertices[e->u], after.vertices[e->v], e->u, e->v));
    }
    add_crossed(borders, out);
  }
  sort_once(out);
  return out;
}

std::vector<Point3> crossing_places(const FlatBody& body) {
  const ExactWorld& world = body.world;
  std::vector<std::uint32_t> bad;
  for (const FlatSolid& flat : body.solids) {
    for (const ExactFace& face : flat.solid.faces) {
      const FaceView view(vec::scaled(world.planes[face.plane].unit_normal, face.sign));
      std::vector<Border> borders;
      for (const auto& [u, v] : face.edges) {
        borders.push_back(
            border_of(view, world.vertices[u].x_approx, world.vertices[v].x_approx, u, v));
      }
      add_crossed(borders, bad);
    }
  }
  sort_once(bad);
  std::vector<Point3> out;
  for (const std::uint32_t v : bad) {
    out.push_back(vec::scaled(world.vertices[v].x_approx, 1.0 / world.scale));
  }
  return out;
}

}  // namespace haptic::tools
