// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/surface/surface_body.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::sim {
namespace {

using Corner = std::array<std::uint32_t, 3>;

void add_quad(FuzzMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

/// A body between z = -h and h over plane corners; `loops`: outlines as corner numbers, counter-
/// clockwise, holes clockwise; `caps`: its triangles, counter-clockwise.
FuzzMesh extruded(const std::string& name, const std::vector<std::array<double, 2>>& corners,
                  const std::vector<std::vector<std::uint32_t>>& loops,
                  const std::vector<Corner>& caps, double h) {
  FuzzMesh mesh{name, {}, {}, true};
  const auto count = static_cast<std::uint32_t>(corners.size());
  for (const double z : {-h, h}) {
    for (const auto& c : corners) mesh.vertices.emplace_back(c[0], c[1], z);
  }
  for (const Corner& t : caps) {
    mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
    mesh.triangles.push_back({t[0], t[2], t[1]});
  }
  for (const auto& loop : loops) {
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t a = loop[k], b = loop[(k + 1) % loop.size()];
      add_quad(mesh, a, b, b + count, a + count);
    }
  }
  return mesh;
}

/// Corners of two loops with as many corners each, the second around the first.
FuzzMesh ring(const std::string& name, const std::vector<std::array<double, 2>>& inner,
              const std::vector<std::array<double, 2>>& outer, double h) {
  const auto count = static_cast<std::uint32_t>(inner.size());
  std::vector<std::array<double, 2>> corners = inner;
  corners.insert(corners.end(), outer.begin(), outer.end());
  std::vector<std::vector<std::uint32_t>> loops(2);
  std::vector<Corner> caps;
  for (std::uint32_t k = 0; k < count; ++k) {
    loops[0].push_back(count - 1 - k);
    loops[1].push_back(count + k);
    const std::uint32_t next = (k + 1) % count;
    caps.push_back({k, count + k, count + next});
    caps.push_back({k, count + next, next});
  }
  return extruded(name, corners, loops, caps, h);
}

std::vector<std::array<double, 2>> polygon(std::uint32_t sides, double radius) {
  std::vector<std::array<double, 2>> corners;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * k / sides;
    corners.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return corners;
}

std::vector<std::array<double, 2>> rectangle(double x, double y) {
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

}  // namespace

std::string obj_text(const FuzzMesh& mesh) {
  std::string text = "# SPDX-License-Identifier: Apache-2.0\n# Unit: metre.\n";
  for (const Vector& v : mesh.vertices) {
    tools::append_line(text, "v %.17g %.17g %.17g", v[0], v[1], v[2]);
  }
  for (const Corner& t : mesh.triangles) {
    tools::append_line(text, "f %u %u %u", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return text;
}

std::vector<Triangle> triangles_of(const FuzzMesh& mesh) {
  std::vector<Triangle> triangles;
  for (const Corner& t : mesh.triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector& v = mesh.vertices[t[k]];
      triangle[k] = {widen(v[0]), widen(v[1]), widen(v[2])};
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

tools::Body facets_of(const FuzzMesh& mesh) {
  tools::RawMesh raw;
  raw.file = mesh.name;
  raw.indexed = true;
  for (const Vector& v : mesh.vertices) raw.vertices.push_back({v[0], v[1], v[2]});
  raw.vertex_places.assign(raw.vertices.size(), 0);
  for (const Corner& t : mesh.triangles) {
    tools::RawFace face;
    face.vertices.assign(t.begin(), t.end());
    raw.faces.push_back(std::move(face));
  }
  tools::SurfaceOptions options;
  options.count_crossings = false;
  return tools::surface_body(tools::make_surface_part(raw, options), mesh.name);
}

FuzzMesh box_mesh_of(const Vector& half) {
  return extruded("box", rectangle(half[0], half[1]), {{0, 1, 2, 3}}, {{0, 1, 2}, {0, 2, 3}},
                  half[2]);
}

FuzzMesh cylinder_mesh(std::uint32_t sides, double radius, double half_height) {
  std::vector<std::vector<std::uint32_t>> loops(1);
  std::vector<Corner> caps;
  for (std::uint32_t k = 0; k < sides; ++k) {
    loops[0].push_back(k);
    if (k >= 2) caps.push_back({0, k - 1, k});
  }
  return extruded("cylinder", polygon(sides, radius), loops, caps, half_height);
}

FuzzMesh tube_mesh(std::uint32_t sides, double inner, double outer, double half_height) {
  return ring("tube", polygon(sides, inner), polygon(sides, outer), half_height);
}

FuzzMesh ell_mesh(double arm, double thick, double half_height) {
  const double low = -arm / 2, high = arm / 2, in = low + thick;
  return extruded("L profile",
                  {{low, low}, {high, low}, {high, in}, {in, in}, {in, high}, {low, high}},
                  {{0, 1, 2, 3, 4, 5}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}, half_height);
}

FuzzMesh sphere_mesh(double radius, std::uint32_t times) {
  FuzzMesh mesh{"sphere", {}, {}, true};
  const double g = (1 + std::sqrt(5.0)) / 2;
  for (int axis = 0; axis < 3; ++axis) {
    for (int signs = 0; signs < 4; ++signs) {
      Vector v = Vector::Zero();
      v[axis] = (signs & 1) != 0 ? 1 : -1;
      v[(axis + 1) % 3] = (signs & 2) != 0 ? g : -g;
      mesh.vertices.push_back(radius * v.normalized());
    }
  }
  // Its faces: the triples at the length of an edge.
  const double edge = 1.05146222423826721 * radius;
  const auto near = [&](std::uint32_t a, std::uint32_t b) {
    return (mesh.vertices[a] - mesh.vertices[b]).norm() < 1.1 * edge;
  };
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!near(a, b) || !near(b, c) || !near(a, c)) continue;
        const Vector &u = mesh.vertices[a], &v = mesh.vertices[b], &w = mesh.vertices[c];
        const bool outwards = (v - u).cross(w - u).dot(u) > 0;
        mesh.triangles.push_back(outwards ? Corner{a, b, c} : Corner{a, c, b});
      }
    }
  }
  for (std::uint32_t time = 0; time < times; ++time) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] = middles.try_emplace(
          {std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) {
        const Vector m = mesh.vertices[a] + mesh.vertices[b];
        mesh.vertices.push_back(radius * m.normalized());
      }
      return at->second;
    };
    std::vector<Corner> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

FuzzMesh drawer_mesh(const Vector& half, double thick) {
  FuzzMesh mesh{"drawer", {}, {}, true};
  const Vector in(half[0] - thick, half[1] - thick, 0);
  // Rings of four corners: outside below, outside above, inside above, inside below.
  const auto add_ring = [&](double x, double y, double z) {
    for (const auto& c : rectangle(x, y)) mesh.vertices.emplace_back(c[0], c[1], z);
  };
  add_ring(half[0], half[1], -half[2]);
  add_ring(half[0], half[1], half[2]);
  add_ring(in[0], in[1], half[2]);
  add_ring(in[0], in[1], -half[2] + thick);
  add_quad(mesh, 3, 2, 1, 0);
  add_quad(mesh, 12, 13, 14, 15);
  for (std::uint32_t level = 0; level < 3; ++level) {
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t a = 4 * level + k, b = 4 * level + (k + 1) % 4;
      add_quad(mesh, a, b, b + 4, a + 4);
    }
  }
  return mesh;
}

