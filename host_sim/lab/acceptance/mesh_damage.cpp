// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/acceptance/mesh_damage.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/graph_compiler/shapes/fasteners.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::sim {
namespace {

using tools::Point3;
using tools::RawFace;
using tools::RawMesh;

std::uint32_t size_of(const std::vector<RawFace>& faces) {
  return static_cast<std::uint32_t>(faces.size());
}

/// How many of `count`: often one, at most a share of them.
std::uint32_t some_of(std::uint32_t count, double most_share, Seeded& random) {
  const double most = std::max(1.0, most_share * static_cast<double>(count));
  return static_cast<std::uint32_t>(std::max(1.0, std::pow(most, random.uniform(0, 1))));
}

double diagonal_of(const RawMesh& mesh) {
  Point3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  double square = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (const Point3& p : mesh.vertices) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
    if (!mesh.vertices.empty()) square += (high[k] - low[k]) * (high[k] - low[k]);
  }
  return std::sqrt(square);
}

/// A vertex of its own for a corner.
std::uint32_t copy_of(RawMesh& mesh, std::uint32_t vertex) {
  mesh.vertices.push_back(Point3(mesh.vertices[vertex]));
  mesh.vertex_places.push_back(0);
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

void make_holes(RawMesh& mesh, Seeded& random) {
  const std::uint32_t holes = some_of(size_of(mesh.faces), 0.2, random);
  for (std::uint32_t k = 0; k < holes && mesh.faces.size() > 1; ++k) {
    mesh.faces.erase(mesh.faces.begin() + random.below(size_of(mesh.faces)));
  }
}

void turn_faces(RawMesh& mesh, Seeded& random) {
  const std::uint32_t flips = some_of(size_of(mesh.faces), 0.4, random);
  for (std::uint32_t k = 0; k < flips; ++k) {
    std::ranges::reverse(mesh.faces[random.below(size_of(mesh.faces))].vertices);
  }
}

void repeat_faces(RawMesh& mesh, Seeded& random) {
  const std::uint32_t copies = some_of(size_of(mesh.faces), 0.4, random);
  for (std::uint32_t k = 0; k < copies; ++k) {
    RawFace face = mesh.faces[random.below(size_of(mesh.faces))];
    if (random.below(2) == 0) std::ranges::reverse(face.vertices);
    mesh.faces.push_back(std::move(face));
  }
}

void shake(RawMesh& mesh, Seeded& random) {
  const double reach = 1e-6 * diagonal_of(mesh);
  for (RawFace& face : mesh.faces) {
    for (std::uint32_t& v : face.vertices) {
      v = copy_of(mesh, v);
      for (double& x : mesh.vertices[v]) x += random.uniform(-reach, reach);
    }
  }
}

void crack(RawMesh& mesh, Seeded& random) {
  const double width = diagonal_of(mesh) * std::pow(10.0, random.uniform(-7, -2));
  const Vector way = random.direction();
  const std::uint32_t begin = random.below(size_of(mesh.faces));
  const std::uint32_t count = some_of(size_of(mesh.faces), 0.5, random);
  std::map<std::uint32_t, std::uint32_t> moved;
  for (std::uint32_t k = 0; k < count; ++k) {
    for (std::uint32_t& v : mesh.faces[(begin + k) % size_of(mesh.faces)].vertices) {
      if (std::ranges::any_of(moved, [&](const auto& m) { return m.second == v; })) continue;
      const auto [at, is_new] = moved.try_emplace(v, 0);
      if (is_new) {
        at->second = copy_of(mesh, v);
        for (std::size_t i = 0; i < 3; ++i) {
          mesh.vertices[at->second][i] += width * way[static_cast<Eigen::Index>(i)];
        }
      }
      v = at->second;
    }
  }
}

/// A face without area along a side of another, and a corner in the middle of a side.
void add_slivers(RawMesh& mesh, Seeded& random) {
  const std::uint32_t count = some_of(size_of(mesh.faces), 0.2, random);
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t f = random.below(size_of(mesh.faces));
    const std::vector<std::uint32_t>& loop = mesh.faces[f].vertices;
    const std::size_t at = random.below(static_cast<std::uint32_t>(loop.size()));
    const std::uint32_t a = loop[at], b = loop[(at + 1) % loop.size()];
    const std::uint32_t middle = copy_of(mesh, a);
    const double share = random.uniform(0.1, 0.9);
    for (std::size_t i = 0; i < 3; ++i) {
      mesh.vertices[middle][i] += share * (mesh.vertices[b][i] - mesh.vertices[a][i]);
    }
    if (random.below(2) == 0) {
      RawFace sliver;
      sliver.vertices = {a, middle, b};
      mesh.faces.push_back(std::move(sliver));
    } else {
      std::vector<std::uint32_t>& changed = mesh.faces[f].vertices;
      changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(at) + 1, middle);
    }
  }
}

