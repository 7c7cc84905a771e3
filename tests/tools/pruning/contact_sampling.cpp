// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/pruning/contact_sampling.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "rt_core/scene/graph_rule.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/pruning/exposure.hpp"

namespace haptic::tools::test {
namespace {

PreparedBody put_together(const FlatBody& body, const Decomposition& pieces,
                          const std::vector<PieceExposure>& exposure, const std::string& name) {
  PreparedBody result;
  std::vector<std::size_t> order;
  result.placed.body = to_body(body, pieces, name, &order);
  for (const std::size_t k : order) result.exposure.push_back(exposure[k]);
  return result;
}

std::string shared_folder() { return std::string(HAPTIC_SHARED_DIR) + "/data/"; }

PreparedBody shared_body(const nlohmann::json& part, const std::string& folder) {
  CleaningOptions options;
  const nlohmann::json& scale = part["scale_to_m"];
  for (std::size_t k = 0; k < 3; ++k) {
    options.scale_to_m[k] = scale.is_array() ? scale[k].get<double>() : scale.get<double>();
  }
  const std::string file = part["file"].get<std::string>();
  FlatBody body = flatten(clean_surface(read_mesh(folder + file), options), {});
  return prepared(body, file);
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Rotation turn_about(const Direction& axis, double angle_rad) {
  const double s = std::sin(angle_rad / 2);
  return rotation_of({s * axis[0], s * axis[1], s * axis[2], std::cos(angle_rad / 2)});
}

Rotation product(const Rotation& a, const Rotation& b) {
  Rotation c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t m = 0; m < 3; ++m) c[i][k] += a[i][m] * b[m][k];
    }
  }
  return c;
}

/// One piece at one orientation, with the vertices whose heights decide.
struct PosedPiece {
  PosedPiece(const PieceShape& shape, const Rotation& r) : view(shape.topology.view()) {
    for (const auto& v : shape.vertices) vertices.push_back(rotated(r, v));
    for (const auto& n : shape.normals) normals.push_back(rotated(r, n));
    for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
      std::vector<Point3>& to = at_vertex.emplace_back();
      for (const std::uint16_t e : view.edges_at(v)) {
        to.push_back(vec::sub(vertices[view.other_end(e, v)], vertices[v]));
      }
    }
    for (std::uint32_t e = 0; e < view.edge_count; ++e) {
      std::vector<Point3>& to = at_edge.emplace_back();
      for (const std::uint16_t f : view.edges[e].face) {
        for (const std::uint16_t v : view.face_vertices(f)) {
          to.push_back(vec::sub(vertices[v], end_of(e)));
        }
      }
    }
  }
  [[nodiscard]] const Point3& end_of(std::uint32_t e) const {
    return vertices[view.edges[e].vertex[0]];
  }
  [[nodiscard]] Point3 along(std::uint32_t e) const {
    return vec::sub(vertices[view.edges[e].vertex[1]], end_of(e));
  }

  PieceView view;
  std::vector<Point3> vertices;
  std::vector<Direction> normals;
  std::vector<std::vector<Point3>> at_vertex, at_edge;  ///< differences to their neighbours
};

/// Largest n.d over the differences.
double rise(const Direction& n, const std::vector<Point3>& differences) {
  double most = -kInfinity;
  for (const Point3& d : differences) most = std::max(most, vec::dot(n, d));
  return most;
}

Point3 random_point_in(const std::vector<Point3>& vertices, TestRandom& random) {
  Point3 sum{0, 0, 0};
  double total = 0.0;
  for (const Point3& v : vertices) {
    const double weight = std::pow(random.uniform(), 4.0);
    sum = vec::add(sum, vec::scaled(v, weight));
    total += weight;
  }
  return vec::scaled(sum, 1.0 / total);
}

/// Where a ray enters one convex C-obstacle.
struct Entry {
  bool inside = false, hit = false;
  double at_m = -kInfinity;
};

Entry entry_of(const std::vector<ContactPlane>& planes, const Point3& from, const Direction& d) {
  Entry entry{true, true, -kInfinity};
  double exit_m = kInfinity;
  for (const ContactPlane& plane : planes) {
    const double value = vec::dot(plane.n, from) - plane.offset_m, rate = vec::dot(plane.n, d);
    if (value > 0.0) entry.inside = false;
    if (std::abs(rate) < 1e-12) {
      if (value > 0.0) entry.hit = false;
    } else if (rate < 0.0) {
      entry.at_m = std::max(entry.at_m, -value / rate);
    } else {
      exit_m = std::min(exit_m, -value / rate);
    }
  }
  entry.hit = entry.hit && entry.at_m < exit_m && entry.at_m > 0.0;
  return entry;
}

using PairPlanes = std::vector<std::vector<ContactPlane>>;

