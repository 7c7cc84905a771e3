// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <set>

#include "rt_core/scene/graph_rule.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

struct GraphFacts {
  std::uint32_t nodes, arcs, degree_a, degree_b, degree_c;
  bool symmetric;
};

GraphFacts facts(const tools::Body& a, const tools::Body& b) {
  const LoadedScene scene(scene_of(a, {b}));
  const PairView pair = scene.view.pair(0);
  GraphFacts f{pair.record->node_count, 0, 0, 0, 0, true};
  std::set<std::pair<std::uint32_t, std::uint32_t>> arcs;
  for (std::uint32_t node = 0; node < f.nodes; ++node) {
    const std::uint32_t degree = pair.neighbors.count(node);
    for (std::uint32_t k = 0; k < degree; ++k) arcs.insert({node, pair.neighbors.at(node, k)});
    std::uint32_t& largest = contact_type(*pair.record, node) == ContactType::kA   ? f.degree_a
                             : contact_type(*pair.record, node) == ContactType::kB ? f.degree_b
                                                                                   : f.degree_c;
    largest = std::max(largest, degree);
  }
  for (const auto& [from, to] : arcs) f.symmetric = f.symmetric && arcs.count({to, from}) == 1;
  f.arcs = static_cast<std::uint32_t>(arcs.size() / 2);
  return f;
}

}  // namespace

TEST_SUITE("rt_core.graph_rule") {
  TEST_CASE("tetrahedron and box: the 128 nodes of the paper, arcs both ways") {
    const GraphFacts f =
        facts(tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), box({0, 0, 0}, {1, 1, 1}));
    CHECK(f.nodes == 128);
    CHECK(f.arcs == 1332);
    CHECK(f.degree_a == 24);
    CHECK(f.degree_b == 31);
    CHECK(f.degree_c == 16);
    CHECK(f.symmetric);
  }

  TEST_CASE("larger pairs: node counts and largest degrees") {
    const GraphFacts boxes = facts(box({0, 0, 0}, {1, 1, 1}), box({0, 0, 0}, {1, 1, 1}));
    CHECK(boxes.nodes == 240);
    CHECK(std::max({boxes.degree_a, boxes.degree_b, boxes.degree_c}) == 31);
    const GraphFacts prism_box = facts(prism(12, 0.5, 1), box({0, 0, 0}, {1, 1, 1}));
    CHECK(prism_box.nodes == 688);
    CHECK(std::max({prism_box.degree_a, prism_box.degree_b, prism_box.degree_c}) == 87);
    CHECK(prism_box.symmetric);
  }
}
