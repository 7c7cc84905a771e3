// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/random_scenes/mesh_oracle.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>

namespace haptic::tools::test {

namespace {

using Exact = boost::multiprecision::cpp_rational;

// Relative error of the determinant in double, with room: 16 roundings of products of three.
constexpr double kFilter = 1.0e-14;

int exact_orientation(const OraclePoint& a, const OraclePoint& b, const OraclePoint& c,
                      const OraclePoint& d) {
  std::array<std::array<Exact, 3>, 3> m;
  for (std::size_t i = 0; i < 3; ++i) {
    m[0][i] = Exact(a[i]) - Exact(d[i]);
    m[1][i] = Exact(b[i]) - Exact(d[i]);
    m[2][i] = Exact(c[i]) - Exact(d[i]);
  }
  const Exact det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                    m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                    m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return det > 0 ? 1 : det < 0 ? -1 : 0;
}

/// Sign of the turn a, b, c seen along axis `drop`, exact.
int turn_along(std::size_t drop, const OraclePoint& a, const OraclePoint& b, const OraclePoint& c) {
  const std::size_t x = (drop + 1) % 3, y = (drop + 2) % 3;
  const double left = (b[x] - a[x]) * (c[y] - a[y]), right = (b[y] - a[y]) * (c[x] - a[x]);
  if (std::abs(left - right) > kFilter * (std::abs(left) + std::abs(right))) {
    return left > right ? 1 : -1;
  }
  const Exact det = (Exact(b[x]) - Exact(a[x])) * (Exact(c[y]) - Exact(a[y])) -
                    (Exact(b[y]) - Exact(a[y])) * (Exact(c[x]) - Exact(a[x]));
  return det > 0 ? 1 : det < 0 ? -1 : 0;
}

/// Axis along which the triangle has an area, exact.
std::size_t clear_axis(const OraclePoint& a, const OraclePoint& b, const OraclePoint& c) {
  for (std::size_t drop = 0; drop < 3; ++drop) {
    if (turn_along(drop, a, b, c) != 0) return drop;
  }
  return 0;
}

bool in_plane_triangle(std::size_t drop, const OraclePoint& p, const OraclePoint& a,
                       const OraclePoint& b, const OraclePoint& c) {
  const int s = turn_along(drop, a, b, p), t = turn_along(drop, b, c, p),
            u = turn_along(drop, c, a, p);
  return (s >= 0 && t >= 0 && u >= 0) || (s <= 0 && t <= 0 && u <= 0);
}

bool in_plane_segments(std::size_t drop, const OraclePoint& p, const OraclePoint& q,
                       const OraclePoint& a, const OraclePoint& b) {
  const int pa = turn_along(drop, p, q, a), pb = turn_along(drop, p, q, b);
  const int ap = turn_along(drop, a, b, p), aq = turn_along(drop, a, b, q);
  if (pa * pb > 0 || ap * aq > 0) return false;
  if (pa != 0 || pb != 0 || ap != 0 || aq != 0) return true;
  for (std::size_t i = 0; i < 3; ++i) {  // on one line
    if (std::max(p[i], q[i]) < std::min(a[i], b[i]) ||
        std::max(a[i], b[i]) < std::min(p[i], q[i])) {
      return false;
    }
  }
  return true;
}

/// Closed segment against closed triangle.
bool segment_meets(const OraclePoint& p, const OraclePoint& q, const OraclePoint& a,
                   const OraclePoint& b, const OraclePoint& c, OracleCounts& counts) {
  const int at_p = orientation(a, b, c, p, counts), at_q = orientation(a, b, c, q, counts);
  if (at_p * at_q > 0) return false;
  if (at_p == 0 && at_q == 0) {
    const std::size_t drop = clear_axis(a, b, c);
    return in_plane_triangle(drop, p, a, b, c) || in_plane_segments(drop, p, q, a, b) ||
           in_plane_segments(drop, p, q, b, c) || in_plane_segments(drop, p, q, c, a);
  }
  const int s = orientation(p, q, a, b, counts), t = orientation(p, q, b, c, counts),
            u = orientation(p, q, c, a, counts);
  return (s >= 0 && t >= 0 && u >= 0) || (s <= 0 && t <= 0 && u <= 0);
}

struct Bounds {
  OraclePoint low{}, high{};
};

Bounds bounds_of(const OracleMesh& mesh, const OracleTriangle& t) {
  Bounds b{mesh.points[t[0]], mesh.points[t[0]]};
  for (const std::uint32_t v : t) {
    for (std::size_t i = 0; i < 3; ++i) {
      b.low[i] = std::min(b.low[i], mesh.points[v][i]);
      b.high[i] = std::max(b.high[i], mesh.points[v][i]);
    }
  }
  return b;
}

bool apart(const Bounds& a, const Bounds& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (a.high[i] < b.low[i] || b.high[i] < a.low[i]) return true;
  }
  return false;
}

}  // namespace

