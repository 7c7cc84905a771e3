// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/face_repair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

constexpr const char* kSplitMend = "split the face into triangles";

bool has_repeat(std::vector<std::uint32_t> loop) {
  std::sort(loop.begin(), loop.end());
  return std::adjacent_find(loop.begin(), loop.end()) != loop.end();
}

/// Simple loops of a loop that passes through points several times: each return to a point closes
/// one.
std::vector<std::vector<std::uint32_t>> simple_loops(const std::vector<std::uint32_t>& loop) {
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<std::uint32_t> path;
  for (const std::uint32_t v : loop) {
    const auto before = std::find(path.begin(), path.end(), v);
    if (before != path.end()) {
      if (path.end() - before >= 3) {
        loops.emplace_back(before, path.end());
      }
      path.erase(before, path.end());
    }
    path.push_back(v);
  }
  if (path.size() >= 3) {
    loops.push_back(path);
  }
  return loops;
}

/// Height over the longest extent. Exact for triangles, an upper bound within a factor of two for
/// others.
double height_of(const std::vector<Point3>& points, const std::vector<std::uint32_t>& loop) {
  if (loop.size() == 3) {
    double longest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      longest = std::max(longest, vec::distance(points[loop[i]], points[loop[(i + 1) % 3]]));
    }
    return longest > 0.0 ? vec::norm(vec::twice_area(points, loop)) / longest : 0.0;
  }
  const auto farthest_from = [&](const Point3& from) {
    return *std::max_element(loop.begin(), loop.end(), [&](std::uint32_t a, std::uint32_t b) {
      return vec::distance(points[a], from) < vec::distance(points[b], from);
    });
  };
  const Point3& a = points[farthest_from(points[loop[0]])];
  const Point3& b = points[farthest_from(a)];
  const Point3 along = vec::unit(vec::sub(b, a));
  double height = 0.0;
  for (const std::uint32_t v : loop) {
    height = std::max(height, vec::norm(vec::cross(along, vec::sub(points[v], a))));
  }
  return height;
}

/// Distance by which the segments (a, b) and (c, d) in a plane pass through each other; 0 if they
/// do not.
double crossing_depth(const std::array<double, 2>& a, const std::array<double, 2>& b,
                      const std::array<double, 2>& c, const std::array<double, 2>& d) {
  const auto side = [](const auto& p, const auto& q, const auto& r) {
    const double x = q[0] - p[0];
    const double y = q[1] - p[1];
    const double length = std::sqrt(x * x + y * y);
    return length > 0.0 ? (x * (r[1] - p[1]) - y * (r[0] - p[0])) / length : 0.0;
  };
  const double c_side = side(a, b, c);
  const double d_side = side(a, b, d);
  const double a_side = side(c, d, a);
  const double b_side = side(c, d, b);
  if ((c_side > 0.0) == (d_side > 0.0) || (a_side > 0.0) == (b_side > 0.0)) {
    return 0.0;
  }
  return std::min({std::abs(c_side), std::abs(d_side), std::abs(a_side), std::abs(b_side)});
}

/// Normal to project a loop along: its area vector, or the largest triangle of its fan where the
/// area cancels (a symmetric bow-tie has none).
Point3 projection_normal(const std::vector<Point3>& points,
                         const std::vector<std::uint32_t>& loop) {
  const Point3 area = vec::twice_area(points, loop);
  Point3 largest = area;
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    const Point3 triangle = vec::cross(vec::sub(points[loop[i]], points[loop[0]]),
                                       vec::sub(points[loop[i + 1]], points[loop[0]]));
    largest = vec::norm(triangle) > 2.0 * vec::norm(largest) ? triangle : largest;
  }
  return largest;
}

