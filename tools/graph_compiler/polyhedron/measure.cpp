// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::tools {

namespace {

constexpr unsigned kFixedBits = 320;

using Integer3 = std::array<Integer, 3>;

Integer3 fixed(const Rational3& x) {
  Integer3 result;
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = (Integer(numerator(x[i])) << kFixedBits) / Integer(denominator(x[i]));
  }
  return result;
}

Integer power_of_two(unsigned exponent) { return pow(Integer(2), exponent); }

Integer determinant(const Integer3& a, const Integer3& b, const Integer3& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

}  // namespace

Rational volume(const ExactWorld& world, const Solid& solid) {
  // V = 1/6 sum over faces o.(sum of u x v), o any point of the face: tetrahedra over the local
  // origin.
  Rational sum = 0;
  for (const ExactFace& face : solid.faces) {
    Rational3 area{0, 0, 0};
    for (const ChainEdge& e : face.edges) {
      const Rational3 c = cross(world.vertices[e.first].x, world.vertices[e.second].x);
      for (std::size_t i = 0; i < 3; ++i) area[i] += c[i];
    }
    if (!face.edges.empty()) sum += dot(world.vertices[face.edges.front().first].x, area);
  }
  return sum / 6;
}

int volume_sign(const ExactWorld& world, const Solid& solid) {
  double sum = 0.0;
  double bound = 0.0;
  for (const ExactFace& face : solid.faces) {
    for (const ChainEdge& e : face.edges) {
      const std::array<double, 3>& a = world.vertices[face.edges.front().first].x_approx;
      const std::array<double, 3>& b = world.vertices[e.first].x_approx;
      const std::array<double, 3>& c = world.vertices[e.second].x_approx;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const std::size_t k = (i + 2) % 3;
        sum += a[i] * (b[j] * c[k] - b[k] * c[j]);
        bound += std::abs(a[i]) * (std::abs(b[j] * c[k]) + std::abs(b[k] * c[j]));
      }
    }
  }
  // Every term errs by a few 2^-53 of its magnitude, the sum by one per addition.
  if (std::abs(sum) > 1.0e-11 * bound) return sum > 0.0 ? 1 : -1;
  const Rational exact = volume(world, solid);
  return exact > 0 ? 1 : (exact < 0 ? -1 : 0);
}

Measure measure(const ExactWorld& world, const Solid& solid) {
  const std::vector<std::uint32_t> vertices = vertices_of(solid);
  std::vector<Integer3> points;
  points.reserve(vertices.size());
  for (const std::uint32_t v : vertices) points.push_back(fixed(world.vertices[v].x));
  const auto point = [&](std::uint32_t v) -> const Integer3& {
    const auto it = std::lower_bound(vertices.begin(), vertices.end(), v);
    return points[static_cast<std::size_t>(it - vertices.begin())];
  };
  Integer six_volumes = 0;
  Integer3 moment{0, 0, 0};  // 24 times the first moment
  for (const ExactFace& face : solid.faces) {
    if (face.edges.empty()) continue;
    const Integer3& o = point(face.edges.front().first);
    for (const ChainEdge& e : face.edges) {
      const Integer3& u = point(e.first);
      const Integer3& v = point(e.second);
      const Integer det = determinant(o, u, v);
      six_volumes += det;
      for (std::size_t i = 0; i < 3; ++i) moment[i] += det * (o[i] + u[i] + v[i]);
    }
  }
  Measure result;
  result.volume = Rational(six_volumes, Integer(6 * power_of_two(3 * kFixedBits)));
  for (std::size_t i = 0; i < 3; ++i) {
    result.first_moment[i] = Rational(moment[i], Integer(24 * power_of_two(4 * kFixedBits)));
  }
  return result;
}

double thickness(const ExactWorld& world, const Solid& piece) {
  const std::vector<std::uint32_t> vertices = vertices_of(piece);
  double least = std::numeric_limits<double>::infinity();
  for (const ExactFace& face : piece.faces) {
    const ExactPlane& plane = world.planes[face.plane];
    double width = 0.0;
    for (const std::uint32_t v : vertices) {
      const std::array<double, 3>& x = world.vertices[v].x_approx;
      const double distance = plane.unit_normal[0] * x[0] + plane.unit_normal[1] * x[1] +
                              plane.unit_normal[2] * x[2] - plane.unit_offset;
      width = std::max(width, std::abs(distance));
    }
    least = std::min(least, width);
  }
  return least;
}

double diagonal(const ExactWorld& world, const std::vector<std::uint32_t>& vertices) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 3> low{kFar, kFar, kFar};
  std::array<double, 3> high{-kFar, -kFar, -kFar};
  for (const std::uint32_t v : vertices) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], world.vertices[v].x_approx[i]);
      high[i] = std::max(high[i], world.vertices[v].x_approx[i]);
    }
  }
  if (vertices.empty()) return 0.0;
  return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

}  // namespace haptic::tools