void damage_by(RawMesh& mesh, MeshDamage damage, Seeded& random) {
  switch (damage) {
    case MeshDamage::kNone:
      return;
    case MeshDamage::kHoles:
      return make_holes(mesh, random);
    case MeshDamage::kFlips:
      return turn_faces(mesh, random);
    case MeshDamage::kDuplicates:
      return repeat_faces(mesh, random);
    case MeshDamage::kNoise:
      return shake(mesh, random);
    case MeshDamage::kCracks:
      return crack(mesh, random);
    case MeshDamage::kSlivers:
      return add_slivers(mesh, random);
    case MeshDamage::kMixed:
      for (int k = 0; k < 2; ++k) {
        damage_by(mesh, static_cast<MeshDamage>(1 + random.below(kMeshDamages - 2)), random);
      }
  }
}

RawMesh raw_of(const FuzzMesh& from) {
  RawMesh mesh;
  mesh.file = from.name;
  mesh.indexed = true;
  for (const Vector& p : from.vertices) mesh.vertices.push_back({p.x(), p.y(), p.z()});
  mesh.vertex_places.resize(mesh.vertices.size(), 0);
  for (const auto& t : from.triangles) {
    RawFace face;
    face.vertices.assign(t.begin(), t.end());
    mesh.faces.push_back(std::move(face));
  }
  return mesh;
}

Point3 difference(const Point3& a, const Point3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Point3 product(const Point3& a, const Point3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace

const char* to_text(MeshDamage damage) {
  constexpr const char* kWords[kMeshDamages] = {"none",  "holes",  "flips",   "duplicates",
                                                "noise", "cracks", "slivers", "mixed"};
  return kWords[static_cast<std::size_t>(damage)];
}

RawMesh damaged(const RawMesh& mesh, MeshDamage damage, std::uint64_t seed) {
  RawMesh result = mesh;
  Seeded random(seed);
  damage_by(result, damage, random);
  return result;
}

std::vector<RawMesh> good_meshes() {
  using namespace tools;
  const std::pair<const char*, Shape> shapes[] = {
      {"box", BoxShape{{0.03, 0.02, 0.01}}},
      {"prism", PrismShape{0.01, 0.02, 5}},
      {"cylinder", CylinderShape{0.008, 0.03, 24}},
      {"cone", ConeShape{0.01, 0.02, 16}},
      {"sphere", SphereShape{0.01, 12}},
      {"capsule", CapsuleShape{0.006, 0.03, 12}},
      {"tube", TubeShape{0.008, 0.012, 0.02, 24}},
      {"thread", ThreadShape{0.008, 0.00125, 3, false, 0, 5e-5, 16}},
      {"threaded tube", ThreadShape{0.008, 0.00125, 2, true, 0.007, 0, 16}}};
  std::vector<RawMesh> meshes;
  for (const auto& [name, shape] : shapes) meshes.push_back(shape_mesh(shape, name));
  for (const FuzzMesh& mesh : {ell_mesh(0.04, 0.012, 0.01), drawer_mesh({0.04, 0.03, 0.02}, 0.003),
                               slotted_mesh(0.05, 0.015, 0.006, 0.002)}) {
    meshes.push_back(raw_of(mesh));
  }
  return meshes;
}

MeshFacts facts_of(const RawMesh& mesh) {
  MeshFacts facts;
  for (const Point3& p : mesh.vertices) {
    for (const double x : p) facts.not_finite += std::isfinite(x) ? 0u : 1u;
  }
  if (facts.not_finite > 0) return facts;
  facts.diagonal = diagonal_of(mesh);
  std::set<std::array<Point3, 3>> different;
  for (const RawFace& face : mesh.faces) {
    for (std::size_t k = 1; k + 1 < face.vertices.size(); ++k) {
      std::array<Point3, 3> t{mesh.vertices[face.vertices[0]], mesh.vertices[face.vertices[k]],
                              mesh.vertices[face.vertices[k + 1]]};
      ++facts.triangles;
      const Point3 normal = product(difference(t[1], t[0]), difference(t[2], t[0]));
      const Point3 arm = difference(t[0], mesh.vertices[0]);
      facts.volume += (arm[0] * normal[0] + arm[1] * normal[1] + arm[2] * normal[2]) / 6;
      const double twice_area =
          std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
      if (twice_area <= 2e-12 * facts.diagonal * facts.diagonal) continue;
      ++facts.with_area;
      std::ranges::sort(t);
      different.insert(t);
    }
  }
  std::map<std::array<Point3, 2>, std::size_t> uses;
  for (const std::array<Point3, 3>& t : different) {
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<Point3, 2> edge{t[k], t[(k + 1) % 3]};
      std::ranges::sort(edge);
      ++uses[edge];
    }
  }
  for (const auto& [edge, count] : uses) facts.open_edges += count == 1 ? 1u : 0u;
  return facts;
}

}  // namespace haptic::sim
