// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/tools/polyhedron/families.hpp"
#include "tests/tools/pruning/contact_sampling.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools::test {
namespace {

constexpr std::uint64_t kEnvelopeSeed = 811;

/// An L of two pieces in the hand, over a plate with a polygonal hole; about 0.1 m.
SceneDescription l_over_plate(std::size_t corners) {
  FlatBody l = l_prism(general_map(1000));
  FlatBody plate = plate_with_hole(corners, AffineMap{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 40000});
  SceneDescription description = scene_of(prepared(l, "l"), prepared(plate, "plate"));
  description.moving.position_m = {0.01, -0.02, 0.2};
  description.moving.quaternion_wxyz = {0.5, -0.1, 0.7, std::sqrt(1 - 0.25 - 0.01 - 0.49)};
  description.statics[0].quaternion_wxyz = {0.8, 0.6, 0.0, 0.0};
  return description;
}

/// Points of a set by brute force: combinations of its corners.
Direction random_in(const std::vector<Direction>& corners, TestRandom& random) {
  Point3 sum{0, 0, 0};
  for (const Direction& c : corners) {
    sum = vec::add(sum, vec::scaled(c, std::pow(random.uniform(), 3.0)));
  }
  return vec::unit(sum);
}

/// Three directions in a cap about a random one.
std::vector<Direction> random_triangle(TestRandom& random) {
  const Direction middle = random_direction(random);
  std::vector<Direction> corners;
  for (int k = 0; k < 3; ++k) {
    corners.push_back(vec::unit(vec::add(middle, vec::scaled(random_direction(random), 0.8))));
  }
  if (vec::dot(vec::cross(corners[0], corners[1]), corners[2]) < 0) {
    std::swap(corners[0], corners[1]);
  }
  return corners;
}

/// {n : n.d <= 0} of the triangle's sides.
SphericalPolygon polygon_of(const std::vector<Direction>& corners) {
  std::vector<Direction> sides;
  for (std::size_t k = 0; k < 3; ++k) {
    sides.push_back(vec::scaled(vec::unit(vec::cross(corners[k], corners[(k + 1) % 3])), -1.0));
  }
  return spherical_polygon(sides);
}

}  // namespace

