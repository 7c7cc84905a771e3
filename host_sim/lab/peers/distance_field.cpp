// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace haptic::sim {
namespace {

constexpr double kOutwards_m = 1e-7;  ///< by which a face is moved to see what covers it
constexpr double kSliver_m2 = 1e-16;
constexpr std::uint32_t kLeafPoints = 16;

struct HalfSpace {
  Vector normal;
  double offset_m;
};
using Polygon = std::vector<Vector>;

Vector normal_of(const Polygon& polygon) {
  Vector normal = Vector::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k)
    normal += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  return normal;
}

Polygon face_of(const PeerSolid& solid, const std::vector<std::uint32_t>& loop) {
  Polygon face;
  for (const std::uint32_t v : loop)
    face.emplace_back(solid.vertices[v][0], solid.vertices[v][1], solid.vertices[v][2]);
  return face;
}

/// Parts of a convex polygon below and above a plane.
std::pair<Polygon, Polygon> divided(const Polygon& polygon, const HalfSpace& by) {
  std::pair<Polygon, Polygon> parts;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vector &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
    const double at_a = by.normal.dot(a) - by.offset_m, at_b = by.normal.dot(b) - by.offset_m;
    (at_a <= 0 ? parts.first : parts.second).push_back(a);
    if ((at_a <= 0) == (at_b <= 0)) continue;
    const Vector cut = a + (b - a) * (at_a / (at_a - at_b));
    parts.first.push_back(cut);
    parts.second.push_back(cut);
  }
  return parts;
}

/// Adds the parts of a face that are not covered by the solid of these half spaces.
void add_uncovered(Polygon face, const std::vector<HalfSpace>& cover, const Vector& normal,
                   std::vector<Polygon>& out) {
  std::vector<Polygon> outside;
  const Polygon whole = face;
  for (const HalfSpace& h : cover) {
    const HalfSpace moved{h.normal, h.offset_m - kOutwards_m * h.normal.dot(normal)};
    auto [below, above] = divided(face, moved);
    if (above.size() > 2 && normal_of(above).norm() > kSliver_m2)
      outside.push_back(std::move(above));
    face = std::move(below);
    if (face.size() < 3 || normal_of(face).norm() <= kSliver_m2) {
      out.push_back(whole);
      return;
    }
  }
  out.insert(out.end(), outside.begin(), outside.end());
}

}  // namespace

std::vector<SurfaceTriangle> boundary_of(std::span<const PeerSolid> solids) {
  std::vector<std::vector<HalfSpace>> covers;
  for (const PeerSolid& solid : solids) {
    covers.emplace_back();
    for (const auto& loop : solid.loops) {
      const Polygon face = face_of(solid, loop);
      const Vector normal = normal_of(face).normalized();
      covers.back().push_back({normal, normal.dot(face[0])});
    }
  }
  std::vector<SurfaceTriangle> triangles;
  for (std::size_t k = 0; k < solids.size(); ++k) {
    for (std::size_t f = 0; f < solids[k].loops.size(); ++f) {
      std::vector<Polygon> parts{face_of(solids[k], solids[k].loops[f])};
      for (std::size_t other = 0; other < solids.size(); ++other) {
        if (other == k) continue;
        std::vector<Polygon> left;
        for (Polygon& part : parts)
          add_uncovered(std::move(part), covers[other], covers[k][f].normal, left);
        parts = std::move(left);
      }
      for (const Polygon& part : parts) {
        for (std::size_t j = 2; j < part.size(); ++j)
          triangles.push_back({part[0], part[j - 1], part[j]});
      }
    }
  }
  return triangles;
}

