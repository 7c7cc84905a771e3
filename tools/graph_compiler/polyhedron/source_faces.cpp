// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/source_faces.hpp"

#include <cmath>

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

namespace {

using Point = std::array<double, 3>;

// Sample points inside a convex facet: its middle, and nine tenths of the way from there to each
// corner.
std::vector<Point> samples(const ExactWorld& world, const ExactFace& face) {
  Point middle{0.0, 0.0, 0.0};
  for (const auto& edge : face.edges) {
    for (std::size_t i = 0; i < 3; ++i) {
      middle[i] += world.vertices[edge.first].x_approx[i] / static_cast<double>(face.edges.size());
    }
  }
  std::vector<Point> points{middle};
  for (const auto& edge : face.edges) {
    Point p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = middle[i] + 0.9 * (world.vertices[edge.first].x_approx[i] - middle[i]);
    }
    points.push_back(p);
  }
  return points;
}

bool inside(const ExactWorld& world, const ExactFace& face, const Point& point) {
  const Point& n = world.planes[face.plane].unit_normal;
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(n[i]) > std::abs(n[axis])) axis = i;
  }
  const std::size_t first = (axis + 1) % 3;
  const std::size_t second = (axis + 2) % 3;
  int winding = 0;
  for (const auto& [u, v] : face.edges) {
    const Point& a = world.vertices[u].x_approx;
    const Point& b = world.vertices[v].x_approx;
    const double turn = (a[first] - point[first]) * (b[second] - point[second]) -
                        (a[second] - point[second]) * (b[first] - point[first]);
    if (a[second] <= point[second] && b[second] > point[second] && turn > 0.0) ++winding;
    if (b[second] <= point[second] && a[second] > point[second] && turn < 0.0) --winding;
  }
  return winding != 0;
}

}  // namespace

void find_source_faces(const ExactWorld& world, const std::vector<FlatSolid>& solids,
                       std::vector<Solid>& pieces, const std::vector<std::uint32_t>& piece_solid) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (ExactFace& facet : pieces[i].faces) {
      facet.source_face = -1;
      const std::vector<Point> points = samples(world, facet);
      for (const ExactFace& face : solids[piece_solid[i]].solid.faces) {
        if (face.plane != facet.plane || face.sign != facet.sign) continue;
        bool shared = false;
        for (const Point& p : points) shared = shared || inside(world, face, p);
        if (shared && (facet.source_face < 0 || face.source_face < facet.source_face)) {
          facet.source_face = face.source_face;
        }
      }
    }
  }
}

}  // namespace haptic::tools
