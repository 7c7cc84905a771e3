// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// A number as the exact sum of its parts, which do not overlap, smallest first.
template <std::size_t Capacity>
struct Expansion {
  std::array<double, Capacity> part{};
  std::size_t count = 0;

  void push(double x) {
    if (x < 0.0 || x > 0.0) part[count++] = x;
  }
  /// The largest part decides.
  [[nodiscard]] int sign() const { return count == 0 ? 0 : part[count - 1] > 0.0 ? 1 : -1; }
};

struct Pair {
  double high, low;  ///< high + low is exact
};

Pair two_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  const double a_part = sum - b_part;
  return {sum, (a - a_part) + (b - b_part)};
}

Pair two_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

Expansion<2> difference(double a, double b) {
  const Pair d = two_sum(a, -b);
  Expansion<2> e;
  e.push(d.low);
  e.push(d.high);
  return e;
}

/// Adds one double to an expansion, part by part.
template <std::size_t N>
void grow(Expansion<N>& e, double b) {
  double carry = b;
  std::size_t out = 0;
  for (std::size_t i = 0; i < e.count; ++i) {
    const Pair s = two_sum(carry, e.part[i]);
    carry = s.high;
    if (s.low < 0.0 || s.low > 0.0) e.part[out++] = s.low;
  }
  e.count = out;
  e.push(carry);
}

template <std::size_t N, std::size_t M>
Expansion<N + M> sum(const Expansion<N>& a, const Expansion<M>& b, double sign) {
  Expansion<N + M> e;
  for (std::size_t i = 0; i < a.count; ++i) e.push(a.part[i]);
  for (std::size_t i = 0; i < b.count; ++i) grow(e, sign * b.part[i]);
  return e;
}

template <std::size_t N, std::size_t M>
Expansion<2 * N * M> product(const Expansion<N>& a, const Expansion<M>& b) {
  Expansion<2 * N * M> e;
  for (std::size_t i = 0; i < a.count; ++i) {
    for (std::size_t k = 0; k < b.count; ++k) {
      const Pair p = two_product(a.part[i], b.part[k]);
      grow(e, p.low);
      grow(e, p.high);
    }
  }
  return e;
}

using Minor = Expansion<16>;

Minor minor_of(const Expansion<2>& a, const Expansion<2>& b, const Expansion<2>& c,
               const Expansion<2>& d) {
  return sum(product(a, d), product(b, c), -1.0);
}

int exact_side(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  std::array<std::array<Expansion<2>, 3>, 3> m;
  const std::array<const Point3*, 3> rows{&a, &b, &c};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t k = 0; k < 3; ++k) m[r][k] = difference((*rows[r])[k], d[k]);
  }
  const auto first = product(minor_of(m[1][1], m[1][2], m[2][1], m[2][2]), m[0][0]);
  const auto second = product(minor_of(m[1][0], m[1][2], m[2][0], m[2][2]), m[0][1]);
  const auto third = product(minor_of(m[1][0], m[1][1], m[2][0], m[2][1]), m[0][2]);
  return sum(sum(first, second, -1.0), third, 1.0).sign();
}

/// The side where doubles can tell it, else 0.
int clear_side(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  const Point3 u = vec::sub(a, d), v = vec::sub(b, d), w = vec::sub(c, d);
  double value = 0.0, size = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    const double left = v[l] * w[m], right = v[m] * w[l];
    value += u[k] * (left - right);
    size += std::abs(u[k]) * (std::abs(left) + std::abs(right));
  }
  constexpr double kBound = 10.0 * std::numeric_limits<double>::epsilon();
  return std::abs(value) > kBound * size ? (value > 0.0 ? 1 : -1) : 0;
}

/// Sign of the turn a -> b -> c in the plane of the axes i and j.
int turn_sign(const Point3& a, const Point3& b, const Point3& c, std::size_t i, std::size_t j) {
  const double left = (a[i] - c[i]) * (b[j] - c[j]);
  const double right = (a[j] - c[j]) * (b[i] - c[i]);
  const double turn = left - right;
  constexpr double kBound = 4.0 * std::numeric_limits<double>::epsilon();
  if (std::abs(turn) > kBound * (std::abs(left) + std::abs(right))) return turn > 0.0 ? 1 : -1;
  return minor_of(difference(a[i], c[i]), difference(a[j], c[j]), difference(b[i], c[i]),
                  difference(b[j], c[j]))
      .sign();
}

