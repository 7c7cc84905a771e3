// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <string>

#include "tests/tools/polyhedron/flatten_checks.hpp"
#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {
namespace {

using parts::contains;
using parts::Part;
using parts::Random;
using parts::refusal;

TEST_SUITE("tools.flatten_refusals") {
  TEST_CASE("flatten: too many reflex edges are refused with count, limit and fix") {
    const Surface s = parts::surface_of({parts::prism(parts::star_outline(301, 1.0, 0.9), 0, 0.3)});
    const std::string text = refusal(s);
    CHECK(contains(text, "part.obj: 301 reflex edges, limit 300"));
    CHECK(contains(text, "--max-reflex"));
    FlattenLimits more;
    more.max_reflex_edges = 301;
    CHECK(refusal(s, more) == "accepted");
  }

  TEST_CASE("flatten: a face that is not flat is refused with its place") {
    Part part = parts::box({0, 0, 0}, {1, 1, 1});
    part.vertices[6][2] += 0.01;
    const std::string text = refusal(parts::surface_of({part}));
    CHECK(contains(text, "is not flat: corner would move by"));
    CHECK(contains(text, "(limit"));
    CHECK(contains(text, "split the face into triangles"));
  }

  TEST_CASE("flatten: sheets thinner than the tolerance are refused") {
    const Surface sheet = parts::surface_of({parts::box({0, 0, 0}, {1, 1, 2e-6})});
    CHECK(contains(refusal(sheet), "thinner than the plane tolerance"));
    // A fin of half a tolerance on a box.
    const double t = 3e-6;
    const Part fin = parts::prism(
        {{0, 0}, {2, 0}, {2, 1}, {1 + t, 1}, {1 + t, 2}, {1, 2}, {1, 1}, {0, 1}}, 0, 1);
    CHECK(contains(refusal(parts::surface_of({fin}, 2 * t)), "thinner than the plane tolerance"));
  }

  TEST_CASE("flatten: bits over the limit are refused, naming the place") {
    Random random(18);
    Part part =
        parts::loft({parts::ring(7, 0.4, 0.0), parts::ring(7, 0.5, 0.2), parts::ring(7, 0.3, 0.8)});
    part.transform(parts::random_rotation(random), 1.0, {0, 0, 0}).print(6);
    FlattenLimits few;
    few.first_bits = 40;
    few.max_bits = 60;
    CHECK(contains(refusal(parts::surface_of({part}), few),
                   "coordinates need more than 60 bits near ("));
  }

  TEST_CASE("realise: an over-determined core is reported as stuck") {
    // Four corners on all of five planes of general position: no order resolves it.
    CornerPlaneGraph graph;
    Random random(20);
    for (int k = 0; k < 5; ++k) {
      WantedPlane plane;
      plane.normal =
          vec::unit({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
      graph.planes.push_back(plane);
    }
    for (int k = 0; k < 4; ++k) {
      graph.corners.push_back(
          {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
      graph.corner_planes.push_back({0, 1, 2, 3, 4});
    }
    const Realisation stuck = realise(graph, {});
    CHECK(stuck.outcome == RealiseOutcome::kStuck);
    CHECK(stuck.stuck_count == 9);
  }
}

}  // namespace
}  // namespace haptic::tools
