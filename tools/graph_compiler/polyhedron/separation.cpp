// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/separation.hpp"

#include <algorithm>

namespace haptic::tools {

namespace {

bool separated_by_faces(ExactWorld& world, const PieceHull& from, const PieceHull& other) {
  for (const auto& [plane, sign] : from.planes) {
    bool outside = true;
    for (const std::uint32_t v : other.vertices) {
      if (sign * world.side(v, plane) < 0) {
        outside = false;
        break;
      }
    }
    if (outside) return true;
  }
  return false;
}

/// Then the two overlap, and the pairs of edges need no look: they are many, and exact.
bool has_vertex_inside(ExactWorld& world, const PieceHull& from, const PieceHull& other) {
  return std::any_of(from.vertices.begin(), from.vertices.end(), [&](std::uint32_t v) {
    return std::all_of(other.planes.begin(), other.planes.end(), [&](const auto& face) {
      return face.second * world.side(v, face.first) < 0;
    });
  });
}

// Directions of edges as pairs of planes would do too, but vertices are at hand.
std::vector<Rational3> edge_directions(const ExactWorld& world, const Solid& solid) {
  std::vector<Rational3> directions;
  for (const ExactFace& face : solid.faces) {
    for (const auto& [u, v] : face.edges) {
      if (u < v) directions.push_back(subtract(world.vertices[v].x, world.vertices[u].x));
    }
  }
  return directions;
}

std::pair<Rational, Rational> extent(const ExactWorld& world,
                                     const std::vector<std::uint32_t>& vertices,
                                     const Rational3& axis) {
  Rational low = dot(world.vertices[vertices.front()].x, axis);
  Rational high = low;
  for (const std::uint32_t v : vertices) {
    const Rational at = dot(world.vertices[v].x, axis);
    if (at < low) low = at;
    if (at > high) high = at;
  }
  return {low, high};
}

bool separated_by_edges(ExactWorld& world, const Solid& a, const PieceHull& hull_a, const Solid& b,
                        const PieceHull& hull_b) {
  const std::vector<Rational3> of_a = edge_directions(world, a);
  const std::vector<Rational3> of_b = edge_directions(world, b);
  for (const Rational3& e : of_a) {
    for (const Rational3& f : of_b) {
      const Rational3 axis = cross(e, f);
      if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) continue;
      const auto [low_a, high_a] = extent(world, hull_a.vertices, axis);
      const auto [low_b, high_b] = extent(world, hull_b.vertices, axis);
      if (high_a <= low_b || high_b <= low_a) return true;
    }
  }
  return false;
}

}  // namespace

PieceHull::PieceHull(const Solid& piece) : vertices(vertices_of(piece)) {
  for (const ExactFace& face : piece.faces) planes.emplace_back(face.plane, face.sign);
}

bool separated(ExactWorld& world, const Solid& a, const PieceHull& hull_a, const Solid& b,
               const PieceHull& hull_b) {
  if (separated_by_faces(world, hull_a, hull_b) || separated_by_faces(world, hull_b, hull_a)) {
    return true;
  }
  return !has_vertex_inside(world, hull_a, hull_b) && !has_vertex_inside(world, hull_b, hull_a) &&
         separated_by_edges(world, a, hull_a, b, hull_b);
}

}  // namespace haptic::tools
