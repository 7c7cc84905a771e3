// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/mesh/mesh_builder.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "tools/common/error.hpp"

namespace haptic::tools::test {

std::uint32_t MeshBuilder::vertex(const Point3& p) {
  vertices.push_back(p);
  return static_cast<std::uint32_t>(vertices.size() - 1);
}

void MeshBuilder::face(std::vector<std::uint32_t> loop) {
  faces.push_back(std::move(loop));
  groups.push_back(group);
}

void MeshBuilder::box(const Point3& low, const Point3& high, bool outward) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  for (unsigned i = 0; i < 8; ++i) {
    vertex({(i & 1) != 0 ? high[0] : low[0], (i & 2) != 0 ? high[1] : low[1],
            (i & 4) != 0 ? high[2] : low[2]});
  }
  const std::uint32_t loops[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& corners : loops) {
    std::vector<std::uint32_t> loop;
    for (const std::uint32_t corner : corners) {
      loop.push_back(first + corner);
    }
    if (!outward) {
      std::reverse(loop.begin(), loop.end());
    }
    face(std::move(loop));
  }
}

void MeshBuilder::unshare() {
  std::vector<Point3> own;
  for (std::vector<std::uint32_t>& loop : faces) {
    for (std::uint32_t& v : loop) {
      own.push_back(vertices[v]);
      v = static_cast<std::uint32_t>(own.size() - 1);
    }
  }
  vertices = std::move(own);
}

RawMesh MeshBuilder::raw(bool indexed) const {
  RawMesh mesh;
  mesh.file = "built.obj";
  mesh.indexed = indexed;
  mesh.print_resolution = 1.0e-9;
  mesh.vertices = vertices;
  mesh.vertex_places.resize(vertices.size(), 1);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.push_back({faces[f], f + 1, groups[f]});
  }
  return mesh;
}

RawMesh parse_text(std::string_view text, MeshFormat format) {
  return parse_mesh(std::span(text.data(), text.size()), format, "part");
}

Surface clean(const RawMesh& raw) { return clean_surface(raw, CleaningOptions{}); }

std::string refusal(const RawMesh& raw, const CleaningOptions& options) {
  try {
    clean_surface(raw, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string refusal(const RawMesh& raw) { return refusal(raw, CleaningOptions{}); }

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

namespace {

/// Six times the signed volume below a face, as a fan around its middle (faces may be bent).
double six_volumes(const Surface& surface, const SurfaceFace& face) {
  Point3 middle{0, 0, 0};
  Point3 area{0, 0, 0};
  for (std::size_t i = 0; i < face.vertices.size(); ++i) {
    const Point3& a = surface.vertices[face.vertices[i]];
    const Point3& b = surface.vertices[face.vertices[(i + 1) % face.vertices.size()]];
    for (std::size_t k = 0; k < 3; ++k) {
      middle[k] += a[k] / static_cast<double>(face.vertices.size());
      area[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
  }
  return middle[0] * area[0] + middle[1] * area[1] + middle[2] * area[2];
}

/// Every directed edge once, its reverse once, in the same shell.
std::string edge_violation(const Surface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> shell_of_edge;
  for (const SurfaceFace& face : surface.faces) {
    for (std::size_t i = 0; i < face.vertices.size(); ++i) {
      const std::uint32_t to = face.vertices[(i + 1) % face.vertices.size()];
      if (!shell_of_edge.insert({{face.vertices[i], to}, face.shell}).second) {
        return "an edge is used twice in one direction";
      }
    }
  }
  for (const auto& [edge, shell] : shell_of_edge) {
    const auto partner = shell_of_edge.find({edge.second, edge.first});
    if (partner == shell_of_edge.end()) {
      return "an edge has no partner";
    }
    if (partner->second != shell) {
      return "an edge lies between two shells";
    }
  }
  return {};
}

/// The faces around each vertex form one ring.
std::string vertex_violation(const Surface& surface) {
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> ring;  // vertex: before -> after
  for (const SurfaceFace& face : surface.faces) {
    const std::size_t n = face.vertices.size();
    for (std::size_t i = 0; i < n; ++i) {
      ring[face.vertices[i]][face.vertices[(i + n - 1) % n]] = face.vertices[(i + 1) % n];
    }
  }
  for (const auto& [vertex, next] : ring) {
    std::size_t steps = 0;
    std::uint32_t at = next.begin()->first;
    do {
      at = next.at(at);
      ++steps;
    } while (at != next.begin()->first && steps <= next.size());
    if (steps != next.size()) {
      return "several sheets meet in one vertex";
    }
  }
  return {};
}

}  // namespace

double volume(const Surface& surface) {
  double sum = 0.0;
  for (const SurfaceFace& face : surface.faces) {
    sum += six_volumes(surface, face);
  }
  return sum / 6.0;
}

std::size_t step_count(const Surface& surface, std::string_view name) {
  for (const CleaningStep& step : surface.steps) {
    if (step.name == name) {
      return step.count;
    }
  }
  return std::string::npos;
}

std::string violation(const Surface& surface) {
  if (surface.source_vertex.size() != surface.vertices.size()) {
    return "source_vertex has the wrong size";
  }
  for (const SurfaceFace& face : surface.faces) {
    const std::set<std::uint32_t> distinct(face.vertices.begin(), face.vertices.end());
    if (face.vertices.size() < 3 || distinct.size() != face.vertices.size()) {
      return "a loop is too short or repeats a vertex";
    }
    if (*distinct.rbegin() >= surface.vertices.size() || face.shell >= surface.shells.size()) {
      return "an index is out of range";
    }
  }
  std::size_t faces = 0;
  std::set<std::uint32_t> solids;
  for (std::uint32_t s = 0; s < surface.shells.size(); ++s) {
    const Shell& shell = surface.shells[s];
    double six = 0.0;
    for (const std::uint32_t f : shell.faces) {
      if (surface.faces[f].shell != s) {
        return "a shell lists a face of another";
      }
      six += six_volumes(surface, surface.faces[f]);
    }
    faces += shell.faces.size();
    solids.insert(shell.solid);
    if ((six < 0.0) != shell.is_void) {
      return "a shell is turned the wrong way";
    }
    if (shell.is_void && (surface.shells[shell.parent].is_void ||
                          surface.shells[shell.parent].solid != shell.solid)) {
      return "a void has a wrong parent";
    }
  }
  if (faces != surface.faces.size() || solids.size() != surface.solid_count) {
    return "the shells do not cover the faces, or solids are missing";
  }
  const std::string edges = edge_violation(surface);
  return edges.empty() ? vertex_violation(surface) : edges;
}

}  // namespace haptic::tools::test
