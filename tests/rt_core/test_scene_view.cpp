// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "tests/support/pruned_scenes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

struct alignas(64) Line {
  std::byte bytes[64];
};

/// A copy of a blob in aligned memory that a test may damage.
class Copy {
 public:
  explicit Copy(const std::vector<std::byte>& blob, std::size_t size)
      : lines_((size + 63) / 64 + 1), size_(size) {
    std::memcpy(lines_.data(), blob.data(), std::min(size, blob.size()));
  }
  std::span<std::byte> bytes() { return {reinterpret_cast<std::byte*>(lines_.data()), size_}; }
  SceneHeader& header() { return *reinterpret_cast<SceneHeader*>(lines_.data()); }
  void rehash() { header().content_hash = scene_content_hash(bytes()); }
  RtStatus open() {
    SceneView view;
    return SceneView::open(bytes(), view);
  }

 private:
  std::vector<Line> lines_;
  std::size_t size_;
};

/// Opens the blob with one section changed and the hash mended; `change` gets its first element.
template <typename Element, typename Change>
RtStatus changed_section(const std::vector<std::byte>& blob, SectionId id, const Change& change) {
  Copy copy(blob, blob.size());
  const auto* sections =
      reinterpret_cast<SectionEntry*>(copy.bytes().data() + copy.header().section_table);
  for (std::uint32_t s = 0; s < copy.header().section_count; ++s) {
    if (sections[s].id != id) continue;
    change(reinterpret_cast<Element*>(copy.bytes().data() + sections[s].offset));
  }
  copy.rehash();
  return copy.open();
}

/// A few ticks over whatever has been accepted; the sanitizers see what is read.
void step_a_little(const SceneView& view) {
  const std::size_t bytes = HapticCore::state_bytes(view);
  std::vector<Line> memory(bytes / 64 + 1);
  HapticCore* core = nullptr;
  if (HapticCore::create({reinterpret_cast<std::byte*>(memory.data()), bytes}, view, core) !=
      RtStatus::kOk)
    return;
  for (int t = 0; t < 8; ++t) {
    StepInput input;
    input.pose_wa.p_wa =
        Vec3(0.01_r * static_cast<Real>(t - 4), 0, 0.04_r - 0.01_r * static_cast<Real>(t));
    CHECK(core->step(input).status == RtStatus::kOk);
  }
}

std::vector<std::byte> tetra_box_blob() {
  return tools::write_scene(scene_of(
      tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06}),
      {box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0})}));
}

}  // namespace

