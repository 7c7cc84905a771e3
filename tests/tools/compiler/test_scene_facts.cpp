// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "rt_core/scene/graph_rule.hpp"
#include "tests/support/shapes.hpp"
#include "tools/scene_facts/bounds_text.hpp"
#include "tools/scene_facts/facts_text.hpp"

using namespace haptic;
using namespace haptic::test;
using tools::BodyFacts;
using tools::SceneFacts;

namespace {

SceneFacts facts(const tools::Body& moving, const tools::Body& fixed) {
  const LoadedScene scene(scene_of(moving, {fixed}));
  return tools::facts_of(scene.view);
}

}  // namespace

TEST_SUITE("tools.scene_facts") {
  TEST_CASE("neighbor subgraphs of single nodes have the published sizes") {
    const SceneFacts f =
        facts(tetrahedron({0, 0, 0}, {0.1, 0, 0.01}, {0.02, 0.1, 0}, {0, 0.03, 0.1}),
              box({0, 0, 0}, {1, 1, 1}));
    constexpr std::uint32_t kSizes[3] = {25, 32, 17};
    constexpr std::uint64_t kNodes[3] = {32, 24, 72};
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(f.types[k].nodes == kNodes[k]);
      CHECK(f.types[k].smallest == kSizes[k]);
      CHECK(f.types[k].largest == kSizes[k]);
      CHECK(f.types[k].mean == doctest::Approx(kSizes[k]));
    }
    CHECK(f.arcs == 1332);
    CHECK(f.pairs[0].arcs == 1332);
    std::uint64_t section_bytes = 0;
    for (const tools::SectionFacts& s : f.sections) section_bytes += s.bytes;
    CHECK(section_bytes < f.bytes);
    CHECK(f.bytes - section_bytes <
          sizeof(SceneHeader) + f.sections.size() * (sizeof(SectionEntry) + kSceneAlignment));
  }

  TEST_CASE("pieces that touch are separated, pieces that overlap are a cover") {
    const tools::Body part = box({-1, -1, -1}, {1, 1, 1});
    const auto recheck = [&](const tools::Body& second) {
      return facts(part, join({box({0, 0, 0}, {1, 1, 1}), second})).bodies[1].recheck;
    };
    const tools::BodyRecheck touching = recheck(box({1, 0, 0}, {2, 1, 1}));
    CHECK(touching.piece_pairs == 1);
    CHECK(touching.separated_pairs == 1);
    CHECK(touching.convex);
    CHECK(recheck(box({7, 7, 7}, {8, 8, 8})).separated_pairs == 1);
    CHECK(recheck(box({0.5, 0, 0}, {2, 1, 1})).separated_pairs == 0);
    CHECK(recheck(box({1 - 1e-4, 0, 0}, {2, 1, 1})).separated_pairs == 0);
  }

  TEST_CASE("crossed wedges that no face plane separates are distinguished by their edges") {
    const tools::Body low =
        tetrahedron({-1, 0, 0}, {1, 0, 0}, {0.03, 0.2, -1}, {-0.02, -0.2, -1.1});
    const auto separated = [&](double gap_m) {
      const tools::Body high = tetrahedron({0.01, -1, gap_m}, {-0.01, 1, gap_m},
                                           {0.2, 0.02, 1 + gap_m}, {-0.2, -0.01, 1.1 + gap_m});
      return facts(box({-1, -1, -1}, {1, 1, 1}), join({low, high}))
          .bodies[1]
          .recheck.separated_pairs;
    };
    CHECK(separated(1e-3) == 1);
    CHECK(separated(0.0) == 1);
    CHECK(separated(-1e-3) == 0);
  }

  TEST_CASE("vertices that name one mesh vertex must be one point, once in a piece") {
    tools::Body pieces = join({box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1})});
    const auto conflicts = [&] {
      return facts(box({-1, -1, -1}, {1, 1, 1}), pieces).bodies[1].recheck.source_conflicts;
    };
    // Eight ids of the second box name other points in the first.
    CHECK(conflicts() == 8);
    for (std::int64_t& id : pieces.pieces[1].source_vertex) id += 8;
    CHECK(conflicts() == 0);
    // The four shared corners may name the same mesh vertex.
    for (const std::size_t v : {0u, 2u, 4u, 6u}) {
      pieces.pieces[1].source_vertex[v] = static_cast<std::int64_t>(v + 1);
    }
    CHECK(conflicts() == 0);
    pieces.pieces[0].source_vertex[3] = 1;
    CHECK(conflicts() == 1);
    for (std::int64_t& id : pieces.pieces[1].source_vertex) id = -1;
    pieces.pieces[0].source_vertex[3] = 3;
    const SceneFacts f = facts(box({-1, -1, -1}, {1, 1, 1}), pieces);
    CHECK(f.bodies[1].recheck.source_conflicts == 0);
    CHECK(f.bodies[1].pieces[1].source.cut_vertices == 8);
    CHECK(f.bodies[1].pieces[0].source.mesh_vertices == 8);
    CHECK(f.bodies[1].pieces[0].source.mesh_faces == 6);
  }

  TEST_CASE("numbers are grouped by thousands") {
    CHECK(tools::grouped(0) == "0");
    CHECK(tools::grouped(999) == "999");
    CHECK(tools::grouped(1000) == "1 000");
    CHECK(tools::grouped(12345678) == "12 345 678");
  }

  TEST_CASE("graph facts do not depend on how a graph is held") {
    tools::SceneDescription description =
        scene_of(prism(7, 0.5, 1), {random_hull(5, 14, {0.1, 0.2, 0.3})});
    const LoadedScene stored_scene(description);
    description.graph_bytes = 0;
    const LoadedScene formed_scene(description);
    const SceneFacts stored = tools::facts_of(stored_scene.view);
    const SceneFacts formed = tools::facts_of(formed_scene.view);
    REQUIRE(stored.pairs[0].stored);
    REQUIRE(!formed.pairs[0].stored);
    CHECK(stored.stored_graph_bytes == stored.pairs[0].graph_bytes);
    CHECK(formed.stored_graph_bytes == 0);
    CHECK(stored.pairs[0].graph_bytes == formed.pairs[0].graph_bytes);
    // Against the stored lists.
    const PairView pair = stored_scene.view.pair(0);
    std::uint64_t sizes[3] = {0, 0, 0}, smallest[3] = {~0ull, ~0ull, ~0ull}, largest[3] = {};
    for (std::uint32_t node = 0; node < pair.record.node_count; ++node) {
      const auto k = static_cast<std::size_t>(contact_type(pair.record, node));
      const std::uint64_t size = pair.neighbors.count(node) + 1;
      sizes[k] += size;
      smallest[k] = std::min(smallest[k], size);
      largest[k] = std::max(largest[k], size);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      for (const SceneFacts* f : {&stored, &formed}) {
        CHECK(f->types[k].smallest == smallest[k]);
        CHECK(f->types[k].largest == largest[k]);
        CHECK(f->types[k].mean == doctest::Approx(static_cast<double>(sizes[k]) /
                                                  static_cast<double>(f->types[k].nodes)));
      }
    }
  }

  TEST_CASE("what cannot be defended is named with its pair, its numbers and a fix") {
    const LoadedScene sound(scene_of(box({0, 0, 0}, {1, 1, 1}), {box({2, 0, 0}, {3, 1, 1})}));
    CHECK(tools::unproven_reasons(tools::facts_of(sound.view)).empty());
    tools::SceneDescription large =
        scene_of(prism(80, 0.1, 0.1), {box({0, 0, 0}, {1, 1, 1}), prism(80, 0.2, 0.1)});
    large.max_pair_visits = 1;
    const LoadedScene scene(large);
    const SceneFacts facts = tools::facts_of(scene.view);
    const std::vector<std::string> reasons = tools::unproven_reasons(facts);
    CHECK(facts.capacity.unproven == (kUnprovenEdgePairs | kUnprovenNearSet | kUnprovenPairVisits));
    const auto said = [&](const std::string& words) {
      return std::any_of(reasons.begin(), reasons.end(),
                         [&](const auto& r) { return r.find(words) != std::string::npos; });
    };
    CHECK(
        said("pair 1 (piece 0 of 'test body', piece 0 of 'test body'): 57 600 edge pairs, a tick "
             "may test 16 384; simplify"));
    CHECK(said("2 pairs can be near at once, a tick may search 1; set [budget] pair_visits = 2"));
    CHECK(said("basic contacts, its near set holds"));
  }

  TEST_CASE("more pairs than a tick can follow are named with the key and its bytes") {
    const auto scene_with = [](std::uint32_t near_pairs) {
      std::vector<tools::Body> moving, fixed;
      for (int k = 0; k < 65; ++k) {
        const double at = 2.0 * k;
        moving.push_back(box({at, 0, 0}, {at + 1, 1, 1}));
        fixed.push_back(box({at, 0, -2}, {at + 1, 1, -1}));
      }
      tools::SceneDescription scene = scene_of(join(moving), {join(fixed)});
      scene.parameters.law = LawId::kProxy;
      scene.parameters.coupling.near_pairs = near_pairs;
      scene.max_pair_visits = 4225;
      return scene;
    };
    const LoadedScene few(scene_with(0)), all(scene_with(4225)), asked_more(scene_with(5000));
    const SceneFacts facts = tools::facts_of(few.view);
    CHECK(facts.capacity.unproven == kUnprovenNearPairs);
    const std::vector<std::string> reasons = tools::unproven_reasons(facts);
    REQUIRE(reasons.size() == 1);
    const std::uint64_t more =
        all.view.header().capacity.state_bytes - few.view.header().capacity.state_bytes;
    CHECK(reasons[0] ==
          "4 225 pairs can be near at once, a tick follows 4 096; set [budget] near_pairs = "
          "4225, " +
              tools::grouped(more) + " bytes more of state");
    CHECK(tools::bounds_as_text(facts).find("to give up exactness") != std::string::npos);
    // The probes: with room for all there is nothing to say.
    for (const SceneView* view : {&all.view, &asked_more.view}) {
      const SceneFacts roomy = tools::facts_of(*view);
      CHECK(roomy.capacity.unproven == 0);
      CHECK(roomy.state_with_all_pairs == 0);
      CHECK(tools::unproven_reasons(roomy).empty());
      CHECK(tools::bounds_as_text(roomy).find("can be certified") != std::string::npos);
    }
  }

  TEST_CASE("bytes are said with two digits and a unit") {
    CHECK(tools::short_bytes(0) == "0 bytes");
    CHECK(tools::short_bytes(999) == "999 bytes");
    CHECK(tools::short_bytes(1234) == "1.2 kB");
    CHECK(tools::short_bytes(41234) == "41 kB");
    CHECK(tools::short_bytes(67000000) == "67 MB");
    CHECK(tools::short_bytes(999600) == "1.0 MB");
  }
}