/// Two axes onto which a triangle projects with the most area.
std::array<std::size_t, 2> widest_axes(const TriangleCorners& t) {
  const Point3 n = vec::cross(vec::sub(t[1], t[0]), vec::sub(t[2], t[0]));
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (std::abs(n[i]) > std::abs(n[largest])) largest = i;
  }
  return {(largest + 1) % 3, (largest + 2) % 3};
}

/// p lies on the segment a-b, given that the three are in line.
bool between(const Point3& a, const Point3& b, const Point3& p) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (p[k] < std::min(a[k], b[k]) || p[k] > std::max(a[k], b[k])) return false;
  }
  return true;
}

/// All in one plane, seen along its normal.
bool flat_segment_meets(const Point3& p, const Point3& q, const TriangleCorners& t) {
  const auto [i, j] = widest_axes(t);
  const int whole = turn_sign(t[0], t[1], t[2], i, j);
  bool holds_p = whole != 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point3 &a = t[k], &b = t[(k + 1) % 3];
    const int pa = turn_sign(a, b, p, i, j), qa = turn_sign(a, b, q, i, j);
    const int ap = turn_sign(p, q, a, i, j), bp = turn_sign(p, q, b, i, j);
    if (pa * qa < 0 && ap * bp < 0) return true;
    if (pa == 0 && between(a, b, p)) return true;
    if (qa == 0 && between(a, b, q)) return true;
    if (ap == 0 && between(p, q, a)) return true;
    if (pa * whole < 0) holds_p = false;
  }
  return holds_p;
}

bool segment_meets(const Point3& p, const Point3& q, const TriangleCorners& t) {
  const int at_p = side_of_plane(t[0], t[1], t[2], p);
  const int at_q = side_of_plane(t[0], t[1], t[2], q);
  if (at_p * at_q > 0) return false;
  if (at_p == 0 && at_q == 0) return flat_segment_meets(p, q, t);
  int positive = 0, negative = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const int s = side_of_plane(p, q, t[k], t[(k + 1) % 3]);
    positive += s > 0 ? 1 : 0;
    negative += s < 0 ? 1 : 0;
  }
  return positive == 0 || negative == 0;
}

/// Through the inside of the triangle, by more than rounding.
bool segment_crosses(const Point3& p, const Point3& q, const TriangleCorners& t) {
  if (clear_side(t[0], t[1], t[2], p) * clear_side(t[0], t[1], t[2], q) >= 0) return false;
  const int side = clear_side(p, q, t[0], t[1]);
  return side != 0 && side == clear_side(p, q, t[1], t[2]) && side == clear_side(p, q, t[2], t[0]);
}

/// An edge of one triangle and the other triangle: any of the six for which `meets` says so.
template <class Meets>
bool any_edge(const TriangleCorners& s, const TriangleCorners& t, const Meets& meets) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (meets(s[k], s[(k + 1) % 3], t) || meets(t[k], t[(k + 1) % 3], s)) return true;
  }
  return false;
}

bool boxes_meet(const TriangleCorners& s, const TriangleCorners& t) {
  vec::Box a, b;
  for (const Point3& p : s) a.include(p);
  for (const Point3& p : t) b.include(p);
  return a.meets(b);
}

/// high + low, good to twice the precision of a double.
Pair added(const Pair& a, const Pair& b) {
  const Pair s = two_sum(a.high, b.high);
  const Pair rest = two_sum(s.high, s.low + (a.low + b.low));
  return rest;
}

Pair multiplied(const Pair& a, const Pair& b) {
  const Pair p = two_product(a.high, b.high);
  return two_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

}  // namespace

int side_of_plane(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  const int side = clear_side(a, b, c, d);
  return side != 0 ? side : exact_side(a, b, c, d);
}

bool triangles_cross(const TriangleCorners& s, const TriangleCorners& t) {
  return boxes_meet(s, t) && any_edge(s, t, segment_crosses);
}

bool triangles_meet(const TriangleCorners& s, const TriangleCorners& t) {
  return boxes_meet(s, t) && any_edge(s, t, segment_meets);
}

Point3 exact_twice_area(const Point3* corners, std::size_t count) {
  std::array<Pair, 3> sum{};
  const Point3& o = corners[0];
  for (std::size_t i = 1; i + 1 < count; ++i) {
    std::array<Pair, 3> u{}, v{};
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] = two_sum(corners[i][k], -o[k]);
      v[k] = two_sum(corners[i + 1][k], -o[k]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      const Pair right = multiplied(u[m], v[l]);
      sum[k] = added(sum[k], added(multiplied(u[l], v[m]), {-right.high, -right.low}));
    }
  }
  return {sum[0].high, sum[1].high, sum[2].high};
}

}  // namespace haptic::tools