// C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
Vector closest_point_of(const SurfaceTriangle& t, const Vector& p) {
  const Vector ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return t[0];
  const Vector bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + ab * (d1 / (d1 - d3));
  const Vector cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return t[1] + (t[2] - t[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double scale = 1 / (va + vb + vc);
  return t[0] + ab * (vb * scale) + ac * (vc * scale);
}

DistanceField::DistanceField(std::span<const SurfaceTriangle> surface, const SpaceBox& box,
                             double step_m)
    // Off the round numbers of drawings, so that no column of the grid goes through an edge.
    : low_(box.low - step_m * Vector(0.37139, 0.41421, 0.31831)), step_m_(step_m) {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    count_[i] = static_cast<std::size_t>(std::ceil((box.high[axis] - low_[axis]) / step_m)) + 1;
  }
  values_.assign(count_[0] * count_[1] * count_[2], static_cast<float>(band_m()));
  std::vector<std::vector<float>> crossings(count_[0] * count_[1]);
  for (const SurfaceTriangle& t : surface) {
    add_distances(t);
    add_crossings(t, crossings);
  }
  // Inside where a column has crossed the surface an odd number of times.
  for (std::size_t column = 0; column < crossings.size(); ++column) {
    std::vector<float>& heights = crossings[column];
    std::ranges::sort(heights);
    std::size_t below = 0;
    for (std::size_t k = 0; k < count_[2]; ++k) {
      const auto z = static_cast<float>(static_cast<double>(k) * step_m_);
      while (below < heights.size() && heights[below] < z) ++below;
      float& value = values_[column * count_[2] + k];
      if (below % 2 == 1) value = -value;
    }
  }
}

Vector DistanceField::place(std::size_t sample) const {
  const std::size_t z = sample % count_[2], xy = sample / count_[2];
  return low_ + step_m_ * Vector(static_cast<double>(xy / count_[1]),
                                 static_cast<double>(xy % count_[1]), static_cast<double>(z));
}

std::size_t DistanceField::nearest(const Vector& p) const {
  std::array<std::size_t, 3> at{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double steps = (p[axis] - low_[axis]) / step_m_ + 0.5;
    if (!(steps >= 0) || steps >= static_cast<double>(count_[i])) return kOutside;
    at[i] = static_cast<std::size_t>(steps);
  }
  return (at[0] * count_[1] + at[1]) * count_[2] + at[2];
}

double DistanceField::at_least_m(const Vector& p) const {
  const std::size_t sample = nearest(p);
  if (sample == kOutside) return band_m();
  return static_cast<double>(values_[sample]) - (p - place(sample)).norm();
}

double DistanceField::between(const Vector& p, Vector& gradient) const {
  gradient.setZero();
  std::array<std::size_t, 3> at{};
  Vector share;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double steps = (p[axis] - low_[axis]) / step_m_;
    if (!(steps >= 0) || steps >= static_cast<double>(count_[i] - 1)) return band_m();
    at[i] = static_cast<std::size_t>(steps);
    share[axis] = steps - static_cast<double>(at[i]);
  }
  const std::size_t dy = count_[2], dx = count_[1] * count_[2];
  const float* const v = &values_[at[0] * dx + at[1] * dy + at[2]];
  const auto along = [](double low, double high, double s) { return low + s * (high - low); };
  const auto corner = [&](std::size_t x, std::size_t y, std::size_t z) {
    return static_cast<double>(v[x * dx + y * dy + z]);
  };
  double edge[2][2], slope_z[2][2];
  for (std::size_t x = 0; x < 2; ++x) {
    for (std::size_t y = 0; y < 2; ++y) {
      edge[x][y] = along(corner(x, y, 0), corner(x, y, 1), share[2]);
      slope_z[x][y] = corner(x, y, 1) - corner(x, y, 0);
    }
  }
  const double low = along(edge[0][0], edge[0][1], share[1]);
  const double high = along(edge[1][0], edge[1][1], share[1]);
  gradient[0] = high - low;
  gradient[1] = along(edge[0][1] - edge[0][0], edge[1][1] - edge[1][0], share[0]);
  gradient[2] = along(along(slope_z[0][0], slope_z[0][1], share[1]),
                      along(slope_z[1][0], slope_z[1][1], share[1]), share[0]);
  gradient /= step_m_;
  return along(low, high, share[0]);
}

void DistanceField::add_distances(const SurfaceTriangle& t) {
  SpaceBox box;
  for (const Vector& corner : t) box.include(corner);
  std::array<std::size_t, 3> from{}, to{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double low = std::ceil((box.low[axis] - band_m() - low_[axis]) / step_m_);
    const double high = std::floor((box.high[axis] + band_m() - low_[axis]) / step_m_);
    if (high < 0 || low >= static_cast<double>(count_[i])) return;
    from[i] = static_cast<std::size_t>(std::max(0.0, low));
    to[i] = std::min(count_[i] - 1, static_cast<std::size_t>(high));
  }
  const Vector normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  for (std::size_t x = from[0]; x <= to[0]; ++x) {
    for (std::size_t y = from[1]; y <= to[1]; ++y) {
      for (std::size_t z = from[2]; z <= to[2]; ++z) {
        const Vector p = low_ + step_m_ * Vector(static_cast<double>(x), static_cast<double>(y),
                                                 static_cast<double>(z));
        float& value = values_[(x * count_[1] + y) * count_[2] + z];
        if (std::abs(normal.dot(p - t[0])) >= static_cast<double>(value)) continue;
        value = std::min(value, static_cast<float>((p - closest_point_of(t, p)).norm()));
      }
    }
  }
}

