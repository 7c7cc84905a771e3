// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/weld.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

struct Cell {
  std::int64_t x = 0, y = 0, z = 0;
  bool operator==(const Cell&) const = default;
};

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t h = static_cast<std::uint64_t>(cell.x) * 0x9E3779B97F4A7C15ULL;
    h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(cell.y)) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ (h >> 32) ^ static_cast<std::uint64_t>(cell.z)) * 0x94D049BB133111EBULL;
    return static_cast<std::size_t>(h ^ (h >> 31));
  }
};

/// Cells of 16 radii: most points look into one cell only.
class PointGrid {
 public:
  PointGrid(const std::vector<Point3>& points, double radius)
      : points_(points), radius_(radius), cell_(16.0 * radius) {}

  /// Nearest representative within the radius (the earlier one of equals), kNone if there is none.
  std::uint32_t nearest(const Point3& p) const {
    std::uint32_t best = kNone;
    double best_distance = radius_;
    for (std::int64_t x = index(p[0] - radius_); x <= index(p[0] + radius_); ++x) {
      for (std::int64_t y = index(p[1] - radius_); y <= index(p[1] + radius_); ++y) {
        for (std::int64_t z = index(p[2] - radius_); z <= index(p[2] + radius_); ++z) {
          const auto found = first_.find({x, y, z});
          std::uint32_t at = found == first_.end() ? kNone : found->second;
          for (; at != kNone; at = next_[at]) {
            const double d = vec::distance(points_[members_[at]], p);
            const bool earlier = d == best_distance && (best == kNone || members_[at] < best);
            if (d < best_distance || earlier) {
              best_distance = d;
              best = members_[at];
            }
          }
        }
      }
    }
    return best;
  }

  void insert(std::uint32_t point) {
    const Point3& p = points_[point];
    const auto slot = static_cast<std::uint32_t>(members_.size());
    std::uint32_t& first =
        first_.try_emplace({index(p[0]), index(p[1]), index(p[2])}, kNone).first->second;
    members_.push_back(point);
    next_.push_back(first);
    first = slot;
  }

 private:
  std::int64_t index(double x) const { return static_cast<std::int64_t>(std::floor(x / cell_)); }
  const std::vector<Point3>& points_;
  double radius_;
  double cell_;
  std::unordered_map<Cell, std::uint32_t, CellHash> first_;  // looked up, never iterated
  std::vector<std::uint32_t> members_;
  std::vector<std::uint32_t> next_;
};

