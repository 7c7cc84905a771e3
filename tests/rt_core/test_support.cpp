// SPDX-License-Identifier: Apache-2.0
// Support vertices of solids, which have lanes, and of facets, which have none.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "rt_core/contact/support.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

tools::Body round_facet(int corners) {
  std::vector<Point> points;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * 3.14159265358979323846 * k / corners;
    points.push_back({0.02 * std::cos(angle), 0.03 * std::sin(angle), 0});
  }
  return facet(points);
}

Vec3 random_unit(Random& random) {
  const auto number = [&] { return static_cast<Real>(random.uniform(-1, 1)); };
  return Vec3(number(), number(), number()).normalized();
}

/// The height that a vertex has is that of the highest.
void check_highest(const PieceView& piece, const LanePoints& points, const Vec3& n,
                   std::uint32_t found) {
  Real highest = n.dot(points.at(0));
  for (std::uint32_t v = 1; v < piece.vertex_count; ++v)
    highest = std::max(highest, n.dot(points.at(v)));
  CHECK(n.dot(points.at(found)) >= highest - 1e-6_r * static_cast<Real>(piece.record->radius_m));
}

}  // namespace

TEST_SUITE("rt_core.support") {
  TEST_CASE("the highest vertex of a facet, where it is and turned, few corners and many") {
    for (const int corners : {3, 4, 7, 24, 25, 60}) {
      CAPTURE(corners);
      tools::SceneDescription description =
          scene_of(round_facet(corners), {box({-1, -1, -2}, {1, 1, -1})});
      description.parameters.law = LawId::kProxy;
      description.parameters.goal_contact = 0;
      const LoadedScene scene(description);
      const PieceView piece = scene.view.piece(0);
      REQUIRE(piece.is_facet());
      REQUIRE(piece.lanes == nullptr);
      std::vector<Real> own(3 * std::size_t{piece.lane_count}), turned(own.size());
      turn_vertices(piece, Mat3::Identity(), own.data());
      Random random(static_cast<std::uint64_t>(corners));
      for (int trial = 0; trial < 50; ++trial) {
        const Vec3 n = random_unit(random);
        const auto start = static_cast<std::uint32_t>(trial % corners);
        const LanePoints points = lane_points(piece, own.data());
        const std::uint32_t found = highest_vertex(piece, n, start);
        CHECK(found == highest_vertex(piece, points, n, start));
        check_highest(piece, points, n, found);
        const Mat3 r =
            Quat::FromTwoVectors(random_unit(random), random_unit(random)).toRotationMatrix();
        turn_vertices(piece, r, turned.data());
        const LanePoints at = lane_points(piece, turned.data());
        for (std::uint32_t k = 0; k < at.count; ++k) {
          const Vec3 expected = r * piece.vertex(k < piece.vertex_count ? k : 0);
          CHECK((at.at(k) - expected).norm() < 1e-7_r);
        }
        check_highest(piece, at, n, highest_vertex(piece, at, n, start));
      }
    }
  }

  TEST_CASE("a solid's own vertices are those of its lanes") {
    const LoadedScene scene(
        scene_of(random_hull(7, 40, {0.02, 0.01, 0.03}), {box({-1, -1, -2}, {1, 1, -1})}));
    const PieceView piece = scene.view.piece(0);
    Random random(9);
    for (int trial = 0; trial < 50; ++trial) {
      const Vec3 n = random_unit(random);
      CHECK(highest_vertex(piece, n, 0) == highest_vertex(piece, lane_points(piece), n, 0));
    }
  }
}
