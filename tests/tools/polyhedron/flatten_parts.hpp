// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Closed surfaces made by formula.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "tests/support/random.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools::parts {

using haptic::test::Random;
using Rotation = std::array<Point3, 3>;

inline Rotation random_rotation(Random& random) {
  const auto [w, x, y, z] = random.rotation();
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

inline Point3 turned(const Rotation& r, const Point3& p) {
  return {vec::dot(r[0], p), vec::dot(r[1], p), vec::dot(r[2], p)};
}

/// Vertices in the file frame and oriented polygons.
struct Part {
  std::vector<Point3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;

  Part& transform(const Rotation& r, double scale, const Point3& offset) {
    for (Point3& v : vertices) v = vec::add(vec::scaled(turned(r, v), scale), offset);
    return *this;
  }
  Part& move(const Point3& offset) {
    for (Point3& v : vertices) v = vec::add(v, offset);
    return *this;
  }
  Part& print(int digits) {
    for (Point3& v : vertices) {
      for (double& c : v) {
        char text[64];
        std::snprintf(text, sizeof text, "%.*f", digits, c);
        c = std::strtod(text, nullptr);
      }
    }
    return *this;
  }
};

/// Upright prism over a counter-clockwise polygon, concave allowed.
inline Part prism(const std::vector<std::array<double, 2>>& outline, double low, double high) {
  Part part;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double z : {low, high}) {
    for (const auto& p : outline) part.vertices.push_back({p[0], p[1], z});
  }
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t next = (k + 1) % n;
    part.faces.push_back({k, next, n + next, n + k});
    top.push_back(n + k);
    bottom.push_back(n - 1 - k);
  }
  part.faces.push_back(bottom);
  part.faces.push_back(top);
  return part;
}

inline Part box(const Point3& low, const Point3& high) {
  return prism({{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}}, low[2],
               high[2]);
}

inline std::vector<std::array<double, 2>> regular_outline(int n, double radius) {
  std::vector<std::array<double, 2>> outline;
  for (int k = 0; k < n; ++k) {
    const double angle = 2.0 * 3.14159265358979323846 * k / n;
    outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return outline;
}

/// n tips and n reflex corners.
inline std::vector<std::array<double, 2>> star_outline(int n, double outer, double inner) {
  std::vector<std::array<double, 2>> outline = regular_outline(2 * n, 1.0);
  for (std::size_t k = 0; k < outline.size(); ++k) {
    for (double& c : outline[k]) c *= k % 2 == 0 ? outer : inner;
  }
  return outline;
}

/// Stacked rings: rings[k] has n vertices; flat ends, or an apex where a ring has one vertex.
inline Part loft(const std::vector<std::vector<Point3>>& rings) {
  Part part;
  std::vector<std::uint32_t> first;
  for (const auto& ring : rings) {
    first.push_back(static_cast<std::uint32_t>(part.vertices.size()));
    part.vertices.insert(part.vertices.end(), ring.begin(), ring.end());
  }
  for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
    const auto a = static_cast<std::uint32_t>(rings[r].size());
    const auto b = static_cast<std::uint32_t>(rings[r + 1].size());
    for (std::uint32_t k = 0; k < std::max(a, b); ++k) {
      std::vector<std::uint32_t> face{first[r] + k % a};
      if (a > 1) face.push_back(first[r] + (k + 1) % a);
      if (b > 1) face.push_back(first[r + 1] + (k + 1) % b);
      face.push_back(first[r + 1] + k % b);
      part.faces.push_back(face);
    }
  }
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t k = 0; k < rings.front().size(); ++k) {
    bottom.push_back(static_cast<std::uint32_t>(rings.front().size()) - 1 - k);
  }
  for (std::uint32_t k = 0; k < rings.back().size(); ++k) top.push_back(first.back() + k);
  if (bottom.size() > 2) part.faces.push_back(bottom);
  if (top.size() > 2) part.faces.push_back(top);
  return part;
}

inline std::vector<Point3> ring(int n, double radius, double z) {
  std::vector<Point3> points;
  for (const auto& p : regular_outline(n, radius)) points.push_back({p[0], p[1], z});
  return points;
}

/// Unit cube whose faces are k x k squares, each cut in two triangles.
inline Part subdivided_cube(std::uint32_t k) {
  Part part;
  std::map<Point3, std::uint32_t> index;
  const auto vertex = [&](const Point3& p) {
    const auto [it, fresh] = index.emplace(p, static_cast<std::uint32_t>(part.vertices.size()));
    if (fresh) part.vertices.push_back(p);
    return it->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool far : {false, true}) {
      for (std::uint32_t i = 0; i < k; ++i) {
        for (std::uint32_t j = 0; j < k; ++j) {
          const auto at = [&](std::uint32_t a, std::uint32_t b) {
            Point3 p{};
            p[axis] = far ? 1.0 : 0.0;
            p[(axis + 1) % 3] = static_cast<double>(a) / k;
            p[(axis + 2) % 3] = static_cast<double>(b) / k;
            return vertex(p);
          };
          std::array<std::uint32_t, 4> q{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
          if (!far) std::swap(q[1], q[3]);
          part.faces.push_back({q[0], q[1], q[2]});
          part.faces.push_back({q[0], q[2], q[3]});
        }
      }
    }
  }
  return part;
}

}  // namespace haptic::tools::parts
