// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must hold of every flattened body.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools::parts {

// What flattening says of a surface that it refuses.

inline std::string refusal(const Surface& s, const FlattenLimits& limits = {}) {
  try {
    flatten(s, limits);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

inline bool contains(const std::string& text, const std::string& piece) {
  return text.find(piece) != std::string::npos;
}

/// Volume from the boundary chains [m^3], every face through its own plane.
inline double chain_volume(const FlatBody& body) {
  double volume = 0.0;
  for (const FlatSolid& flat : body.solids) {
    for (const ExactFace& face : flat.solid.faces) {
      const ExactPlane& plane = body.world.planes[face.plane];
      Point3 doubled{0, 0, 0};
      for (const auto& [u, v] : face.edges) {
        doubled = vec::add(
            doubled, vec::cross(body.world.vertices[u].x_approx, body.world.vertices[v].x_approx));
      }
      volume += 0.5 * vec::dot(doubled, plane.unit_normal) * plane.unit_offset / 3.0;
    }
  }
  return volume / std::pow(body.world.scale, 3);
}

inline double surface_volume(const Surface& s) {
  double six = 0.0;
  for (const SurfaceFace& face : s.faces)
    six += vec::six_volumes(s.vertices, face.vertices, {0, 0, 0});
  return six / 6.0;
}

/// Every incidence exact; chains closed; each edge run twice, in opposite directions; area and
/// volume kept.
inline void check_body(FlatBody& body, const Surface& s) {
  std::size_t wrong_sides = 0, open_chains = 0, unmatched = 0, inward = 0;
  for (const FlatSolid& flat : body.solids) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
    for (const ExactFace& face : flat.solid.faces) {
      std::map<std::uint32_t, int> ends;
      Point3 doubled{0, 0, 0};
      for (const auto& [u, v] : face.edges) {
        wrong_sides += body.world.side(u, face.plane) != 0 || body.world.side(v, face.plane) != 0;
        ++ends[v];
        --ends[u];
        balance[{std::min(u, v), std::max(u, v)}] += u < v ? 1 : -1;
        doubled = vec::add(
            doubled, vec::cross(body.world.vertices[u].x_approx, body.world.vertices[v].x_approx));
      }
      for (const auto& [v, count] : ends) open_chains += count != 0;
      inward += !(face.sign * vec::dot(doubled, body.world.planes[face.plane].unit_normal) > 0.0);
    }
    for (const auto& [edge, count] : balance) unmatched += count != 0;
  }
  CHECK(wrong_sides == 0);
  CHECK(open_chains == 0);
  CHECK(unmatched == 0);
  CHECK(inward == 0);
  double surface_area = 0.0;
  for (const SurfaceFace& f : s.faces)
    surface_area += 0.5 * vec::norm(vec::twice_area(s.vertices, f.vertices));
  CHECK(std::abs(chain_volume(body) - surface_volume(s)) <=
        surface_area * body.largest_move_m + 1e-13 * surface_area * s.diagonal_m);
  CHECK(body.largest_move_m <= 4.0 * s.plane_tolerance_m);
}

/// Largest distance between a vertex in the file frame and the file's own, in units of the last
/// place of the largest coordinate of the part. Every vertex of the world must come from the file.
inline double moved_ulps(const FlatBody& body, const std::vector<Point3>& file_vertices) {
  double largest = 0.0, moved = 0.0;
  for (const Point3& v : file_vertices) {
    for (const double c : v) largest = std::max(largest, std::abs(c));
  }
  const double ulp = std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
  for (std::size_t k = 0; k < body.world.vertices.size(); ++k) {
    REQUIRE(body.world.source_vertex[k] >= 0);
    const Point3& wanted = file_vertices[static_cast<std::size_t>(body.world.source_vertex[k])];
    for (std::size_t i = 0; i < 3; ++i) {
      const double file = to_double(body.world.vertices[k].x[i] / Rational(body.world.scale) +
                                    Rational(body.world.centre_m[i]));
      moved = std::max(moved, std::abs(file - wanted[i]) / ulp);
    }
  }
  return moved;
}

}  // namespace haptic::tools::parts