void DistanceField::add_crossings(const SurfaceTriangle& t,
                                  std::vector<std::vector<float>>& crossings) const {
  const Vector u = t[1] - t[0], v = t[2] - t[0];
  const double area = u[0] * v[1] - u[1] * v[0];
  if (area == 0) return;
  SpaceBox box;
  for (const Vector& corner : t) box.include(corner);
  const auto bound = [&](double value, Eigen::Index axis, std::size_t count) {
    return static_cast<std::size_t>(
        std::clamp((value - low_[axis]) / step_m_ + 1, 0.0, static_cast<double>(count)));
  };
  const std::size_t x_end = bound(box.high[0], 0, count_[0]);
  const std::size_t y_end = bound(box.high[1], 1, count_[1]);
  for (std::size_t x = bound(box.low[0], 0, count_[0]); x < x_end; ++x) {
    for (std::size_t y = bound(box.low[1], 1, count_[1]); y < y_end; ++y) {
      const double px = low_[0] + step_m_ * static_cast<double>(x) - t[0][0];
      const double py = low_[1] + step_m_ * static_cast<double>(y) - t[0][1];
      const double s = (px * v[1] - py * v[0]) / area, r = (u[0] * py - u[1] * px) / area;
      if (s < 0 || r < 0 || s + r > 1) continue;
      crossings[x * count_[1] + y].push_back(
          static_cast<float>(t[0][2] + s * u[2] + r * v[2] - low_[2]));
    }
  }
}

std::vector<ShellPoint> point_shell(std::span<const SurfaceTriangle> surface, double spacing_m) {
  std::vector<ShellPoint> points;
  std::set<std::array<int, 6>> taken;
  const auto add = [&](const Vector& p, const Vector& normal) {
    constexpr double kNormals = 50;  // of points in one cell that count as different
    std::array<int, 6> cell{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      cell[i] = static_cast<int>(std::floor(p[axis] / spacing_m));
      cell[3 + i] = static_cast<int>(std::lround(kNormals * normal[axis]));
    }
    if (taken.insert(cell).second) points.push_back({p.cast<float>(), normal.cast<float>()});
  };
  const auto add_between = [&](const Vector& from, const Vector& to, const Vector& normal) {
    const auto steps = static_cast<std::size_t>(std::ceil((to - from).norm() / spacing_m));
    for (std::size_t k = 0; k <= steps; ++k)
      add(from + static_cast<double>(k) / std::max(1.0, static_cast<double>(steps)) * (to - from),
          normal);
  };
  const auto normal_of_triangle = [](const SurfaceTriangle& t) -> Vector {
    return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  };
  // Corners before edges before the rest: they are what touches first.
  for (const SurfaceTriangle& t : surface) {
    for (const Vector& corner : t) add(corner, normal_of_triangle(t));
  }
  for (const SurfaceTriangle& t : surface) {
    for (std::size_t k = 0; k < 3; ++k) add_between(t[k], t[(k + 1) % 3], normal_of_triangle(t));
  }
  for (const SurfaceTriangle& t : surface) {
    const double side = std::max((t[1] - t[0]).norm(), (t[2] - t[0]).norm());
    const auto rows = static_cast<std::size_t>(std::ceil(side / spacing_m));
    for (std::size_t row = 1; row < rows; ++row) {
      const double share = static_cast<double>(row) / static_cast<double>(rows);
      add_between(t[0] + share * (t[1] - t[0]), t[0] + share * (t[2] - t[0]),
                  normal_of_triangle(t));
    }
  }
  return points;
}

PointTree::PointTree(std::vector<ShellPoint> points) : points_(std::move(points)) {
  for (const ShellPoint& point : points_)
    radius_m_ = std::max(radius_m_, static_cast<double>(point.p.norm()));
  nodes_.push_back({Vector::Zero(), 0, 0, static_cast<std::uint32_t>(points_.size()), 0});
  for (std::uint32_t node = 0; node < nodes_.size(); ++node) build(node);
}

void PointTree::build(std::uint32_t node) {
  const std::uint32_t begin = nodes_[node].begin, end = nodes_[node].end;
  SpaceBox box;
  for (std::uint32_t k = begin; k < end; ++k) box.include(points_[k].p.cast<double>());
  const Vector centre = (box.low + box.high) / 2;
  double radius = 0;
  for (std::uint32_t k = begin; k < end; ++k)
    radius = std::max(radius, (points_[k].p.cast<double>() - centre).norm());
  nodes_[node].centre = centre;
  nodes_[node].radius_m = radius;
  if (end - begin <= kLeafPoints) return;
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const std::uint32_t middle = (begin + end) / 2;
  const auto at = [&](std::uint32_t k) { return points_.begin() + k; };
  std::nth_element(at(begin), at(middle), at(end),
                   [&](const ShellPoint& a, const ShellPoint& b) { return a.p[axis] < b.p[axis]; });
  nodes_[node].child = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({Vector::Zero(), 0, begin, middle, 0});
  nodes_.push_back({Vector::Zero(), 0, middle, end, 0});
}

bool PointTree::is_near(std::span<const DistanceField> fields, const Vector& at, double within_m) {
  for (const DistanceField& field : fields) {
    // The finest that can tell: its band is wider than the ball, or there is none coarser.
    if (field.band_m() < within_m + field.step_m() && &field != &fields.back()) continue;
    return field.at_least_m(at) < within_m;
  }
  return true;
}

}  // namespace haptic::sim