int orientation(const OraclePoint& a, const OraclePoint& b, const OraclePoint& c,
                const OraclePoint& d, OracleCounts& counts) {
  ++counts.signs;
  double m[3][3];
  for (std::size_t i = 0; i < 3; ++i) {
    m[0][i] = a[i] - d[i];
    m[1][i] = b[i] - d[i];
    m[2][i] = c[i] - d[i];
  }
  double det = 0.0, size = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const double left = m[1][j] * m[2][k], right = m[1][k] * m[2][j];
    det += m[0][i] * (left - right);
    size += std::abs(m[0][i]) * (std::abs(left) + std::abs(right));
  }
  if (std::abs(det) > kFilter * size) return det > 0.0 ? 1 : -1;
  ++counts.exact;
  return exact_orientation(a, b, c, d);
}

bool is_inside(const OraclePoint& point, const OracleMesh& mesh, OracleCounts& counts) {
  std::uint64_t state = 0x9e3779b97f4a7c15ULL;
  const auto drawn = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 40U) / 16777216.0 - 0.5;
  };
  double reach = 1.0;
  for (const OraclePoint& p : mesh.points) {
    for (std::size_t i = 0; i < 3; ++i) reach = std::max(reach, 4.0 * std::abs(p[i] - point[i]));
  }
  while (true) {
    OraclePoint far{drawn(), drawn(), drawn()};
    double largest = 0.0;
    for (const double x : far) largest = std::max(largest, std::abs(x));
    if (largest < 0.1) continue;
    for (std::size_t i = 0; i < 3; ++i) far[i] = point[i] + 8.0 * reach * far[i] / largest;
    bool inside = false, clear = true;
    for (const OracleTriangle& t : mesh.triangles) {
      const OraclePoint& a = mesh.points[t[0]];
      const OraclePoint& b = mesh.points[t[1]];
      const OraclePoint& c = mesh.points[t[2]];
      const int s = orientation(point, far, a, b, counts),
                u = orientation(point, far, b, c, counts),
                w = orientation(point, far, c, a, counts);
      const bool passes = (s >= 0 && u >= 0 && w >= 0) || (s <= 0 && u <= 0 && w <= 0);
      if (!passes) continue;
      if (s == 0 || u == 0 || w == 0) {
        clear = false;
        break;
      }
      const int from = orientation(a, b, c, point, counts), to = orientation(a, b, c, far, counts);
      if (from * to < 0) inside = !inside;
    }
    if (clear) return inside;
  }
}

bool meshes_meet(const OracleMesh& a, const OracleMesh& b, OracleCounts& counts) {
  std::vector<Bounds> boxes;
  for (const OracleTriangle& t : b.triangles) boxes.push_back(bounds_of(b, t));
  for (const OracleTriangle& s : a.triangles) {
    const Bounds box = bounds_of(a, s);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      if (apart(box, boxes[k])) continue;
      const OracleTriangle& t = b.triangles[k];
      for (std::size_t i = 0; i < 3; ++i) {
        if (segment_meets(a.points[s[i]], a.points[s[(i + 1) % 3]], b.points[t[0]], b.points[t[1]],
                          b.points[t[2]], counts) ||
            segment_meets(b.points[t[i]], b.points[t[(i + 1) % 3]], a.points[s[0]], a.points[s[1]],
                          a.points[s[2]], counts)) {
          return true;
        }
      }
    }
  }
  // No borders meet: a whole shell of one is inside the other, or nothing is.
  const auto any_inside = [&](const OracleMesh& inner, const OracleMesh& outer) {
    OraclePoint low = outer.points[0], high = low;
    for (const OraclePoint& p : outer.points) {
      for (std::size_t i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], p[i]);
        high[i] = std::max(high[i], p[i]);
      }
    }
    return std::any_of(inner.points.begin(), inner.points.end(), [&](const OraclePoint& p) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (p[i] < low[i] || p[i] > high[i]) return false;
      }
      return is_inside(p, outer, counts);
    });
  };
  const OracleMesh first{{a.points[0]}, {}};  // one shell
  return any_inside(first, b) || any_inside(b, a);
}

}  // namespace haptic::tools::test