FuzzMesh slotted_mesh(double half, double slot_x, double slot_y, double thick) {
  const auto inner = rectangle(slot_x, slot_y), outer = rectangle(half, half);
  if (thick > 0) return ring("slotted plate", inner, outer, thick / 2);
  FuzzMesh mesh{"slotted sheet", {}, {}, false};
  for (const auto& loop : {inner, outer}) {
    for (const auto& c : loop) mesh.vertices.emplace_back(c[0], c[1], 0);
  }
  for (std::uint32_t k = 0; k < 4; ++k) add_quad(mesh, k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4);
  return mesh;
}

FuzzMesh tray_mesh(const Vector& half) {
  FuzzMesh mesh{"tray", {}, {}, false};
  for (const double z : {-half[2], half[2]}) {
    for (const auto& c : rectangle(half[0], half[1])) mesh.vertices.emplace_back(c[0], c[1], z);
  }
  add_quad(mesh, 3, 2, 1, 0);
  for (std::uint32_t k = 0; k < 4; ++k) add_quad(mesh, k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k);
  return mesh;
}

FuzzMesh wavy_mesh(double half, std::uint32_t cells, double height, double waves) {
  FuzzMesh mesh{"wavy sheet", {}, {}, false};
  const auto place = [&](std::uint32_t k) { return half * (2.0 * k / cells - 1); };
  const double turns = std::numbers::pi * waves / half;
  for (std::uint32_t i = 0; i <= cells; ++i) {
    for (std::uint32_t j = 0; j <= cells; ++j) {
      const double x = place(i), y = place(j);
      mesh.vertices.emplace_back(x, y, height * std::sin(turns * x) * std::sin(turns * y));
    }
  }
  for (std::uint32_t i = 0; i < cells; ++i) {
    for (std::uint32_t j = 0; j < cells; ++j) {
      const std::uint32_t a = i * (cells + 1) + j, b = a + cells + 1;
      add_quad(mesh, a, b, b + 1, a + 1);
    }
  }
  return mesh;
}

