// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/rt_core/damaged_scene.hpp"
#include "tests/support/pruned_scenes.hpp"

using namespace haptic;
using namespace haptic::test;

TEST_SUITE("rt_core.scene_tables") {
  TEST_CASE("open: lanes, arcs and bounds must be those of their piece") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto lane = [&](auto change) {
      return changed_section<Real>(blob, SectionId::kVertexLanes, change);
    };
    CHECK(lane([](Real* x) { x[0] = std::nextafter(x[0], 1.0_r); }) == RtStatus::kBlobBadNumber);
    CHECK(lane([](Real* x) { x[5] = 0; }) == RtStatus::kBlobBadNumber);  // padding of 4 vertices
    const auto arc = [&](auto change) {
      return changed_section<EdgeArc>(blob, SectionId::kEdgeArcs, change);
    };
    const auto turned = [&](double by) {
      return arc([by](EdgeArc* a) {
        const double half =
            std::atan2(static_cast<double>(a->sine), static_cast<double>(a->cosine));
        a->cosine = static_cast<Real>(std::cos(half + by));
        a->sine = static_cast<Real>(std::sin(half + by));
      });
    };
    CHECK(turned(0.0) == RtStatus::kOk);
    CHECK(turned(1e-3) == RtStatus::kBlobBadNumber);
    CHECK(turned(-1e-3) == RtStatus::kBlobBadNumber);
    CHECK(arc([](EdgeArc* a) { a->side[0] = -a->side[0]; }) == RtStatus::kBlobBadNumber);
    CHECK(arc([](EdgeArc* a) {
            for (Real& x : a->tilt[1]) x *= 1.001_r;
          }) == RtStatus::kBlobBadNumber);
    CHECK(arc([](EdgeArc* a) { a->apex_rules[1] = 0; }) == RtStatus::kOk);  // slower, not wrong
    CHECK(arc([](EdgeArc* a) { a->apex_rules[1] = 0.5_r; }) == RtStatus::kBlobBadNumber);
    CHECK(arc([](EdgeArc* a) { std::swap(a[0], a[1]); }) == RtStatus::kBlobBadNumber);
    const auto piece = [&](auto change) {
      return changed_section<PieceRecord>(blob, SectionId::kPieces, change);
    };
    CHECK(piece([](PieceRecord* p) { p->reach_m *= 1.001; }) == RtStatus::kBlobBadNumber);
    CHECK(piece([](PieceRecord* p) { p->vertex_relax_m = 0.99e-4; }) == RtStatus::kBlobBadNumber);
    CHECK(piece([](PieceRecord* p) { p->vertex_relax_m = 1; }) == RtStatus::kBlobBadNumber);
    CHECK(piece([](PieceRecord* p) { p->edge_relax_ratio = 0.999; }) == RtStatus::kBlobBadNumber);
    CHECK(piece([](PieceRecord* p) { p->edge_relax_ratio = std::nan(""); }) ==
          RtStatus::kBlobBadNumber);
    CHECK(piece([](PieceRecord* p) { p->lane_count += 8; }) == RtStatus::kBlobBadCount);
    CHECK(piece([](PieceRecord* p) { p[1].lane_begin += 8; }) == RtStatus::kBlobBadCount);
  }

  TEST_CASE("open: edges of faces narrower than epsilon have the whole circle, others never") {
    tools::SceneDescription thin =
        scene_of(box({0, 0, 0}, {0.1, 0.1, 0.00005}), {box({-1, -1, -1}, {1, 1, 0})});
    const std::vector<std::byte> blob = tools::write_scene(thin);
    const auto arc = [&](auto change) {
      return changed_section<EdgeArc>(blob, SectionId::kEdgeArcs, change);
    };
    int full = 0;
    CHECK(arc([&](EdgeArc* a) {
            for (int e = 0; e < 24; ++e) full += a[e].cosine == -1 ? 1 : 0;
          }) == RtStatus::kOk);
    CHECK(full == 8);  // of the plate's twelve edges all but the four short ones
    const auto set_half = [&](bool of_full, Real cosine, Real sine) {
      return arc([=](EdgeArc* a) {
        int e = 0;
        while ((a[e].cosine == -1) != of_full) ++e;
        a[e].cosine = cosine;
        a[e].sine = sine;
      });
    };
    CHECK(set_half(true, -1, 0) == RtStatus::kOk);
    CHECK(set_half(true, 0, 1) == RtStatus::kBlobBadNumber);
    CHECK(set_half(false, -1, 0) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: a graph is stored whole or not at all") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto pair = [&](auto change) {
      return changed_section<PairRecord>(blob, SectionId::kPairs, change);
    };
    CHECK(pair([](PairRecord* p) { p->node_begin = kGraphNotStored; }) == RtStatus::kBlobBadCount);
    CHECK(pair([](PairRecord* p) { p->max_degree += 1; }) == RtStatus::kBlobBadCapacity);
    CHECK(pair([](PairRecord* p) { p->edge_pair_capacity -= 1; }) == RtStatus::kBlobBadCapacity);
    const auto node = [&](auto change) {
      return changed_section<NodeRecord>(blob, SectionId::kNodes, change);
    };
    CHECK(node([](NodeRecord* n) { n[9].keep_begin += 1; }) == RtStatus::kBlobBadGraph);
    CHECK(node([](NodeRecord* n) { n[40].keep_count -= 1; }) == RtStatus::kBlobBadGraph);
    CHECK(node([](NodeRecord* n) { n[127].keep_count += 1; }) == RtStatus::kBlobBadGraph);

    tools::SceneDescription formed = scene_of(box({0, 0, 0}, {1, 1, 1}), {prism(6, 1, 1)});
    formed.graph_bytes = 0;
    const std::vector<std::byte> without = tools::write_scene(formed);
    CHECK(changed_section<PairRecord>(without, SectionId::kPairs, [](PairRecord*) {}) ==
          RtStatus::kOk);
    CHECK(changed_section<PairRecord>(without, SectionId::kPairs, [](PairRecord* p) {
            p->node_begin = 0;
          }) == RtStatus::kBlobBadCount);
    CHECK(changed_section<PairRecord>(without, SectionId::kPairs, [](PairRecord* p) {
            p->node_count -= 1;
          }) == RtStatus::kBlobBadCount);
  }

  TEST_CASE("open: marks are those of a pair, each feature marked as its nodes are") {
    tools::SceneDescription scene =
        with_envelope(scene_of(box({0, 0, 0}, {1, 1, 1}), {prism(6, 1, 1)}), {0, 0, 0, 1}, 0.3);
    for (std::size_t node = 0; node < scene.marks[0].exposed.size(); node += 3) {
      scene.marks[0].exposed[node] = false;
    }
    const std::vector<std::byte> blob = tools::write_scene(scene);
    CHECK(blob == tools::write_scene(scene));
    const LoadedScene good(blob);
    step_a_little(good.view);
    const std::size_t words = good.view.marks().size();
    REQUIRE(words > 0);
    REQUIRE_FALSE(good.view.pair(0).graph_stored);
    const std::size_t node_words = good.view.pair(0).marks.node_words;
    for (std::size_t word = 0; word < words; ++word) {
      for (std::uint32_t bit = 0; bit < 64; ++bit) {
        const RtStatus status = changed_section<std::uint64_t>(
            blob, SectionId::kNodeMarks,
            [&](std::uint64_t* w) { w[word] ^= std::uint64_t{1} << bit; });
        // That a node is reachable is the compiler's word; all else follows, or a bound changes.
        CHECK((status != RtStatus::kOk || word < node_words));
      }
    }
    for (const std::uint32_t begin : {1u, 1000000u, kNotMarked}) {
      CHECK(changed_section<PairRecord>(blob, SectionId::kPairs, [&](PairRecord* p) {
              p->mark_begin = begin;
            }) != RtStatus::kOk);
    }
    CHECK(changed_section<PairRecord>(blob, SectionId::kPairs, [](PairRecord* p) {
            p->node_begin = 0;
          }) == RtStatus::kBlobBadCount);
    scene.marks.clear();
    const LoadedScene all(tools::write_scene(scene));
    CHECK(all.view.marks().empty());
    CHECK(good.view.header().capacity.state_bytes < all.view.header().capacity.state_bytes);
    CHECK(good.view.header().capacity.max_edge_pairs <
          2 * all.view.header().capacity.max_edge_pairs);
  }

  TEST_CASE("open: an envelope is a turn and a box, or zero") {
    const std::vector<std::byte> plain = tetra_box_blob();
    tools::SceneDescription scene = scene_of(box({0, 0, 0}, {1, 1, 1}), {prism(6, 1, 1)});
    scene.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, 0.3};
    scene.workspace = tools::WorkspaceBox{{-1, -1, -1}, {1, 1, 1}};
    const std::vector<std::byte> given = tools::write_scene(scene);
    const auto with = [](const std::vector<std::byte>& blob, auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(p->envelope); });
    };
    using E = EnvelopeParameters;
    CHECK(with(given, [](E&) {}) == RtStatus::kOk);
    CHECK(with(given, [](E& e) { e.given |= 4; }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.reserved = 1; }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.q_wa_xyzw[3] = 0.9; }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.max_angle_rad = 0; }) == RtStatus::kOk);
    CHECK(with(given, [](E& e) { e.max_angle_rad = 4; }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.max_angle_rad = std::nan(""); }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.max_m[1] = -2; }) == RtStatus::kBlobBadNumber);
    CHECK(with(given, [](E& e) { e.min_m[2] = -1e7; }) == RtStatus::kBlobBadNumber);
    CHECK(with(plain, [](E& e) { e.max_angle_rad = 1; }) == RtStatus::kBlobBadNumber);
    CHECK(with(plain, [](E& e) { e.min_m[0] = -1; }) == RtStatus::kBlobBadNumber);
    CHECK(with(plain, [](E& e) { e.given = kOrientationGiven; }) == RtStatus::kBlobBadNumber);
    CHECK(with(plain, [](E& e) { e.given = kWorkspaceGiven; }) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: the bounds in the header follow from the tables and the pairs per tick") {
    tools::SceneDescription scene =
        scene_of(box({0, 0, 0}, {1, 1, 1}), {prism(6, 1, 1), prism(5, 1, 1), prism(4, 1, 1)});
    scene.max_pair_visits = 2;
    const std::vector<std::byte> blob = tools::write_scene(scene);
    const auto with = [&](auto change) {
      DamagedCopy copy(blob, blob.size());
      change(copy.header().capacity);
      copy.rehash();
      return copy.open();
    };
    CHECK(with([](SceneCapacity& c) { CHECK(c.unproven == kUnprovenPairVisits); }) ==
          RtStatus::kOk);
    CHECK(with([](SceneCapacity& c) { c.max_pair_visits = 0; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneCapacity& c) { c.max_pair_visits = 4; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneCapacity& c) { c.max_pair_visits = 3; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneCapacity& c) { c.unproven = 0; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneCapacity& c) { c.max_edge_pairs += 1; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneCapacity& c) { c.moving_lanes -= 1; }) == RtStatus::kBlobBadCapacity);
    for (const auto field : {&SceneCapacity::max_full_searches, &SceneCapacity::max_proxy_passes,
                             &SceneCapacity::max_proxy_rejected, &SceneCapacity::max_proxy_rounds,
                             &SceneCapacity::max_qp_rows, &SceneCapacity::max_qp_iterations,
                             &SceneCapacity::max_qp_programs, &SceneCapacity::max_qp_steps}) {
      CHECK(with([&](SceneCapacity& c) { c.*field += 1; }) == RtStatus::kBlobBadCapacity);
    }
  }
}
