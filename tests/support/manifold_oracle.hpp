// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact region along a plane by its definition, in long double and over all vertices, for
/// comparison with contact_manifold.

#include <array>
#include <vector>

#include "rt_core/proxy/contact_manifold.hpp"
#include "tests/support/pair_bench.hpp"

namespace haptic::test {

using Exact = long double;
struct ExactPoint {
  Exact x = 0, y = 0;
};

/// A convex set of corners in order, counter-clockwise where it has an area; one corner is a point,
/// two are a segment.
using ExactPolygon = std::vector<ExactPoint>;

/// Distance from the set; 0 inside.
[[nodiscard]] Exact distance_from(const ExactPolygon& set, const ExactPoint& p);
/// Signed area.
[[nodiscard]] Exact area_of(const ExactPolygon& polygon);
/// Convex hull of any points, counter-clockwise.
[[nodiscard]] ExactPolygon hull_of(ExactPolygon points);
/// Corners of the intersection of two such sets: corners of each within `slack` of the other,
/// crossings of their sides. Unordered; duplicates occur.
[[nodiscard]] ExactPolygon intersection_of(const ExactPolygon& a, const ExactPolygon& b,
                                           Exact slack);

/// The two features of a manifold along a plane and their heights over it. Coordinates in the plane
/// and heights are about the reference of B.
class ManifoldOracle {
 public:
  ManifoldOracle(const PairPose& pose, const PlaneId& id, const PlaneGap& gap, double height_m);

  [[nodiscard]] const ExactPolygon& feature_a() const { return a_.corners; }
  [[nodiscard]] const ExactPolygon& feature_b() const { return b_.corners; }
  /// A rule that chose a feature was within rounding of choosing otherwise.
  [[nodiscard]] bool doubtful() const { return doubtful_; }
  /// Spot of a point given about x_0^A in W axes, and its height along n.
  [[nodiscard]] ExactPoint spot(const Vec3& app_w) const;
  [[nodiscard]] Exact height(const Vec3& app_w) const;
  [[nodiscard]] Exact height_a(const ExactPoint& spot) const { return a_.height_at(spot); }
  [[nodiscard]] Exact height_b(const ExactPoint& spot) const { return b_.height_at(spot); }

 private:
  using Vector = Eigen::Matrix<long double, 3, 1>;
  struct Feature {
    ExactPolygon corners;
    std::vector<Exact> heights;
    [[nodiscard]] Exact height_at(const ExactPoint& spot) const;
  };

  [[nodiscard]] Feature feature_of(const PieceView& piece, bool is_a, std::uint32_t support,
                                   int forced_face, Exact height_m);
  [[nodiscard]] Vector point_of(const PieceView& piece, bool is_a, std::uint32_t v) const;

  Eigen::Matrix<long double, 3, 3> r_;
  Vector y_, n_, e1_, e2_;
  Feature a_, b_;
  bool doubtful_ = false;
};

/// Every plane that the pair can have: its faces and its pairs of edges, either way round.
[[nodiscard]] std::vector<PlaneId> all_planes(const PairView& pair);

}  // namespace haptic::test
