// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/stitch.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "tools/graph_compiler/mesh/box_tree.hpp"
#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/mesh/weld.hpp"

namespace haptic::tools {
namespace {

std::vector<HalfEdge> open_half_edges(const EdgeTable& table) {
  std::vector<HalfEdge> open;
  for (const EdgeRange& edge : table.edges) {
    if (edge.size() == 1) {
      open.push_back(table.half_edges[edge.begin]);
    }
  }
  return open;
}

/// Points to insert into the edge that starts at a corner of a face, in the order of the loop.
struct Insertion {
  std::uint32_t corner = 0;
  std::vector<std::uint32_t> points;
};

/// One round. Returns the number of inserted points; `farthest` is the largest distance of one from
/// its edge.
std::size_t stitch_round(WorkMesh& mesh, double& farthest) {
  const EdgeTable table(mesh.faces);
  const std::vector<HalfEdge> open = open_half_edges(table);
  if (open.empty()) {
    return 0;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;  // point, part
  for (const HalfEdge& half : open) {
    ends.emplace_back(half.low, mesh.faces[half.face].part);
    ends.emplace_back(half.high, mesh.faces[half.face].part);
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::vector<vec::Box> boxes(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    boxes[i].include(mesh.points[ends[i].first]);
  }
  const BoxTree tree(std::move(boxes));

  std::vector<std::pair<std::uint32_t, Insertion>> insertions;  // face
  std::vector<std::uint32_t> near;
  std::size_t count = 0;
  for (const HalfEdge& half : open) {
    const WorkFace& face = mesh.faces[half.face];
    const std::uint32_t from = half.forward ? half.low : half.high;
    const std::uint32_t to = half.forward ? half.high : half.low;
    const Point3& a = mesh.points[from];
    const Point3 along = vec::unit(vec::sub(mesh.points[to], a));
    const double length = vec::distance(a, mesh.points[to]);
    vec::Box box;
    box.include(a);
    box.include(mesh.points[to]);
    tree.find(box.grown(mesh.tolerance_m), near);
    std::vector<std::pair<double, std::uint32_t>> on_edge;
    for (const std::uint32_t i : near) {
      const auto [point, part] = ends[i];
      if (part != face.part ||
          std::find(face.loop.begin(), face.loop.end(), point) != face.loop.end()) {
        continue;
      }
      const Point3 offset = vec::sub(mesh.points[point], a);
      const double t = vec::dot(offset, along);
      const double off = vec::norm(vec::sub(offset, vec::scaled(along, t)));
      if (t > 0.0 && t < length && off <= mesh.tolerance_m) {
        on_edge.emplace_back(t, point);
        farthest = std::max(farthest, off);
      }
    }
    if (!on_edge.empty()) {
      std::sort(on_edge.begin(), on_edge.end());
      Insertion insertion{half.corner, {}};
      for (const auto& [t, point] : on_edge) {
        insertion.points.push_back(point);
      }
      count += on_edge.size();
      insertions.emplace_back(half.face, std::move(insertion));
    }
  }
  // Later corners first, so that the positions of the earlier ones stay valid.
  std::sort(insertions.begin(), insertions.end(), [](const auto& a, const auto& b) {
    return std::pair{a.first, a.second.corner} > std::pair{b.first, b.second.corner};
  });
  std::size_t dropped = 0;
  for (const auto& [face_index, insertion] : insertions) {
    std::vector<std::uint32_t>& loop = mesh.faces[face_index].loop;
    auto at = loop.begin() + insertion.corner + 1;
    for (const std::uint32_t point : insertion.points) {
      // Two edges of a narrow face may both want the same point.
      if (std::find(loop.begin(), loop.end(), point) != loop.end()) {
        ++dropped;
        continue;
      }
      at = loop.insert(at, point) + 1;
    }
  }
  return count - dropped;
}

/// Chain of open edges that hang together.
struct Hole {
  std::size_t edges = 0;
  double length = 0.0;
  Point3 weighted_sum{0, 0, 0};  ///< midpoints by length
  std::uint32_t face = 0;
};

/// The faces as if all parts were welded: an edge that lies on another part is no hole that a
/// person would see, so it is not counted (a flap on a solid has its free edges open, not the one
/// it hangs on).
std::vector<WorkFace> faces_across_parts(const WorkMesh& mesh) {
  std::vector<std::uint32_t> all(mesh.points.size());
  std::iota(all.begin(), all.end(), 0U);
  const std::vector<std::uint32_t> target = weld_points(mesh.points, all, 0.5 * mesh.tolerance_m);
  std::vector<WorkFace> faces = mesh.faces;
  for (WorkFace& face : faces) {
    for (std::uint32_t& v : face.loop) {
      v = target[v];
    }
  }
  return faces;
}

}  // namespace

void stitch_t_junctions(WorkMesh& mesh) {
  CleaningStep step{"T-junctions", 0, 0.0};
  double farthest = 0.0;
  while (const std::size_t count = stitch_round(mesh, farthest)) {
    step.count += count;
  }
  mesh.steps.push_back(step);
}

void refuse_open_edges(const WorkMesh& mesh) {
  std::vector<HalfEdge> open = open_half_edges(EdgeTable(mesh.faces));
  if (open.empty()) {
    return;
  }
  std::vector<HalfEdge> between_parts = open_half_edges(EdgeTable(faces_across_parts(mesh)));
  if (!between_parts.empty()) {
    open = std::move(between_parts);
  }
  ParitySets chains(mesh.points.size());
  for (const HalfEdge& half : open) {
    chains.unite(half.low, half.high, false);
  }
  std::vector<Hole> holes(mesh.points.size());
  for (const HalfEdge& half : open) {
    Hole& hole = holes[chains.root_of(half.low)];
    const Point3& a = mesh.points[half.low];
    const Point3& b = mesh.points[half.high];
    const double length = vec::distance(a, b);
    hole.face = hole.edges == 0 ? half.face : hole.face;
    ++hole.edges;
    hole.length += length;
    hole.weighted_sum = vec::add(hole.weighted_sum, vec::scaled(vec::add(a, b), 0.5 * length));
  }
  const Hole& longest = *std::max_element(
      holes.begin(), holes.end(), [](const Hole& a, const Hole& b) { return a.length < b.length; });
  refuse_mesh(mesh,
              "open: " + std::to_string(open.size()) + (open.size() == 1 ? " edge" : " edges") +
                  " without a partner, longest hole at " +
                  place_text(mesh, vec::scaled(longest.weighted_sum, 1.0 / longest.length)) + " (" +
                  std::to_string(longest.edges) + " edges, " + length_text(longest.length) +
                  ", next to " + face_text(mesh, mesh.faces[longest.face].source_face) + ")",
              "close the hole in the CAD program; T-junctions were already stitched");
}

}  // namespace haptic::tools
