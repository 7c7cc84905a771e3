// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/flatten_merge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

double face_size(const Surface& s, std::uint32_t face) {
  return vec::norm(vec::twice_area(s.vertices, s.faces[face].vertices));
}

/// Joins the faces of each shell and side of a plane: the sum of their edge chains, where inner
/// edges cancel.
class FaceMerger {
 public:
  FaceMerger(const Surface& surface, const FaceNeighbors& neighbors, const PlaneFit& fit)
      : s_(surface), neighbors_(neighbors), fit_(fit) {}

  MergedSurface run() {
    group_faces();
    collect_edges();
    straighten();
    return std::move(merged_);
  }

 private:
  void group_faces();
  void collect_edges();
  void straighten();
  void add_chain(const std::vector<std::uint32_t>& chain, std::uint32_t left, std::uint32_t right);
  [[nodiscard]] double distance_to_segment(std::uint32_t v, std::uint32_t a, std::uint32_t b) const;

  const Surface& s_;
  const FaceNeighbors& neighbors_;
  const PlaneFit& fit_;
  std::vector<std::uint32_t> group_;  // per face of the surface
  MergedSurface merged_;
};

void FaceMerger::group_faces() {
  std::map<std::tuple<std::uint32_t, std::uint32_t, int>, std::uint32_t> index;
  std::vector<double> widest;
  group_.resize(s_.faces.size());
  merged_.vertex_planes.resize(s_.vertices.size());
  for (std::uint32_t f = 0; f < s_.faces.size(); ++f) {
    const SurfaceFace& face = s_.faces[f];
    const std::uint32_t plane = fit_.face_plane[f];
    const auto key = std::make_tuple(face.shell, plane, fit_.face_sign[f]);
    const auto [it, fresh] = index.emplace(key, static_cast<std::uint32_t>(merged_.faces.size()));
    if (fresh) {
      merged_.faces.push_back({face.shell, plane, fit_.face_sign[f], f});
      widest.push_back(-1.0);
    }
    group_[f] = it->second;
    const double size = face_size(s_, f);
    if (size > widest[it->second]) {
      widest[it->second] = size;
      merged_.faces[it->second].widest_face = f;
    }
    for (const std::uint32_t v : face.vertices) merged_.vertex_planes[v].push_back(plane);
  }
  for (std::vector<std::uint32_t>& planes : merged_.vertex_planes) {
    std::sort(planes.begin(), planes.end());
    planes.erase(std::unique(planes.begin(), planes.end()), planes.end());
  }
  std::vector<std::set<std::uint32_t>> shell_planes(s_.shells.size());
  std::vector<std::uint32_t> shell_face(s_.shells.size(), kNone);
  for (const MergedFace& face : merged_.faces) {
    shell_planes[face.shell].insert(face.plane);
    shell_face[face.shell] = face.widest_face;
  }
  for (std::size_t k = 0; k < s_.shells.size(); ++k) {
    if (shell_face[k] != kNone && shell_planes[k].size() < 4) {
      refuse_thin(s_, s_.vertices[s_.faces[shell_face[k]].vertices[0]]);
    }
  }
}

void FaceMerger::collect_edges() {
  for (std::uint32_t f = 0; f < s_.faces.size(); ++f) {
    const std::vector<std::uint32_t>& loop = s_.faces[f].vertices;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t g = neighbors_.across(f, k);
      if (group_[g] == group_[f]) continue;
      const std::uint32_t u = loop[k], v = loop[(k + 1) % loop.size()];
      // Two sides of one plane that meet in an edge enclose nothing.
      if (fit_.face_plane[g] == fit_.face_plane[f]) refuse_thin(s_, s_.vertices[u]);
      if (u < v) merged_.edges.push_back({u, v, group_[f], group_[g]});
    }
  }
}

double FaceMerger::distance_to_segment(std::uint32_t v, std::uint32_t a, std::uint32_t b) const {
  const Point3 ab = vec::sub(s_.vertices[b], s_.vertices[a]);
  const Point3 av = vec::sub(s_.vertices[v], s_.vertices[a]);
  const double t = std::clamp(vec::dot(av, ab) / vec::dot(ab, ab), 0.0, 1.0);
  return vec::norm(vec::sub(av, vec::scaled(ab, t)));
}

