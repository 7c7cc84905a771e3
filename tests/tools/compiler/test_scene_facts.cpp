// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/support/shapes.hpp"
#include "tools/scene_inspect/facts_text.hpp"

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
}