/// True if two edges of the loop, projected along the largest component of its normal, cross.
bool crosses_itself(const std::vector<Point3>& points, const std::vector<std::uint32_t>& loop,
                    double least_depth) {
  const Point3 normal = projection_normal(points, loop);
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(normal[i]) > std::abs(normal[axis])) {
      axis = i;
    }
  }
  std::vector<std::array<double, 2>> flat;
  for (const std::uint32_t v : loop) {
    flat.push_back({points[v][(axis + 1) % 3], points[v][(axis + 2) % 3]});
  }
  const std::size_t n = flat.size();
  for (std::size_t i = 0; i + 2 < n; ++i) {
    const auto& a = flat[i];
    const auto& b = flat[i + 1];
    for (std::size_t j = i + 2; j < n - (i == 0 ? 1 : 0); ++j) {
      const auto& c = flat[j];
      const auto& d = flat[j + 1 == n ? 0 : j + 1];
      const bool apart = std::max(a[0], b[0]) < std::min(c[0], d[0]) ||
                         std::max(c[0], d[0]) < std::min(a[0], b[0]) ||
                         std::max(a[1], b[1]) < std::min(c[1], d[1]) ||
                         std::max(c[1], d[1]) < std::min(a[1], b[1]);
      if (!apart && crossing_depth(a, b, c, d) > least_depth) {
        return true;
      }
    }
  }
  return false;
}

/// The loop turned to start at its smallest index, reversed if that makes the second index smaller.
/// The same for all faces over the same corners in the same or the reverse order.
std::vector<std::uint32_t> canonical_loop(const std::vector<std::uint32_t>& loop, bool& reversed) {
  std::vector<std::uint32_t> out = loop;
  std::rotate(out.begin(), std::min_element(out.begin(), out.end()), out.end());
  reversed = out.back() < out[1];
  if (reversed) {
    std::reverse(out.begin() + 1, out.end());
  }
  return out;
}

/// Faces over the same corners.
struct FaceClass {
  std::uint32_t first = 0;  ///< index of the first of them
  std::uint32_t same = 0;   ///< number in the canonical direction
  std::uint32_t opposite = 0;
  bool two_sided() const { return same > 0 && opposite > 0; }
};

std::vector<FaceClass> face_classes(const WorkMesh& mesh, std::vector<std::uint32_t>& class_of) {
  const std::size_t count = mesh.faces.size();
  std::vector<std::vector<std::uint32_t>> loops(count);
  std::vector<std::uint8_t> reversed(count);
  for (std::size_t f = 0; f < count; ++f) {
    bool turned = false;
    loops[f] = canonical_loop(mesh.faces[f].loop, turned);
    reversed[f] = turned ? 1 : 0;
  }
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return loops[a] < loops[b]; });
  std::vector<FaceClass> classes;
  class_of.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t f = order[i];
    if (i == 0 || loops[f] != loops[order[i - 1]]) {
      classes.push_back({f, 0, 0});
    }
    ++(reversed[f] != 0 ? classes.back().opposite : classes.back().same);
    class_of[f] = static_cast<std::uint32_t>(classes.size() - 1);
  }
  return classes;
}

/// Decides about the two-sided classes. They are taken in patches: connected over edges where
/// nothing but two-sided classes meet. True in the result: both sides are dropped.
std::vector<std::uint8_t> walls_to_drop(const std::vector<WorkFace>& representatives,
                                        const std::vector<FaceClass>& classes) {
  const EdgeTable table(representatives);
  ParitySets patches(classes.size());
  const auto counts = [&](const EdgeRange& edge) {
    std::size_t walls = 0;
    for (std::size_t h = edge.begin; h < edge.end; ++h) {
      walls += classes[table.half_edges[h].face].two_sided() ? 1U : 0U;
    }
    return std::pair{walls, edge.size() - walls};
  };
  for (const EdgeRange& edge : table.edges) {
    if (counts(edge).second == 0) {
      for (std::size_t h = edge.begin + 1; h < edge.end; ++h) {
        patches.unite(table.half_edges[edge.begin].face, table.half_edges[h].face, false);
      }
    }
  }
  std::vector<std::uint8_t> closed_if_one_stays(classes.size(), 1);
  std::vector<std::uint8_t> closed_if_both_go(classes.size(), 1);
  for (const EdgeRange& edge : table.edges) {
    const auto [walls, others] = counts(edge);
    for (std::size_t h = edge.begin; h < edge.end && walls > 0; ++h) {
      if (classes[table.half_edges[h].face].two_sided()) {
        const std::uint32_t patch = patches.root_of(table.half_edges[h].face);
        closed_if_one_stays[patch] &= (walls + others) % 2 == 0 ? 1 : 0;
        closed_if_both_go[patch] &= others % 2 == 0 ? 1 : 0;
      }
    }
  }
  std::vector<std::uint8_t> drop(classes.size(), 0);
  for (std::size_t c = 0; c < classes.size(); ++c) {
    const std::uint32_t patch = patches.root_of(static_cast<std::uint32_t>(c));
    drop[c] =
        classes[c].two_sided() && closed_if_one_stays[patch] == 0 && closed_if_both_go[patch] != 0;
  }
  return drop;
}

}  // namespace