FuzzMesh torn_mesh(double half, std::uint32_t cells, std::uint64_t seed) {
  FuzzMesh mesh = wavy_mesh(half, cells, 0, 1);
  mesh.name = "torn sheet";
  Seeded random(seed);
  // Corners of the middle column are doubled; the cells on its right take the copies.
  const std::uint32_t row = cells + 1, column = cells / 2;
  std::map<std::uint32_t, std::uint32_t> copy;
  for (std::uint32_t j = 1; j <= cells; ++j) {  // the sheet holds together at one end
    const std::uint32_t old = column * row + j;
    copy[old] = static_cast<std::uint32_t>(mesh.vertices.size());
    const double share = static_cast<double>(j) / cells, bent = 0.05 * half * share;
    const double jag = 0.1 * half / cells * random.uniform(-1, 1);
    Vector& left = mesh.vertices[old];
    left += Vector(jag, 0, bent);
    const double apart = 0.3 * half / cells * share * random.uniform(0, 1);
    mesh.vertices.push_back(left + Vector(apart, 0, -1.7 * bent));
  }
  for (Corner& t : mesh.triangles) {
    bool right = false;
    for (const std::uint32_t v : t) right = right || (v < row * row && v / row > column);
    if (!right) continue;
    for (std::uint32_t& v : t) {
      if (const auto at = copy.find(v); at != copy.end()) v = at->second;
    }
  }
  return mesh;
}

FuzzMesh soup_mesh(std::uint32_t count, double radius, double size, std::uint64_t seed) {
  FuzzMesh mesh{"soup", {}, {}, false};
  Seeded random(seed);
  for (std::uint32_t k = 0; k < count; ++k) {
    const Vector middle = radius * std::cbrt(random.uniform(0, 1)) * random.direction();
    for (int corner = 0; corner < 3; ++corner) {
      mesh.vertices.push_back(middle + size * random.uniform(0.3, 1) * random.direction());
    }
    mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  return mesh;
}

FuzzMesh crossed_mesh(double half) {
  FuzzMesh mesh{"crossed sheets", {}, {}, false};
  for (const auto& c : rectangle(half, half)) mesh.vertices.emplace_back(c[0], c[1], 0);
  for (const auto& c : rectangle(half, 0.5 * half)) {
    mesh.vertices.emplace_back(c[0], 0.3 * c[1], c[1]);
  }
  add_quad(mesh, 0, 1, 2, 3);
  add_quad(mesh, 4, 5, 6, 7);
  return mesh;
}

}  // namespace haptic::sim
