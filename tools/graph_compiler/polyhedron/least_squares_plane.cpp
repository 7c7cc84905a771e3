// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/least_squares_plane.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "tools/graph_compiler/polyhedron/symmetric_axes.hpp"

namespace haptic::tools {

bool least_squares(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                   const Point3& like, FlatPlane& out) {
  Point3 mean{0, 0, 0};
  for (const std::uint32_t v : which) {
    for (std::size_t i = 0; i < 3; ++i) mean[i] += all[v][i];
  }
  mean = vec::scaled(mean, 1.0 / static_cast<double>(which.size()));
  std::array<std::array<double, 3>, 3> moments{};
  for (const std::uint32_t v : which) {
    const Point3 r = vec::sub(all[v], mean);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) moments[i][j] += r[i] * r[j];
    }
  }
  std::array<std::array<double, 3>, 3> vectors{};
  diagonalise(moments, vectors);
  std::array<std::size_t, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t i, std::size_t j) { return moments[i][i] < moments[j][j]; });
  const double largest = moments[order[2]][order[2]];
  if (!(moments[order[1]][order[1]] > 1e-18 * largest)) return false;
  out.n = {vectors[0][order[0]], vectors[1][order[0]], vectors[2][order[0]]};
  const double length = std::sqrt(vec::dot(out.n, out.n));
  out.n = vec::scaled(out.n, (vec::dot(out.n, like) < 0.0 ? -1.0 : 1.0) / length);
  out.d = vec::dot(out.n, mean);
  return true;
}

double largest_distance(const std::vector<Point3>& all, const std::vector<std::uint32_t>& which,
                        const FlatPlane& plane) {
  double largest = 0.0;
  for (const std::uint32_t v : which) largest = std::max(largest, plane.distance(all[v]));
  return largest;
}

double fine_distance(const Point3& n, const Point3& tail, const Point3& x, double d,
                     double d_tail) {
  double sum = -d;
  double low = -d_tail;
  for (std::size_t i = 0; i < 3; ++i) {
    const double product = n[i] * x[i];
    low += std::fma(n[i], x[i], -product) + tail[i] * x[i];
    const double next = sum + product;
    const double back = next - sum;
    low += (sum - (next - back)) + (product - back);
    sum = next;
  }
  return sum + low;
}

void refine(const std::vector<Point3>& all, FittedPlane& plane) {
  const Point3& n = plane.normal;
  const std::size_t least = std::abs(n[0]) <= std::abs(n[1]) && std::abs(n[0]) <= std::abs(n[2])
                                ? 0U
                            : std::abs(n[1]) <= std::abs(n[2]) ? 1U
                                                               : 2U;
  Point3 axis{0, 0, 0};
  axis[least] = 1.0;
  Point3 u = vec::cross(n, axis);
  u = vec::scaled(u, 1.0 / std::sqrt(vec::dot(u, u)));
  const Point3 w = vec::cross(n, u);
  const double count = static_cast<double>(plane.vertices.size());
  Point3 mean{0, 0, 0};
  for (const std::uint32_t v : plane.vertices) {
    for (std::size_t i = 0; i < 3; ++i) mean[i] += all[v][i] / count;
  }
  double uu = 0, uw = 0, ww = 0, ur = 0, wr = 0, mean_r = 0, mean_u = 0, mean_w = 0;
  for (const std::uint32_t v : plane.vertices) {
    const Point3 r = vec::sub(all[v], mean);
    const double residual = fine_distance(n, {0, 0, 0}, all[v], plane.offset_m, 0.0);
    const double ru = vec::dot(r, u), rw = vec::dot(r, w);
    uu += ru * ru, uw += ru * rw, ww += rw * rw, ur += ru * residual, wr += rw * residual;
    mean_r += residual / count, mean_u += ru / count, mean_w += rw / count;
  }
  uu -= count * mean_u * mean_u, uw -= count * mean_u * mean_w, ww -= count * mean_w * mean_w;
  ur -= count * mean_u * mean_r, wr -= count * mean_w * mean_r;
  const double det = uu * ww - uw * uw;
  if (!(det > 1e-18 * (uu + ww) * (uu + ww))) return;
  const double a = -(ww * ur - uw * wr) / det;
  const double b = -(uu * wr - uw * ur) / det;
  for (std::size_t i = 0; i < 3; ++i) plane.normal_tail[i] = a * u[i] + b * w[i];
  // The mean residual goes into the offset; the tilt turns about the mean of the vertices.
  plane.offset_tail_m = mean_r + vec::dot(plane.normal_tail, mean) + a * mean_u + b * mean_w;
}

}  // namespace haptic::tools
