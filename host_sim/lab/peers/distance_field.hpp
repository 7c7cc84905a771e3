// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A closed surface as samples: the signed distance on the points of a grid, and points with
/// normals on the surface itself. What voxmaps and pointshells are made of. SI units.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Counter-clockwise seen from outside.
using SurfaceTriangle = std::array<Vector, 3>;

struct SpaceBox {
  Vector low = Vector::Constant(std::numeric_limits<double>::infinity());
  Vector high = Vector::Constant(-std::numeric_limits<double>::infinity());
  void include(const Vector& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

/// The boundary of the union of convex solids which touch but do not overlap: seams are left out.
/// Cost: faces times solids times faces.
[[nodiscard]] std::vector<SurfaceTriangle> boundary_of(std::span<const PeerSolid> solids);

[[nodiscard]] Vector closest_point_of(const SurfaceTriangle& t, const Vector& p);

/// Distances at the points of a grid, exact within kBandSteps steps of the surface, beyond that the
/// band; negative inside.
class DistanceField {
 public:
  static constexpr double kBandSteps = 4;

  /// Over `box`. Cost: for every triangle the grid points in its box and the band around it, and
  /// one pass over all of them; 4 bytes each.
  DistanceField(std::span<const SurfaceTriangle> surface, const SpaceBox& box, double step_m);

  [[nodiscard]] double step_m() const { return step_m_; }
  [[nodiscard]] double band_m() const { return kBandSteps * step_m_; }
  [[nodiscard]] std::size_t samples() const { return values_.size(); }
  /// Number of the nearest grid point; kOutside outside of the box.
  static constexpr std::size_t kOutside = std::numeric_limits<std::size_t>::max();
  [[nodiscard]] std::size_t nearest(const Vector& p) const;
  [[nodiscard]] Vector place(std::size_t sample) const;
  [[nodiscard]] float value(std::size_t sample) const { return values_[sample]; }
  /// Never above the distance to the surface; outside the box, and far away, the band.
  [[nodiscard]] double at_least_m(const Vector& p) const;
  /// Between the eight grid points around; the band outside of the box. `gradient` is not of unit
  /// length.
  [[nodiscard]] double between(const Vector& p, Vector& gradient) const;

 private:
  void add_distances(const SurfaceTriangle& t);
  void add_crossings(const SurfaceTriangle& t, std::vector<std::vector<float>>& crossings) const;

  Vector low_;
  double step_m_;
  std::array<std::size_t, 3> count_{};
  std::vector<float> values_;
};

struct ShellPoint {
  Eigen::Vector3f p, normal;  ///< outwards
};

/// Points on every triangle about `spacing_m` apart, with its normal: one in each cell of that
/// edge, the corners of the surface and its edges first.
[[nodiscard]] std::vector<ShellPoint> point_shell(std::span<const SurfaceTriangle> surface,
                                                  double spacing_m);

/// Points in a tree of balls (Barbic and James 2008, section 4.2: nested point-trees), so that
/// those far from a surface are not looked at.
class PointTree {
 public:
  explicit PointTree(std::vector<ShellPoint> points);

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] double radius_m() const { return radius_m_; }  ///< about the origin
  /// Calls `visit(place about p, point)` with every point that may be closer to the surface than
  /// `reach_m`, or inside; the fields go from fine to coarse.
  template <typename Visit>
  void near(const Vector& p, const Eigen::Matrix3d& r, std::span<const DistanceField> fields,
            double reach_m, const Visit& visit) const;

 private:
  struct Node {
    Vector centre = Vector::Zero();
    double radius_m = 0;
    std::uint32_t begin = 0, end = 0;
    std::uint32_t child = 0;  ///< the first of two; 0: a leaf
  };
  void build(std::uint32_t node);
  static bool is_near(std::span<const DistanceField> fields, const Vector& at, double within_m);

  std::vector<ShellPoint> points_;
  std::vector<Node> nodes_;
  double radius_m_ = 0;
};

template <typename Visit>
void PointTree::near(const Vector& p, const Eigen::Matrix3d& r,
                     std::span<const DistanceField> fields, double reach_m,
                     const Visit& visit) const {
  constexpr std::size_t kDeepest = 64;
  std::array<std::uint32_t, kDeepest> open{};
  std::size_t count = 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (!is_near(fields, p + r * node.centre, node.radius_m + reach_m)) continue;
    if (node.child != 0) {
      open[count++] = node.child;
      open[count++] = node.child + 1;
      continue;
    }
    for (std::uint32_t k = node.begin; k < node.end; ++k) {
      visit(Vector(r * points_[k].p.cast<double>()), points_[k]);
    }
  }
}

}  // namespace haptic::sim
