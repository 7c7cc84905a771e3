// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/shapes/solid_facts.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools::test {
namespace {

using Edges = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// Empty when a directed edge occurs twice.
Edges directed_edges(const RawMesh& mesh) {
  Edges edges;
  for (const RawFace& face : mesh.faces) {
    for (std::size_t k = 0; k < face.vertices.size(); ++k) {
      if (!edges.insert({face.vertices[k], face.vertices[(k + 1) % face.vertices.size()]}).second) {
        return {};
      }
    }
  }
  return edges;
}

/// -0 and 0 are one place.
std::set<Point3> places(const RawMesh& mesh, const Point3& signs) {
  std::set<Point3> result;
  for (const Point3& p : mesh.vertices) {
    result.insert({p[0] * signs[0] + 0.0, p[1] * signs[1] + 0.0, p[2] * signs[2] + 0.0});
  }
  return result;
}

}  // namespace

std::string closed_defect(const RawMesh& mesh, double flat_m) {
  std::set<std::uint32_t> used;
  for (const RawFace& face : mesh.faces) {
    const std::set<std::uint32_t> corners(face.vertices.begin(), face.vertices.end());
    if (corners.size() != face.vertices.size() || corners.size() < 3) return "a face repeats";
    if (*corners.rbegin() >= mesh.vertices.size()) return "a corner is out of range";
    used.insert(corners.begin(), corners.end());
    const Point3 area = vec::twice_area(mesh.vertices, face.vertices);
    if (!(vec::norm(area) > 0.0)) return "a face has no area";
    const Point3 normal = vec::unit(area);
    for (const std::uint32_t v : face.vertices) {
      const Point3 off = vec::sub(mesh.vertices[v], mesh.vertices[face.vertices[0]]);
      if (!(std::abs(vec::dot(off, normal)) <= flat_m)) return "a face is bent";
    }
  }
  if (used.size() != mesh.vertices.size()) return "a vertex is not used";
  if (places(mesh, {1, 1, 1}).size() != mesh.vertices.size()) return "a place occurs twice";
  const Edges edges = directed_edges(mesh);
  if (edges.empty()) return "an edge occurs twice in one direction";
  for (const auto& [from, to] : edges) {
    if (!edges.contains({to, from})) return "an edge is open";
  }
  return {};
}

long euler_characteristic(const RawMesh& mesh) {
  return static_cast<long>(mesh.vertices.size()) -
         static_cast<long>(directed_edges(mesh).size() / 2) + static_cast<long>(mesh.faces.size());
}

double volume_m3(const RawMesh& mesh) {
  double six = 0.0;
  for (const RawFace& face : mesh.faces) {
    six += vec::six_volumes(mesh.vertices, face.vertices, {0, 0, 0});
  }
  return six / 6.0;
}

bool is_symmetric(const RawMesh& mesh, const Point3& signs) {
  return places(mesh, signs) == places(mesh, {1, 1, 1});
}

}  // namespace haptic::tools::test
