// SPDX-License-Identifier: Apache-2.0
#include "tests/support/qp_problems.hpp"

#include <cmath>

namespace haptic::test {
namespace {

Point tilted(Random& random, Point n, double tilt_rad) {
  double length2 = 0;
  for (double& x : n) {
    x += random.uniform(-tilt_rad, tilt_rad);
    length2 += x * x;
  }
  for (double& x : n) x /= std::sqrt(length2);
  return n;
}

/// The rows n + s friction t for t along and across the way, s = -1 and 1.
void add_pyramid(std::vector<QpRow>& rows, const Point& n, const Point& lever_m, double gap_m,
                 const std::array<double, 6>& way_m, double friction) {
  const double up = n[0] * way_m[0] + n[1] * way_m[1] + n[2] * way_m[2];
  Point t{};
  double length2 = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    t[i] = way_m[i] - up * n[i];
    length2 += t[i] * t[i];
  }
  for (double& x : t) x /= std::sqrt(length2);
  const Point b{n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
  for (const Point& side : {t, b}) {
    for (const double s : {-friction, friction}) {
      const Point w{n[0] + s * side[0], n[1] + s * side[1], n[2] + s * side[2]};
      rows.push_back(qp_row(w, lever_m, gap_m, way_m));
    }
  }
}

}  // namespace

Point random_direction(Random& random) {
  for (;;) {
    Point n{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const double length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (length2 > 1 || length2 < 0.01) continue;
    for (double& x : n) x /= std::sqrt(length2);
    return n;
  }
}

QpRow qp_row(const Point& n, const Point& r, double gap_m, const std::array<double, 6>& way_m) {
  const std::array<double, 6> g = {n[0],
                                   n[1],
                                   n[2],
                                   (r[1] * n[2] - r[2] * n[1]) / kQpLever_m,
                                   (r[2] * n[0] - r[0] * n[2]) / kQpLever_m,
                                   (r[0] * n[1] - r[1] * n[0]) / kQpLever_m};
  QpRow row;
  double along = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    row.g[static_cast<Eigen::Index>(i)] = static_cast<Real>(g[i]);
    along += static_cast<double>(row.g[static_cast<Eigen::Index>(i)]) * way_m[i];
  }
  row.h = static_cast<Real>(-gap_m - along);
  return row;
}

std::vector<QpRow> make_qp(Random& random, const QpFamily& family) {
  std::array<double, 6> way_m{};
  for (double& x : way_m) x = random.uniform(-5e-3, 5e-3);
  std::vector<QpRow> rows;
  Point normal{};
  double gap_m = 0;
  for (int plane = 0; plane < family.planes; ++plane) {
    if (family.opposite && plane % 2 == 1) {
      for (double& x : normal) x = -x;
      gap_m = family.clearance_m - gap_m;
    } else {
      normal = random_direction(random);
      gap_m = random.uniform(0, family.clearance_m);
    }
    for (int point = 0; point < family.points; ++point) {
      const Point lever{random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04),
                        random.uniform(-0.04, 0.04)};
      for (int copy = 0; copy < family.copies; ++copy) {
        const Point n = family.tilt_rad > 0 ? tilted(random, normal, family.tilt_rad) : normal;
        if (family.friction > 0) {
          add_pyramid(rows, n, lever, gap_m, way_m, family.friction);
        } else {
          rows.push_back(qp_row(n, lever, gap_m, way_m));
        }
      }
    }
  }
  return rows;
}

}  // namespace haptic::test