TEST_SUITE("rt_core.scene_view") {
  TEST_CASE("open: accepts what the writer made and tells its tables") {
    const LoadedScene scene(tetra_box_blob());
    CHECK(scene.view.bodies().size() == 2);
    CHECK(scene.view.pairs().size() == 1);
    CHECK(scene.view.pairs()[0].node_count == 128);
    CHECK(scene.view.text(scene.view.parameters().name_offset,
                          scene.view.parameters().name_bytes) == "test scene");
  }

  TEST_CASE("open: every truncation is refused") {
    const std::vector<std::byte> blob = tetra_box_blob();
    for (std::size_t size = 0; size < blob.size(); size += size < 512 ? 1 : 61) {
      Copy copy(blob, size);
      CHECK(copy.open() == RtStatus::kBlobTooSmall);
    }
    Copy longer(blob, blob.size() + 1);
    CHECK(longer.open() == RtStatus::kBlobTooSmall);
  }

  TEST_CASE("open: says what is wrong with a header") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto damaged = [&](auto damage) {
      Copy copy(blob, blob.size());
      damage(copy.header());
      copy.rehash();
      return copy.open();
    };
    CHECK(damaged([](SceneHeader& h) { h.magic[0] = 'X'; }) == RtStatus::kBlobBadMagic);
    CHECK(damaged([](SceneHeader& h) { h.version += 1; }) == RtStatus::kBlobBadVersion);
    CHECK(damaged([](SceneHeader& h) { h.scalar_bytes = h.scalar_bytes == 8 ? 4 : 8; }) ==
          RtStatus::kBlobWrongScalar);
    CHECK(damaged([](SceneHeader& h) { h.section_count = 65; }) == RtStatus::kBlobBadSectionTable);
    CHECK(damaged([](SceneHeader& h) { h.section_count -= 1; }) != RtStatus::kOk);
    CHECK(damaged([](SceneHeader& h) { h.section_table += 8; }) == RtStatus::kBlobBadSectionTable);
    CHECK(damaged([](SceneHeader& h) { h.capacity.largest_near += 1; }) ==
          RtStatus::kBlobBadCapacity);
    Copy stale(blob, blob.size());
    stale.bytes()[blob.size() / 2] ^= std::byte{1};
    CHECK(stale.open() == RtStatus::kBlobBadHash);
    std::vector<Line> lines(blob.size() / 64 + 2);
    std::byte* const shifted = reinterpret_cast<std::byte*>(lines.data()) + 8;
    std::memcpy(shifted, blob.data(), blob.size());
    SceneView view;
    CHECK(SceneView::open({shifted, blob.size()}, view) == RtStatus::kBlobMisaligned);
  }

  TEST_CASE("open: refuses stiffness and lengths that would overflow a force") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(*p); });
    };
    CHECK(with([](SceneParameters&) {}) == RtStatus::kOk);
    CHECK(with([](SceneParameters& p) { p.k_f_n_per_m = kMaxStiffness_n_per_m; }) == RtStatus::kOk);
    CHECK(with([](SceneParameters& p) { p.k_f_n_per_m = 1e308; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters& p) { p.epsilon_m = 1e7; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters& p) { p.start_p_wa_m[1] = -1e7; }) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: refuses laws and bands that are none") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters, change);
    };
    CHECK(with([](SceneParameters* p) { p->law = LawId::kWeightedRegion; }) == RtStatus::kOk);
    CHECK(with([](SceneParameters* p) { p->law = LawId::kProxy; }) == RtStatus::kBlobBadCapacity);
    CHECK(with([](SceneParameters* p) { p->law = static_cast<LawId>(4); }) ==
          RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters* p) { p->epsilon_o_m = 0; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = kMaxSceneLength_m; }) == RtStatus::kOk);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = -1; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](SceneParameters* p) { p->exact_band_m = 1e300 * 1e300; }) ==
          RtStatus::kBlobBadNumber);
    // The arcs belong to one epsilon.
    CHECK(with([](SceneParameters* p) { p->epsilon_m *= 2; }) == RtStatus::kBlobBadNumber);
  }

  TEST_CASE("open: refuses couplings out of their ranges") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](auto change) {
      return changed_section<SceneParameters>(blob, SectionId::kParameters,
                                              [&](SceneParameters* p) { change(p->coupling); });
    };
    using Member = double CouplingParameters::*;
    struct Range {
      Member member;
      double least, most, below, above;
    };
    const double k_t = 1000.0, infinite = std::numeric_limits<double>::infinity();
    const Range ranges[] = {{&CouplingParameters::k_r_nm_per_rad, k_t * 1.1e-18, k_t * 1e12,
                             k_t * 0.9e-18, k_t * 1.1e12},
                            {&CouplingParameters::damping_ns_per_m, 0, 1e12, -1e-300, 1.1e12},
                            {&CouplingParameters::damping_share, 0, 1, -0.1, 1.1},
                            {&CouplingParameters::max_rotation_error_rad, 1e-9, 3, 0, 3.1},
                            {&CouplingParameters::max_translation_error_m, 0, 1e6, -1e-9, 1.1e6},
                            {&CouplingParameters::min_window_s, 0, 0.02, -0.001, 0.021},
                            {&CouplingParameters::max_window_s, 0.001, 1e3, 0.0009, 1.1e3},
                            {&CouplingParameters::encoder_step_rad, 0, 1, -1e-9, infinite}};
    for (const Range& r : ranges) {
      CAPTURE(&r - ranges);
      for (const double x : {r.least, r.most}) {
        CHECK(with([&](CouplingParameters& c) { c.*r.member = x; }) == RtStatus::kOk);
      }
      for (const double x : {r.below, r.above, std::nan(""), infinite}) {
        CHECK(with([&](CouplingParameters& c) { c.*r.member = x; }) == RtStatus::kBlobBadNumber);
      }
    }
    const auto k = [&](double stiffness, double length) {
      return with([&](CouplingParameters& c) {
        c.k_t_n_per_m = stiffness;
        c.k_r_nm_per_rad = stiffness * length * length;
      });
    };
    CHECK(k(kMinStiffness_n_per_m, 1.0) == RtStatus::kOk);
    CHECK(k(kMaxStiffness_n_per_m, 1.0) == RtStatus::kOk);
    for (const double x : {0.0, 0.9e-12, 1.1e12, -1.0, std::nan("")}) {
      CHECK(k(x, 1.0) == RtStatus::kBlobBadNumber);
    }
    CHECK(with([](CouplingParameters& c) { c.passivity = 2; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](CouplingParameters& c) { c.allow_active = 2; }) == RtStatus::kBlobBadNumber);
    CHECK(with([](CouplingParameters& c) { c.passivity = c.allow_active = 1; }) == RtStatus::kOk);
  }

  TEST_CASE("open: static bodies rub with a coefficient from 0 to 2, the moving one has none") {
    const std::vector<std::byte> blob = tetra_box_blob();
    const auto with = [&](std::size_t body, double friction) {
      return changed_section<BodyRecord>(blob, SectionId::kBodies,
                                         [&](BodyRecord* b) { b[body].friction = friction; });
    };
    CHECK(with(1, 0.3) == RtStatus::kOk);
    CHECK(with(1, kMaxFriction) == RtStatus::kOk);
    for (const double x : {-0.1, 2.1, std::nan("")}) {
      CHECK(with(1, x) == RtStatus::kBlobBadNumber);
    }
    CHECK(with(0, 0.3) == RtStatus::kBlobBadNumber);
  }

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
    // One orientation: then there must be planes, and no arcs.
    CHECK(with(given, [](E& e) { e.max_angle_rad = 0; }) == RtStatus::kBlobBadSectionTable);
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
      Copy copy(blob, blob.size());
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
    for (const auto field : {&SceneCapacity::max_search_work, &SceneCapacity::max_proxy_passes,
                             &SceneCapacity::max_proxy_rejected, &SceneCapacity::max_proxy_rounds,
                             &SceneCapacity::max_qp_rows, &SceneCapacity::max_qp_iterations,
                             &SceneCapacity::max_qp_programs, &SceneCapacity::max_qp_steps,
                             &SceneCapacity::reserved}) {
      CHECK(with([&](SceneCapacity& c) { c.*field += 1; }) == RtStatus::kBlobBadCapacity);
    }
  }

  TEST_CASE("open: a section with an unknown id is skipped") {
    // The last section is renamed; it was required, so the answer names what is missing, not the
    // unknown one.
    const std::vector<std::byte> blob = tetra_box_blob();
    Copy copy(blob, blob.size());
    auto* sections =
        reinterpret_cast<SectionEntry*>(copy.bytes().data() + copy.header().section_table);
    sections[copy.header().section_count - 1].id = static_cast<SectionId>(777);
    copy.rehash();
    CHECK(copy.open() == RtStatus::kBlobMissingSection);
  }

  TEST_CASE("open: survives any damage with a correct hash") {
    const std::vector<std::byte> blob = tetra_box_blob();
    Random random(20);
    int refused = 0;
    for (int round = 0; round < 4000; ++round) {
      Copy copy(blob, blob.size());
      const int flips = 1 + static_cast<int>(random.next() % 4);
      for (int k = 0; k < flips; ++k) {
        const std::size_t at = random.next() % blob.size();
        copy.bytes()[at] ^= static_cast<std::byte>(1u << (random.next() % 8));
      }
      copy.header().byte_count = blob.size();
      copy.rehash();
      SceneView view;
      if (SceneView::open(copy.bytes(), view) != RtStatus::kOk) {
        ++refused;
        continue;
      }
      step_a_little(view);
    }
    CHECK(
        refused >
        2500);  // what is accepted changed a low bit of a coordinate, a parameter or a source index
  }
}