/// Corners of some faces, each vertex once, ascending.
std::vector<std::uint32_t> vertices_of(const RawMesh& raw,
                                       const std::vector<std::uint32_t>& face_list) {
  std::vector<std::uint32_t> list;
  for (const std::uint32_t f : face_list) {
    list.insert(list.end(), raw.faces[f].vertices.begin(), raw.faces[f].vertices.end());
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

/// The loop without corners that repeat their predecessor and without spikes (a, b, a).
std::vector<std::uint32_t> without_repeats(const std::vector<std::uint32_t>& loop) {
  std::vector<std::uint32_t> out;
  for (const std::uint32_t v : loop) {
    if (out.size() >= 2 && out[out.size() - 2] == v) {
      out.pop_back();
    } else if (out.empty() || out.back() != v) {
      out.push_back(v);
    }
  }
  for (bool changed = true; changed && out.size() >= 2;) {
    changed = false;
    if (out.back() == out.front()) {
      out.pop_back();
      changed = true;
    } else if (out.size() >= 3 && out[out.size() - 2] == out.front()) {
      out.resize(out.size() - 2);
      changed = true;
    } else if (out.size() >= 3 && out.back() == out[1]) {
      out.erase(out.begin());
      out.pop_back();
      changed = true;
    }
  }
  return out;
}

/// Candidate 1 of the header: closed sets of faces connected by vertex indices. Returns the part of
/// each face, kNone for faces that belong to no closed set; `part_count` grows.
std::vector<std::uint32_t> closed_index_parts(const RawMesh& raw, std::uint32_t& part_count) {
  std::vector<std::uint32_t> part(raw.faces.size(), kNone);
  if (!raw.indexed) {
    return part;
  }
  ParitySets sets(raw.vertices.size());
  std::vector<WorkFace> faces(raw.faces.size());
  for (std::size_t f = 0; f < raw.faces.size(); ++f) {
    faces[f].loop = raw.faces[f].vertices;
    for (const std::uint32_t v : faces[f].loop) {
      sets.unite(faces[f].loop[0], v, false);
    }
  }
  const EdgeTable table(faces);
  std::vector<std::uint8_t> open(raw.vertices.size(), 0);  // by root
  for (const EdgeRange& edge : table.edges) {
    if (edge.size() != 2) {
      open[sets.root_of(table.half_edges[edge.begin].low)] = 1;
    }
  }
  std::vector<std::uint32_t> part_of_root(raw.vertices.size(), kNone);
  for (std::size_t f = 0; f < raw.faces.size(); ++f) {
    const std::uint32_t root = sets.root_of(faces[f].loop[0]);
    if (open[root] == 0) {
      if (part_of_root[root] == kNone) {
        part_of_root[root] = part_count++;
      }
      part[f] = part_of_root[root];
    }
  }
  return part;
}

/// True if the faces, welded by themselves, have an even number of faces at each edge.
bool closed_when_welded(const RawMesh& raw, const std::vector<Point3>& points, double radius,
                        const std::vector<std::uint32_t>& face_list) {
  const std::vector<std::uint32_t> vertices = vertices_of(raw, face_list);
  const std::vector<std::uint32_t> target = weld_points(points, vertices, radius);
  std::vector<WorkFace> faces;
  for (const std::uint32_t f : face_list) {
    WorkFace face;
    for (const std::uint32_t v : raw.faces[f].vertices) {
      const auto at = std::lower_bound(vertices.begin(), vertices.end(), v) - vertices.begin();
      face.loop.push_back(target[static_cast<std::size_t>(at)]);
    }
    face.loop = without_repeats(face.loop);
    if (face.loop.size() >= 3) {
      faces.push_back(std::move(face));
    }
  }
  const EdgeTable table(faces);
  return !faces.empty() && std::all_of(table.edges.begin(), table.edges.end(),
                                       [](const EdgeRange& edge) { return edge.size() % 2 == 0; });
}

/// Faces of each part, in the order of the file.
std::vector<std::vector<std::uint32_t>> find_parts(const WorkMesh& mesh,
                                                   const std::vector<Point3>& points,
                                                   double radius) {
  const RawMesh& raw = *mesh.raw;
  std::uint32_t part_count = 0;
  std::vector<std::uint32_t> part = closed_index_parts(raw, part_count);
  std::map<std::uint32_t, std::vector<std::uint32_t>> groups;
  for (std::size_t f = 0; f < raw.faces.size(); ++f) {
    if (part[f] == kNone) {
      groups[raw.faces[f].group].push_back(static_cast<std::uint32_t>(f));
    }
  }
  if (groups.size() > 1) {
    for (const auto& [group, face_list] : groups) {
      if (closed_when_welded(raw, points, radius, face_list)) {
        for (const std::uint32_t f : face_list) {
          part[f] = part_count;
        }
        ++part_count;
      }
    }
  }
  std::vector<std::vector<std::uint32_t>> parts(part_count + 1);
  for (std::size_t f = 0; f < raw.faces.size(); ++f) {
    parts[part[f] == kNone ? part_count : part[f]].push_back(static_cast<std::uint32_t>(f));
  }
  return parts;
}

}  // namespace

std::vector<std::uint32_t> weld_points(const std::vector<Point3>& points,
                                       std::span<const std::uint32_t> subset, double radius) {
  PointGrid grid(points, radius);
  std::vector<std::uint32_t> target;
  target.reserve(subset.size());
  for (const std::uint32_t v : subset) {
    const std::uint32_t nearest = grid.nearest(points[v]);
    if (nearest == kNone) {
      grid.insert(v);
    }
    target.push_back(nearest == kNone ? v : nearest);
  }
  return target;
}

void weld_parts(WorkMesh& mesh, const std::vector<Point3>& local_points) {
  const RawMesh& raw = *mesh.raw;
  const double radius = 0.5 * mesh.tolerance_m;
  CleaningStep weld{"weld", 0, 0.0};
  CleaningStep repeats{"repeated corners", 0, 0.0};
  mesh.faces.resize(raw.faces.size());
  std::vector<std::uint32_t> point_of(raw.vertices.size(), kNone);
  const std::vector<std::vector<std::uint32_t>> parts = find_parts(mesh, local_points, radius);
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::vector<std::uint32_t> vertices = vertices_of(raw, parts[part]);
    const std::vector<std::uint32_t> target = weld_points(local_points, vertices, radius);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (target[i] == vertices[i]) {
        point_of[vertices[i]] = static_cast<std::uint32_t>(mesh.points.size());
        mesh.points.push_back(local_points[vertices[i]]);
        mesh.source_vertex.push_back(vertices[i]);
      } else {
        point_of[vertices[i]] = point_of[target[i]];
        ++weld.count;
        weld.largest_move_m = std::max(
            weld.largest_move_m, vec::distance(local_points[vertices[i]], local_points[target[i]]));
      }
    }
    for (const std::uint32_t f : parts[part]) {
      WorkFace& face = mesh.faces[f];
      face.part = static_cast<std::uint32_t>(part);
      face.source_face = f;
      for (const std::uint32_t v : raw.faces[f].vertices) {
        face.loop.push_back(point_of[v]);
      }
      const std::size_t corners = face.loop.size();
      face.loop = without_repeats(face.loop);
      repeats.count += corners - face.loop.size();
    }
  }
  std::erase_if(mesh.faces, [](const WorkFace& face) { return face.loop.size() < 3; });
  mesh.steps.push_back(weld);
  mesh.steps.push_back(repeats);
}

}  // namespace haptic::tools