/// Follows one ray to its first touch.
void follow(const PrunedScene& scene, const PairPlanes& planes, const Point3& from,
            const Direction& d, double size_m, TouchCount& count) {
  double first_m = kInfinity;
  for (const auto& pair : planes) {
    if (pair.empty()) continue;
    const Entry entry = entry_of(pair, from, d);
    if (entry.inside) return;
    if (entry.hit) first_m = std::min(first_m, entry.at_m);
  }
  if (first_m == kInfinity) return;
  ++count.touches;
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (planes[k].empty()) continue;
    const Entry entry = entry_of(planes[k], from, d);
    if (!entry.hit || entry.at_m > first_m + 1e-9 * size_m) continue;
    for (const ContactPlane& plane : planes[k]) {
      const double rate = vec::dot(plane.n, d);
      const double at_m = (plane.offset_m - vec::dot(plane.n, from)) / rate;
      const bool enters_here = rate < 0.0 && at_m >= first_m - 1e-9 * size_m;
      if (enters_here && scene.description.marks[k].live(plane.node)) return;
    }
  }
  ++count.dropped;
}

}  // namespace

PreparedBody prepared(FlatBody& body, const std::string& name) {
  const Decomposition pieces = decompose(body, name, {});
  return put_together(body, pieces, exposure_of(body, pieces.pieces), name);
}

PreparedBody prepared_pieces(const FlatBody& body, const std::vector<Solid>& pieces,
                             const std::string& name, const std::vector<Solid>& seen) {
  Decomposition decomposition;
  decomposition.pieces = pieces;
  std::vector<PieceExposure> exposure = exposure_of(body, seen.empty() ? pieces : seen);
  exposure.resize(pieces.size());
  return put_together(body, decomposition, exposure, name);
}

SceneDescription scene_of(const PreparedBody& moving, const PreparedBody& fixed) {
  SceneDescription description;
  description.name = "sample";
  description.moving = moving.placed;
  description.statics = {fixed.placed};
  for (std::size_t k = 0; k < 3; ++k) {
    description.grip_m[k] = moving.placed.body.centre_of_volume_m[k];
  }
  description.exposure = moving.exposure;
  description.exposure.insert(description.exposure.end(), fixed.exposure.begin(),
                              fixed.exposure.end());
  return description;
}

std::vector<std::string> shared_names() {
  if (!std::filesystem::exists(shared_folder())) return {};
  return {"square_peg",     "cube_in_cup", "octagon_peg", "rect_peg_16mm",
          "corner_bracket", "ell_fixture", "plug_socket", "prism_stack"};
}

SceneDescription shared_scene(const std::string& name) {
  const std::string folder = shared_folder() + name + "/";
  std::ifstream stream(folder + "task.json");
  const nlohmann::json task = nlohmann::json::parse(stream);
  SceneDescription description =
      scene_of(shared_body(task["moving"], folder), shared_body(task["static"], folder));
  const nlohmann::json& pose = task["assembled_pose"];
  description.moving.position_m = pose["position_m"].get<std::array<double, 3>>();
  description.moving.quaternion_wxyz = pose["quaternion_wxyz"].get<std::array<double, 4>>();
  return description;
}

PrunedScene pruned(SceneDescription description) {
  PrunedScene scene;
  scene.account = prune_scene(description);
  const std::size_t moving = description.moving.body.pieces.size();
  const PieceExposure* exposure = description.exposure.data();
  scene.moving =
      piece_shapes(description.moving, &description.grip_m, exposure, description.orientation);
  scene.fixed = piece_shapes(description.statics[0], nullptr, exposure + moving, std::nullopt);
  scene.description = std::move(description);
  return scene;
}

OrientationEnvelope about_start(const SceneDescription& description, double max_angle_rad) {
  const std::array<double, 4>& q = description.moving.quaternion_wxyz;
  return {{q[1], q[2], q[3], q[0]}, max_angle_rad};
}

Direction random_direction(TestRandom& random) {
  for (;;) {
    const Direction v{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1};
    const double length = vec::norm(v);
    if (length > 0.1 && length < 1.0) return vec::scaled(v, 1.0 / length);
  }
}

Rotation random_rotation(const Rotation& middle, double angle_rad, bool on_rim,
                         TestRandom& random) {
  const double angle = on_rim ? angle_rad : angle_rad * std::cbrt(random.uniform());
  return product(turn_about(random_direction(random), angle), middle);
}