/// A chain between two corners becomes one edge; what lies off that line (two almost equal planes
/// leave a crooked border) stays a corner and is judged by its movement.
void FaceMerger::add_chain(const std::vector<std::uint32_t>& chain, std::uint32_t left,
                           std::uint32_t right) {
  const std::uint32_t a = chain.front(), b = chain.back();
  if (a == b) refuse_thin(s_, s_.vertices[a]);
  double farthest = 0.0;
  std::size_t at = 0;
  for (std::size_t k = 1; k + 1 < chain.size(); ++k) {
    const double d = distance_to_segment(chain[k], a, b);
    if (d > farthest) farthest = d, at = k;
  }
  if (farthest > kMoveTolerances * s_.plane_tolerance_m) {
    const auto middle = chain.begin() + static_cast<std::ptrdiff_t>(at);
    add_chain({chain.begin(), middle + 1}, left, right);
    add_chain({middle, chain.end()}, left, right);
    return;
  }
  merged_.edges.push_back({a, b, left, right});
  merged_.vertices_gone += chain.size() - 2;
  merged_.largest_gone_m = std::max(merged_.largest_gone_m, farthest);
}

/// A vertex on two planes only lies inside an edge and goes (METHOD section 3, step 6).
void FaceMerger::straighten() {
  const std::vector<MergedEdge> all = std::move(merged_.edges);
  merged_.edges.clear();
  std::vector<std::vector<std::uint32_t>> at_vertex(s_.vertices.size());
  for (std::uint32_t e = 0; e < all.size(); ++e) {
    at_vertex[all[e].u].push_back(e);
    at_vertex[all[e].v].push_back(e);
  }
  for (std::uint32_t v = 0; v < s_.vertices.size(); ++v) {
    if (at_vertex[v].empty() && !merged_.vertex_planes[v].empty()) ++merged_.vertices_gone;
  }
  const auto inside_edge = [&](std::uint32_t v) {
    if (merged_.vertex_planes[v].size() != 2 || at_vertex[v].size() != 2) return false;
    const MergedEdge& e = all[at_vertex[v][0]];
    const MergedEdge& f = all[at_vertex[v][1]];
    const bool through = (e.v == v) == (f.u == v);
    return through ? e.left == f.left && e.right == f.right
                   : e.left == f.right && e.right == f.left;
  };
  std::vector<bool> used(all.size(), false);
  const auto walk = [&](std::uint32_t first, std::uint32_t start) {
    const bool forward = all[first].u == start;
    std::vector<std::uint32_t> chain{start};
    std::uint32_t e = first;
    std::uint32_t v = start;
    while (true) {
      used[e] = true;
      v = all[e].u == v ? all[e].v : all[e].u;
      chain.push_back(v);
      if (!inside_edge(v)) break;
      e = at_vertex[v][at_vertex[v][0] == e ? 1 : 0];
      if (used[e]) refuse_thin(s_, s_.vertices[v]);  // a closed line without corners
    }
    if (!forward) std::reverse(chain.begin(), chain.end());
    add_chain(chain, all[first].left, all[first].right);
  };
  for (std::uint32_t e = 0; e < all.size(); ++e) {
    if (used[e]) continue;
    if (!inside_edge(all[e].u)) {
      walk(e, all[e].u);
    } else if (!inside_edge(all[e].v)) {
      walk(e, all[e].v);
    }
  }
  for (std::uint32_t e = 0; e < all.size(); ++e) {
    if (!used[e]) refuse_thin(s_, s_.vertices[all[e].u]);
  }
}

/// Edge (u, v) of faces f (runs it) and g is reflex iff (N_f x N_g).(x_v - x_u) < 0 (METHOD section
/// 5).
bool is_reflex(const Surface& s, const PlaneFit& fit, const MergedSurface& merged,
               const MergedEdge& e) {
  const auto normal = [&](std::uint32_t face) {
    const MergedFace& f = merged.faces[face];
    return vec::scaled(fit.planes[f.plane].normal, f.sign);
  };
  const Point3 along = vec::sub(s.vertices[e.v], s.vertices[e.u]);
  return vec::dot(vec::cross(normal(e.left), normal(e.right)), along) < 0.0;
}

}  // namespace

