// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/mesh_table/awkward_solids.hpp"

#include <cmath>

namespace haptic::tools::test {
namespace {

constexpr double kTurn = 6.283185307179586;

}  // namespace

MeshBuilder box_mesh(const Point3& low, const Point3& high, bool outward) {
  MeshBuilder mesh;
  mesh.box(low, high, outward);
  return mesh;
}

MeshBuilder prism_mesh(const std::vector<Point3>& polygon, double height, bool fan_caps) {
  MeshBuilder mesh;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {0.0, height}) {
    for (const Point3& p : polygon) {
      mesh.vertex({p[0], p[1], z});
    }
  }
  std::vector<std::uint32_t> bottom;
  std::vector<std::uint32_t> top;
  const std::uint32_t centre = fan_caps ? mesh.vertex({0, 0, 0}) : 0;
  const std::uint32_t top_centre = fan_caps ? mesh.vertex({0, 0, height}) : 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.face({i, j, n + j, n + i});
    if (fan_caps) {
      mesh.face({centre, j, i});
      mesh.face({top_centre, n + i, n + j});
    }
    bottom.push_back(n - 1 - i);
    top.push_back(n + i);
  }
  if (!fan_caps) {
    mesh.face(bottom);
    mesh.face(top);
  }
  return mesh;
}

std::vector<Point3> star_polygon(std::size_t points, std::size_t step, double radius) {
  std::vector<Point3> polygon;
  for (std::size_t i = 0; i < points; ++i) {
    const double angle =
        kTurn * static_cast<double>(i * step % points) / static_cast<double>(points);
    polygon.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.0});
  }
  return polygon;
}

std::vector<Point3> toothed_polygon(std::size_t teeth, double outer, double inner) {
  std::vector<Point3> polygon;
  for (std::size_t i = 0; i < 2 * teeth; ++i) {
    const double radius = i % 2 == 0 ? outer : inner;
    const double angle = kTurn * static_cast<double>(i) / static_cast<double>(2 * teeth);
    polygon.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.0});
  }
  return polygon;
}

MeshBuilder moebius_strip(std::uint32_t quads) {
  MeshBuilder mesh;
  for (std::uint32_t i = 0; i < quads; ++i) {
    const double u = kTurn * i / quads;
    for (const double w : {-0.25, 0.25}) {
      const double r = 1.0 + w * std::cos(u / 2);
      mesh.vertex({r * std::cos(u), r * std::sin(u), w * std::sin(u / 2)});
    }
  }
  for (std::uint32_t i = 0; i < quads; ++i) {
    const bool last = i + 1 == quads;
    const std::uint32_t a = last ? 1 : 2 * i + 2;  // the strip closes with its sides exchanged
    const std::uint32_t b = last ? 0 : 2 * i + 3;
    mesh.face({2 * i, a, 2 * i + 1});
    mesh.face({2 * i + 1, a, b});
  }
  return mesh;
}

MeshBuilder klein_bottle() {
  MeshBuilder mesh;
  const std::uint32_t n = 8;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      const double u = kTurn * i / n;
      const double v = kTurn * (j + 0.5) / n;  // off the curve where it crosses itself
      const double r = 4 + std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
      mesh.vertex({r * std::cos(u), r * std::sin(u),
                   std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v)});
    }
  }
  const auto at = [](std::uint32_t i, std::uint32_t j) {
    return i < n ? i * n + j % n : (2 * n - 1 - j) % n;  // the seam is mirrored
  };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      mesh.face({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.face({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

MeshBuilder square_ring() {
  MeshBuilder mesh;
  for (const double z : {0.0, 1.0}) {
    for (const auto& [low, high] : {std::pair{0.0, 3.0}, std::pair{1.0, 2.0}}) {
      mesh.vertex({low, low, z});
      mesh.vertex({high, low, z});
      mesh.vertex({high, high, z});
      mesh.vertex({low, high, z});
    }
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    mesh.face({i, j, 8 + j, 8 + i});            // outside
    mesh.face({4 + j, 4 + i, 12 + i, 12 + j});  // hole
    mesh.face({8 + i, 8 + j, 12 + j, 12 + i});  // top
    mesh.face({j, i, 4 + i, 4 + j});            // bottom
  }
  return mesh;
}

}  // namespace haptic::tools::test