void split_touching_loops(WorkMesh& mesh) {
  CleaningStep step{"touching loops", 0, 0.0};
  std::vector<WorkFace> faces;
  faces.reserve(mesh.faces.size());
  for (WorkFace& face : mesh.faces) {
    if (face.loop.size() < 4 || !has_repeat(face.loop)) {
      faces.push_back(std::move(face));
      continue;
    }
    ++step.count;
    const Point3 area = vec::twice_area(mesh.points, face.loop);
    for (std::vector<std::uint32_t>& loop : simple_loops(face.loop)) {
      if (vec::dot(vec::twice_area(mesh.points, loop), area) < 0.0) {
        refuse_mesh(mesh,
                    face_text(mesh, face.source_face) + " at " +
                        place_text(mesh, mesh.points[loop[0]]) +
                        " has a hole bridged into it or crosses itself",
                    kSplitMend);
      }
      faces.push_back({std::move(loop), face.source_face, face.part});
    }
  }
  mesh.faces = std::move(faces);
  mesh.steps.push_back(step);
}

void drop_degenerate_faces(WorkMesh& mesh) {
  const std::size_t before = mesh.faces.size();
  std::erase_if(mesh.faces, [&](const WorkFace& face) {
    return height_of(mesh.points, face.loop) < 0.1 * mesh.tolerance_m;
  });
  // Faces that lost their corners to the weld had no area either.
  const std::size_t in_file = mesh.raw->faces.size();
  const std::size_t welded_away = in_file > before ? in_file - before : 0;
  mesh.steps.push_back({"degenerate faces", before - mesh.faces.size() + welded_away, 0.0});
}

void refuse_crossing_loops(const WorkMesh& mesh) {
  for (const WorkFace& face : mesh.faces) {
    if (face.loop.size() >= 4 && crosses_itself(mesh.points, face.loop, 0.1 * mesh.tolerance_m)) {
      refuse_mesh(mesh,
                  face_text(mesh, face.source_face) + " at " +
                      place_text(mesh, mesh.points[face.loop[0]]) + " crosses itself (bow-tie)",
                  kSplitMend);
    }
  }
}

void drop_duplicate_faces(WorkMesh& mesh) {
  CleaningStep duplicates{"duplicate faces", 0, 0.0};
  CleaningStep walls{"inner walls", 0, 0.0};
  std::vector<std::uint32_t> class_of;
  const std::vector<FaceClass> classes = face_classes(mesh, class_of);
  if (classes.size() < mesh.faces.size()) {
    std::vector<WorkFace> representatives;
    for (const FaceClass& face_class : classes) {
      representatives.push_back(mesh.faces[face_class.first]);
    }
    const std::vector<std::uint8_t> drop = walls_to_drop(representatives, classes);
    std::vector<WorkFace> kept;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      if (drop[class_of[f]] != 0) {
        ++walls.count;
      } else if (classes[class_of[f]].first != f) {
        ++duplicates.count;
      } else {
        kept.push_back(std::move(mesh.faces[f]));
      }
    }
    mesh.faces = std::move(kept);
  }
  mesh.steps.push_back(duplicates);
  mesh.steps.push_back(walls);
}

}  // namespace haptic::tools