TEST_SUITE("tools.pruning_envelope") {
  TEST_CASE("angles between points, arcs and polygons are least over sampled members") {
    TestRandom random(kEnvelopeSeed);
    CAPTURE(kEnvelopeSeed);
    for (int trial = 0; trial < 200; ++trial) {
      const std::vector<Direction> t = random_triangle(random), u = random_triangle(random);
      const SphericalPolygon polygon = polygon_of(t);
      REQUIRE(polygon.corners.size() == 3);
      const SphericalArc a = spherical_arc(t[0], t[1]), b = spherical_arc(u[0], u[1]);
      const Direction p = random_direction(random);
      double to_polygon = 4, to_arc = 4, between = 4;
      for (int k = 0; k < 4000; ++k) {
        to_polygon = std::min(to_polygon, angle_between(p, random_in(t, random)));
        const Direction on_a = random_in({t[0], t[1]}, random);
        to_arc = std::min(to_arc, angle_between(p, on_a));
        between = std::min(between, angle_between(on_a, random_in({u[0], u[1]}, random)));
      }
      // Never above a sample; below the best of them by the density of the samples at most.
      CHECK(angle_to(p, polygon) <= to_polygon + 1e-7);
      CHECK(angle_to(p, polygon) >= to_polygon - 0.1);
      CHECK(angle_to(p, a) <= to_arc + 1e-7);
      CHECK(angle_to(p, a) >= to_arc - 0.02);
      CHECK(angle_to(a, b) <= between + 1e-7);
      CHECK(angle_to(a, b) >= between - 0.1);
      CHECK(angle_to(random_in(t, random), polygon) == 0.0);
    }
  }

  TEST_CASE("angles in closed form") {
    const Direction x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    const SphericalArc arc = spherical_arc(x, y);
    CHECK(angle_to(z, arc) == doctest::Approx(std::numbers::pi / 2));
    CHECK(angle_to(vec::scaled(x, -1), arc) == doctest::Approx(std::numbers::pi / 2));
    CHECK(angle_to(vec::unit({1, 1, 1}), arc) == doctest::Approx(std::asin(1 / std::sqrt(3.0))));
    const SphericalPolygon octant = polygon_of({x, y, z});
    CHECK(angle_to(vec::scaled(x, -1), octant) == doctest::Approx(std::numbers::pi / 2));
    CHECK(angle_to(vec::unit({-1, -1, -1}), octant) ==
          doctest::Approx(std::acos(-1 / std::sqrt(3.0))));
    CHECK(angle_to(vec::unit({1, 1, 1}), octant) == 0.0);
    CHECK(angle_to(spherical_arc(vec::unit({1, 1, 1}), vec::unit({1, 1, -1})), arc) == 0.0);
  }

  TEST_CASE("no envelope, or one of a half turn: every node is reachable") {
    SceneDescription description = l_over_plate(5);
    for (const bool given : {false, true}) {
      if (given) description.orientation = about_start(description, std::numbers::pi);
      const PruningAccount account = prune_scene(description);
      CHECK(account.counts.reachable == account.counts.nodes);
      CHECK(account.counts.live == account.counts.open);
      CHECK(account.counts.open.all() < account.counts.nodes.all());
    }
  }

  TEST_CASE("sampled orientations: nothing that applies is lost, nearly all that is kept applies") {
    for (const double angle_rad : {0.05, 0.35, 1.2}) {
      SceneDescription description = l_over_plate(7);
      description.orientation = about_start(description, angle_rad);
      const PrunedScene scene = pruned(std::move(description));
      const OccurrenceCount count =
          count_occurrences(scene, *scene.description.orientation, 1500, kEnvelopeSeed);
      CAPTURE(angle_rad);
      CAPTURE(kEnvelopeSeed);
      MESSAGE(angle_rad << " rad: " << count.occurrences << " applicable, occurred of the kept "
                        << count.kept_share);
      CHECK(count.lost == 0);
      CHECK(count.kept_share > 0.9);
      // The tester sees what an envelope a tenth too narrow loses. About parts that stand in
      // general position nothing comes in between 0.045 and 0.05 rad.
      if (angle_rad < 0.1) continue;
      const PrunedScene narrow = [&] {
        SceneDescription d = scene.description;
        d.orientation->max_angle_rad = 0.9 * angle_rad;
        return pruned(std::move(d));
      }();
      CHECK(count_occurrences(narrow, *scene.description.orientation, 1500, kEnvelopeSeed).lost >
            0);
    }
  }

  TEST_CASE("random rays from outside and out of the hole first touch a live node") {
    SceneDescription description = l_over_plate(6);
    description.orientation = about_start(description, 0.6);
    const PrunedScene scene = pruned(std::move(description));
    const OrientationEnvelope envelope = *scene.description.orientation;
    CAPTURE(kEnvelopeSeed);
    const TouchCount count = count_touches(scene, envelope, 200, 100, kEnvelopeSeed);
    MESSAGE(count.touches << " touches");
    CHECK(count.touches > 5000);
    CHECK(count.dropped == 0);
    for (std::size_t piece = 0; piece < scene.fixed.size(); ++piece) {
      CAPTURE(piece);
      CHECK(count_touches(scene, envelope, 200, 100, kEnvelopeSeed, piece).dropped > 0);
    }
    PrunedScene narrow = scene;
    narrow.description.orientation->max_angle_rad = 0.5;
    narrow = pruned(std::move(narrow.description));
    CHECK(count_touches(narrow, envelope, 200, 100, kEnvelopeSeed).dropped > 0);
  }

  TEST_CASE("--no-prune keeps all") {
    SceneDescription description = l_over_plate(4);
    description.orientation = about_start(description, 0.2);
    description.prune = false;
    const PruningAccount account = prune_scene(description);
    CHECK(description.marks.empty());
    CHECK(description.exposure.empty());
    CHECK(account.counts.live == account.counts.nodes);
    CHECK(account.live_percent() == 100.0);
  }
}

}  // namespace haptic::tools::test
