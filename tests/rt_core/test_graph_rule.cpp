// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <set>
#include <vector>

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
  GraphFacts f{pair.record.node_count, 0, 0, 0, 0, true};
  std::set<std::pair<std::uint32_t, std::uint32_t>> arcs;
  for (std::uint32_t node = 0; node < f.nodes; ++node) {
    const std::uint32_t degree = pair.neighbors.count(node);
    for (std::uint32_t k = 0; k < degree; ++k) arcs.insert({node, pair.neighbors.at(node, k)});
    std::uint32_t& largest = contact_type(pair.record, node) == ContactType::kA   ? f.degree_a
                             : contact_type(pair.record, node) == ContactType::kB ? f.degree_b
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

  TEST_CASE("features of a node by arithmetic are those of the table") {
    const LoadedScene scene(scene_of(prism(5, 0.5, 1), {box({0, 0, 0}, {1, 1, 1})}));
    const PairView pair = scene.view.pair(0);
    REQUIRE(pair.graph_stored);
    for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
      const auto [type, i, j] = node_features(pair, node);
      CHECK(type == contact_type(pair.record, node));
      CHECK(i == pair.nodes[node].a);
      CHECK(j == pair.nodes[node].b);
      CHECK(node_number(pair, type, i, j) == node);
    }
  }

  TEST_CASE("a stored graph and one formed on the fly are the same") {
    tools::SceneDescription description = scene_of(prism(7, 0.5, 1), {prism(4, 0.3, 2)});
    const LoadedScene stored_scene(description);
    description.graph_bytes = 0;
    const LoadedScene formed_scene(description);
    const PairView stored = stored_scene.view.pair(0), formed = formed_scene.view.pair(0);
    REQUIRE(stored.graph_stored);
    REQUIRE(!formed.graph_stored);
    CHECK(formed.nodes == nullptr);
    CHECK(formed.record.node_begin == kGraphNotStored);
    CHECK(stored.record.max_degree == formed.record.max_degree);
    for (std::uint32_t node = 0; node < stored.record.node_count; ++node) {
      const auto [type, i, j] = node_features(formed, node);
      std::vector<std::uint32_t> from_list, from_rule, face_list, face_rule, next_to;
      for_each_graph_neighbor(stored, type, i, j, [&](auto n) { from_list.push_back(n); });
      for_each_graph_neighbor(formed, type, i, j, [&](auto n) { from_rule.push_back(n); });
      CHECK(std::is_sorted(from_list.begin(), from_list.end()));
      std::sort(from_rule.begin(), from_rule.end());
      CHECK(from_list == from_rule);
      for_each_face_neighbor(stored, type, i, j, [&](auto v) { face_list.push_back(v); });
      for_each_face_neighbor(formed, type, i, j, [&](auto v) { face_rule.push_back(v); });
      CHECK(std::is_sorted(face_list.begin(), face_list.end()));
      std::sort(face_rule.begin(), face_rule.end());
      CHECK(face_list == face_rule);
      if (type == ContactType::kC) continue;
      // The definition: nodes of the same type on the same face, by what stands in the list.
      for (const std::uint32_t n : from_list) {
        const auto [other, k, l] = node_features(stored, n);
        if (other != type) continue;
        if (type == ContactType::kA && k == i) next_to.push_back(l);
        if (type == ContactType::kB && l == j) next_to.push_back(k);
      }
      CHECK(face_list == next_to);
    }
  }
}