std::vector<ContactPlane> applicable_planes(const PieceShape& a_shape, const PieceShape& b_shape,
                                            const Rotation& r, double tolerance_m) {
  const PosedPiece a(a_shape, r), b(b_shape, rotation_of({0, 0, 0, 1}));
  const NodeNumbering nodes = numbering(a.view, b.view);
  std::vector<ContactPlane> planes;
  // A plane through point p of A (about the grip) and point q of B: n.((x - q) + p).
  const auto add = [&](std::size_t node, const Direction& n, const Point3& p, const Point3& q) {
    planes.push_back({node, n, vec::dot(n, vec::sub(q, p))});
  };
  for (std::uint32_t f = 0; f < nodes.nfa; ++f) {
    const Direction n = vec::scaled(a.normals[f], -1.0);
    for (std::uint32_t v = 0; v < nodes.nvb; ++v) {
      if (rise(n, b.at_vertex[v]) > tolerance_m) continue;
      add(nodes.type_a(f, v), n, a.vertices[a.view.face_vertices(f)[0]], b.vertices[v]);
    }
  }
  for (std::uint32_t v = 0; v < nodes.nva; ++v) {
    for (std::uint32_t f = 0; f < nodes.nfb; ++f) {
      if (rise(vec::scaled(b.normals[f], -1.0), a.at_vertex[v]) > tolerance_m) continue;
      add(nodes.type_b(v, f), b.normals[f], a.vertices[v], b.vertices[b.view.face_vertices(f)[0]]);
    }
  }
  for (std::uint32_t e = 0; e < nodes.nea; ++e) {
    for (std::uint32_t g = 0; g < nodes.neb; ++g) {
      const Direction across = vec::cross(a.along(e), b.along(g));
      const double length = vec::norm(across);
      if (length <= 1e-9 * vec::norm(a.along(e)) * vec::norm(b.along(g))) continue;
      for (const double sign : {1.0, -1.0}) {
        const Direction n = vec::scaled(across, sign / length);
        if (rise(n, b.at_edge[g]) > tolerance_m ||
            rise(vec::scaled(n, -1.0), a.at_edge[e]) > tolerance_m) {
          continue;
        }
        add(nodes.type_c(e, g), n, a.end_of(e), b.end_of(g));
      }
    }
  }
  return planes;
}

OccurrenceCount count_occurrences(const PrunedScene& scene, const OrientationEnvelope& envelope,
                                  std::size_t orientations, std::uint64_t seed) {
  TestRandom random(seed);
  const Rotation middle = rotation_of(envelope.about_xyzw);
  OccurrenceCount count;
  std::vector<std::vector<bool>> occurred;
  for (const PairMarks& marks : scene.description.marks) {
    occurred.emplace_back(marks.reachable.size(), false);
  }
  for (std::size_t s = 0; s < orientations; ++s) {
    const Rotation r = random_rotation(middle, envelope.max_angle_rad, s % 3 == 0, random);
    for (std::size_t k = 0; k < occurred.size(); ++k) {
      const PieceShape &a = scene.moving[k / scene.fixed.size()],
                       &b = scene.fixed[k % scene.fixed.size()];
      for (const ContactPlane& plane : applicable_planes(a, b, r, 1e-9)) {
        ++count.occurrences;
        if (!scene.description.marks[k].reachable[plane.node]) ++count.lost;
        occurred[k][plane.node] = true;
      }
    }
  }
  std::size_t kept = 0, met = 0;
  for (std::size_t k = 0; k < occurred.size(); ++k) {
    for (std::size_t node = 0; node < occurred[k].size(); ++node) {
      if (!scene.description.marks[k].reachable[node]) continue;
      ++kept;
      if (occurred[k][node]) ++met;
    }
  }
  count.kept_share = static_cast<double>(met) / static_cast<double>(kept);
  return count;
}

TouchCount count_touches(const PrunedScene& scene, const OrientationEnvelope& envelope,
                         std::size_t orientations, std::size_t rays, std::uint64_t seed,
                         std::size_t hidden_piece) {
  TestRandom random(seed);
  TouchCount count;
  const Rotation middle = rotation_of(envelope.about_xyzw);
  const Rotation start = rotation_of(about_start(scene.description, 0.0).about_xyzw);
  const Point3 stand =
      vec::add(scene.description.moving.position_m, rotated(start, scene.description.grip_m));
  double size_m = 0.0;
  for (const auto* shapes : {&scene.moving, &scene.fixed}) {
    for (const PieceShape& shape : *shapes) {
      for (const Point3& v : shape.vertices) {
        size_m = std::max(size_m, vec::distance(v, shapes->front().vertices[0]));
      }
    }
  }
  for (std::size_t s = 0; s < orientations; ++s) {
    // A fitted part leaves the place where it stands only while it hardly tilts.
    const bool inside = s % 3 == 0;
    const double angle = inside ? std::min(5e-3, envelope.max_angle_rad) : envelope.max_angle_rad;
    const Rotation r = random_rotation(middle, angle, s % 3 == 1, random);
    PairPlanes planes;
    for (const PieceShape& a : scene.moving) {
      for (std::size_t j = 0; j < scene.fixed.size(); ++j) {
        planes.push_back(j == hidden_piece ? std::vector<ContactPlane>{}
                                           : applicable_planes(a, scene.fixed[j], r, 1e-12));
      }
    }
    for (std::size_t k = 0; k < rays; ++k) {
      const Direction d = random_direction(random);
      Point3 from = stand;
      if (!inside) {
        const PieceShape &a = scene.moving[random.next() % scene.moving.size()],
                         &b = scene.fixed[random.next() % scene.fixed.size()];
        const Point3 target = vec::sub(random_point_in(b.vertices, random),
                                       rotated(r, random_point_in(a.vertices, random)));
        from = vec::sub(target, vec::scaled(d, 6.0 * size_m));
      }
      follow(scene, planes, from, d, size_m, count);
    }
  }
  return count;
}

}  // namespace haptic::tools::test