FaceNeighbors::FaceNeighbors(const Surface& surface) {
  struct Side {
    std::uint32_t low, high;
    std::size_t place;  // index into neighbor_
    std::uint32_t face;
    bool forward;
  };
  std::vector<Side> sides;
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    const std::vector<std::uint32_t>& loop = surface.faces[f].vertices;
    first_.push_back(sides.size());
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t u = loop[k], v = loop[(k + 1) % loop.size()];
      sides.push_back({std::min(u, v), std::max(u, v), sides.size(), f, u < v});
    }
  }
  neighbor_.assign(sides.size(), 0);
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.place < b.place;
  });
  for (std::size_t k = 0; k < sides.size(); k += 2) {
    std::size_t end = k + 1;
    while (end < sides.size() && sides[end].low == sides[k].low && sides[end].high == sides[k].high)
      ++end;
    if (end - k != 2 || sides[k].forward == sides[k + 1].forward) {
      throw InputError(
          surface.file + ": edge with " + std::to_string(end - k) + " faces at " +
          place_text(surface, surface.vertices[sides[k].low]) +
          ": not two that run it in opposite directions; separate the solids that touch there");
    }
    neighbor_[sides[k].place] = sides[k + 1].face;
    neighbor_[sides[k + 1].place] = sides[k].face;
  }
}

MergedSurface merge_faces(const Surface& surface, const FaceNeighbors& neighbors,
                          const PlaneFit& fit) {
  return FaceMerger(surface, neighbors, fit).run();
}

std::size_t count_reflex(const Surface& s, const PlaneFit& fit, const MergedSurface& merged) {
  return static_cast<std::size_t>(
      std::count_if(merged.edges.begin(), merged.edges.end(),
                    [&](const MergedEdge& e) { return is_reflex(s, fit, merged, e); }));
}

std::size_t planes_through_reflex(const Surface& s, const PlaneFit& fit,
                                  const MergedSurface& merged) {
  std::vector<std::array<std::uint32_t, 2>> open;  // planes of each reflex edge
  std::vector<std::vector<std::uint32_t>> edges_of(fit.planes.size());  // indices into `open`
  for (const MergedEdge& e : merged.edges) {
    if (!is_reflex(s, fit, merged, e)) continue;
    for (const std::uint32_t face : {e.left, e.right}) {
      edges_of[merged.faces[face].plane].push_back(static_cast<std::uint32_t>(open.size()));
    }
    open.push_back({merged.faces[e.left].plane, merged.faces[e.right].plane});
  }
  std::vector<std::uint8_t> cut(open.size(), 0);
  std::vector<std::size_t> left(fit.planes.size());
  std::priority_queue<std::pair<std::size_t, std::uint32_t>> queue;  // edges left when put in
  for (std::uint32_t p = 0; p < left.size(); ++p) {
    left[p] = edges_of[p].size();
    if (left[p] > 0) queue.push({left[p], p});
  }
  std::size_t planes = 0;
  while (!queue.empty()) {
    const auto [count, plane] = queue.top();
    queue.pop();
    if (left[plane] == 0) continue;
    if (count != left[plane]) {
      queue.push({left[plane], plane});
      continue;
    }
    ++planes;
    for (const std::uint32_t e : edges_of[plane]) {
      if (cut[e] != 0) continue;
      cut[e] = 1;
      for (const std::uint32_t p : open[e]) --left[p];
    }
  }
  return planes;
}

void refuse_thin(const Surface& s, const Point3& local_m) {
  char text[80];
  std::snprintf(text, sizeof text, "thinner than the plane tolerance %.3g m at ",
                s.plane_tolerance_m);
  throw InputError(s.file + ": " + text + place_text(s, local_m) +
                   "; give --plane-tolerance below the thickness; flat sheets are no solids");
}

std::string place_text(const Surface& surface, const Point3& local_m) {
  char text[120];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g) m", surface.centre_m[0] + local_m[0],
                surface.centre_m[1] + local_m[1], surface.centre_m[2] + local_m[2]);
  return text;
}

}  // namespace haptic::tools
