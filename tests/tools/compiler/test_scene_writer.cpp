// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "rt_core/scene/capacity.hpp"
#include "tests/support/shapes.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kEps = static_cast<double>(kRealEpsilon);

SceneView opened(const tools::SceneBytes& bytes) {
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  return view;
}

double at(const PieceView& piece, std::uint32_t v, int k) {
  return static_cast<double>(piece.vertices[3 * v + static_cast<std::uint32_t>(k)]);
}

}  // namespace

TEST_SUITE("tools.scene_writer") {
  TEST_CASE("equal input gives equal bytes, sections are aligned and padded with zeros") {
    const tools::SceneDescription description =
        scene_of(prism(9, 0.02, 0.1), {box({0, 0, 0}, {0.1, 0.2, 0.3}), prism(4, 0.1, 0.1)});
    const std::vector<std::byte> blob = tools::write_scene(description);
    CHECK(blob == tools::write_scene(description));
    const tools::SceneBytes bytes{blob};
    const SceneView view = opened(bytes);
    std::uint64_t end = sizeof(SceneHeader) + view.sections().size_bytes();
    for (const SectionEntry& s : view.sections()) {
      CHECK(s.offset % kSceneAlignment == 0);
      CHECK(s.offset - end < kSceneAlignment);
      for (std::uint64_t i = end; i < s.offset; ++i) REQUIRE(blob[i] == std::byte{0});
      end = s.offset + s.count * s.element_bytes;
    }
    CHECK(end == blob.size());
    CHECK(view.header().capacity.state_bytes == HapticCore::state_bytes(view));
    CHECK(view.pair_count() == 2);
  }

  TEST_CASE("identity pose and zero grip keep the coordinates of the mesh") {
    const Point lo{0.1, 0.2, 0.3}, hi{0.4, 0.6, 0.9};
    tools::SceneDescription description = scene_of(box(lo, hi), {box(lo, hi)});
    const tools::SceneBytes bytes{tools::write_scene(description)};
    const SceneView view = opened(bytes);
    const tools::ConvexPiece& source = description.moving.body.pieces[0];
    const double* reference = view.bodies()[1].reference_m;
    for (std::uint32_t v = 0; v < 8; ++v) {
      for (int k = 0; k < 3; ++k) {
        const double x = source.vertices[v][static_cast<std::size_t>(k)];
        CHECK(at(view.piece(0), v, k) == static_cast<double>(static_cast<Real>(x)));
        // One rounding: the difference is exact in long double.
        CHECK(at(view.piece(1), v, k) ==
              static_cast<double>(static_cast<Real>(static_cast<long double>(x) - reference[k])));
      }
    }
    // The reference is near the centre and on a coarse grid: 0.6 m wide part, 1/64 m steps.
    for (int k = 0; k < 3; ++k) {
      CHECK(std::abs(reference[k] -
                     (lo[static_cast<std::size_t>(k)] + hi[static_cast<std::size_t>(k)]) / 2) <=
            1.0 / 128);
      CHECK(reference[k] * 64 == std::floor(reference[k] * 64));
    }
  }

  TEST_CASE("a rotated and shifted part lands where the pose puts it") {
    tools::SceneDescription description =
        scene_of(box({-1, -1, -1}, {1, 1, 1}), {prism(6, 0.3, 0.5)});
    const double angle = 0.7;
    description.statics[0].quaternion_wxyz = {std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
    description.statics[0].position_m = {10.0, -20.0, 30.0};
    const tools::SceneBytes bytes{tools::write_scene(description)};
    const SceneView view = opened(bytes);
    const tools::ConvexPiece& source = description.statics[0].body.pieces[0];
    const BodyRecord& record = view.bodies()[1];
    for (std::uint32_t v = 0; v < 12; ++v) {
      const Point& p = source.vertices[v];
      const double expected[3] = {std::cos(angle) * p[0] - std::sin(angle) * p[1] + 10.0,
                                  std::sin(angle) * p[0] + std::cos(angle) * p[1] - 20.0,
                                  p[2] + 30.0};
      for (int k = 0; k < 3; ++k) {
        CHECK(std::abs(at(view.piece(1), v, k) + record.reference_m[k] - expected[k]) <=
              4 * kEps + 8e-15);
      }
    }
  }

  TEST_CASE("a part far away keeps its digits") {
    tools::SceneDescription near = scene_of(box({-1, -1, -1}, {1, 1, 1}), {prism(5, 0.3, 0.5)});
    tools::SceneDescription far = near;
    // The far reference is the near one shifted exactly, so the geometry must be bitwise equal.
    far.statics[0].position_m = {65536.0, -65536.0, 32768.0};
    tools::SceneDescription origin = near;
    origin.statics[0].mesh_origin_m = {65536.0, -65536.0, 32768.0};
    const auto geometry = [](const tools::SceneDescription& description) {
      const tools::SceneBytes bytes{tools::write_scene(description)};
      const SceneView view = opened(bytes);
      const PieceView p = view.piece(1);
      return std::vector<Real>(p.vertices, p.vertices + 3 * p.vertex_count);
    };
    CHECK(geometry(near) == geometry(far));
    CHECK(geometry(near) == geometry(origin));
  }

  TEST_CASE("the grip point is the origin of the moving part's coordinates") {
    tools::SceneDescription description =
        scene_of(box({0, 0, 0}, {1, 1, 1}), {box({3, 3, 3}, {4, 4, 4})});
    description.grip_m = {0.25, 0.5, -2.0};
    description.moving.mesh_origin_m = {0.5, 0.0, 0.0};
    const tools::SceneBytes bytes{tools::write_scene(description)};
    const SceneView view = opened(bytes);
    CHECK(at(view.piece(0), 0, 0) == 0.25);
    CHECK(at(view.piece(0), 0, 1) == -0.5);
    CHECK(at(view.piece(0), 0, 2) == 2.0);
    CHECK(view.bodies()[0].reference_m[2] == -2.0);
  }

  TEST_CASE("capacities follow their formulas") {
    tools::Body two = join({box({0, 0, 0}, {1, 1, 1}), prism(8, 0.3, 0.5)});
    const LoadedScene scene(scene_of(two, {box({5, 5, 5}, {6, 6, 6}), prism(3, 1, 1)}));
    REQUIRE(scene.view.pair_count() == 4);
    std::uint64_t near = 0, edge_pairs = 0, features = 0;
    for (const PairRecord& pair : scene.view.listed_pairs()) {
      const PieceRecord& a = scene.view.pieces()[pair.piece_a];
      const PieceRecord& b = scene.view.pieces()[pair.piece_b];
      REQUIRE(pair.node_count <= 1024);
      CHECK(pair.near_capacity == pair.node_count);
      CHECK(pair.edge_pair_capacity == a.edge_count * b.edge_count);
      near += pair.node_count;
      edge_pairs += std::uint64_t{a.edge_count} * b.edge_count;
      features += a.face_count + a.edge_count + b.face_count + b.edge_count;
    }
    const SceneCapacity& c = scene.view.header().capacity;
    CHECK(c.max_pair_visits == 4);
    CHECK(c.max_near_nodes == near);
    CHECK(c.max_edge_pairs == edge_pairs);
    CHECK(c.total_features == features);
    CHECK(c.max_feature_evaluations == features);
    CHECK(c.moving_lanes == 8 + 16);
    CHECK(c.max_support_pairs == 4 * 128 + edge_pairs + 4 * 2);
    CHECK(c.unproven == 0);
    // Pieces of A major, pieces of the statics in order.
    CHECK(scene.view.pair_record(1).piece_a == 0);
    CHECK(scene.view.pair_record(1).piece_b == 3);
    CHECK(scene.view.pair_record(2).piece_a == 1);
    CHECK(scene.view.pair_record(2).piece_b == 2);
  }

  TEST_CASE("pairs beyond 65535 nodes get 32-bit neighbors") {
    tools::SceneDescription description = scene_of(prism(80, 0.1, 0.1), {prism(80, 0.2, 0.1)});
    description.graph_bytes = std::uint64_t{64} << 20;
    const LoadedScene scene(description);
    REQUIRE(scene.view.pair_record(0).node_count == 2 * 82 * 160 + 240 * 240);
    bool wide = false;
    for (const SectionEntry& s : scene.view.sections()) {
      if (s.id == SectionId::kNeighbors) wide = s.element_bytes == 4;
    }
    CHECK(wide);
  }

  TEST_CASE("graphs are stored smallest first, as far as the room goes") {
    tools::SceneDescription description =
        scene_of(prism(7, 0.02, 0.1), {box({0, 0, 0}, {1, 1, 1}), prism(40, 0.1, 0.1),
                                       tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1})});
    const auto stored = [&](std::uint64_t graph_bytes) {
      description.graph_bytes = graph_bytes;
      const LoadedScene scene(description);
      std::string which;
      std::uint64_t bytes = 0;
      for (std::uint32_t i = 0; i < 3; ++i) which += scene.view.pair(i).graph_stored ? 's' : '-';
      for (const SectionEntry& s : scene.view.sections()) {
        if (s.id == SectionId::kNodes || s.id == SectionId::kNeighborBegin ||
            s.id == SectionId::kNeighbors) {
          bytes += s.count * s.element_bytes;
        }
      }
      CHECK(bytes <= graph_bytes + 4);  // one list begin more than nodes
      return which;
    };
    CHECK(stored(tools::kDefaultGraphBytes) == "sss");
    CHECK(stored(200000) == "s-s");
    CHECK(stored(20000) == "--s");
    CHECK(stored(0) == "---");
  }

  TEST_CASE("a scene's defaults: proxy law, exact band") {
    tools::SceneDescription description =
        scene_of(box({0, 0, 0}, {1, 1, 1}), {box({0, 0, 0}, {1, 1, 1})});
    description.parameters = tools::default_parameters();
    description.parameters.k_f_n_per_m = 1000.0;
    description.parameters.epsilon_m = 2.0e-4;
    description.max_pair_visits = 7;
    const LoadedScene scene(description);
    CHECK(scene.view.parameters().law == LawId::kProxy);
    CHECK(scene.view.parameters().exact_band_m == 0.005);
    CHECK(scene.view.header().capacity.max_pair_visits == 1);  // no more than there are
  }

  TEST_CASE("the coupling follows from k_F and the radius about the grip, unless it is given") {
    tools::SceneDescription description =
        scene_of(box({0, 0, 0}, {0.02, 0.02, 0.02}), {box({0, 0, 0}, {1, 1, 1})});
    description.grip_m = {0, 0, 0.02};
    description.statics[0].friction = 0.25;
    description.parameters.k_f_n_per_m = 800.0;
    const LoadedScene derived(description);
    const CouplingParameters& c = derived.view.parameters().coupling;
    // The farthest corner is 20 mm off in all three axes.
    const double length_m = 4.5 * 0.02 * std::sqrt(3.0);
    CHECK(c.k_t_n_per_m == 800.0);
    CHECK(c.k_r_nm_per_rad ==
          doctest::Approx(800.0 * length_m * length_m).epsilon(1e-12 + 4 * kEps));
    CHECK(c.damping_ns_per_m == 0.0);
    CHECK(c.max_rotation_error_rad == 1.0);
    CHECK(c.max_translation_error_m == 0.0);
    CHECK(c.min_window_s == 0.001);
    CHECK(c.max_window_s == 0.02);
    CHECK(c.passivity == 0);
    CHECK(derived.view.bodies()[0].friction == 0.0);
    CHECK(derived.view.bodies()[1].friction == 0.25);
    CHECK(derived.view.bodies()[1].friction_static == 0.25);

    CouplingParameters& given = description.parameters.coupling;
    given = {500.0, 2.0, 1.5, 0.25, 0.3, 0.01, 0.0, 0.005, 9.0, 0.5, 2e-7, 4e-6, 5, 0, 1, 1};
    const LoadedScene kept(description);
    CHECK(std::memcmp(&kept.view.parameters().coupling, &given, sizeof given) == 0);
    given.k_r_nm_per_rad = 0.0;
    const LoadedScene half(description);
    CHECK(half.view.parameters().coupling.k_r_nm_per_rad ==
          doctest::Approx(500.0 * length_m * length_m).epsilon(1e-12 + 4 * kEps));
    given.k_r_nm_per_rad = -1.0;
    CHECK_THROWS_WITH_AS(tools::write_scene(description), doctest::Contains("out of its range"),
                         tools::InputError);
  }

  TEST_CASE("a held part of a mass has the inertia of its solid about the grip") {
    // 1 x 2 x 3 in two pieces that meet at x = 0.4, from a corner that lies off the origin.
    const tools::Body bar = join({box({0, 0, 0}, {0.4, 2, 3}), box({0.4, 0, 0}, {1, 2, 3})});
    tools::SceneDescription description = scene_of(bar, {box({0, 0, 0}, {1, 1, 1})});
    description.moving.mesh_origin_m = {0.1, 0.2, 0.3};
    description.grip_m = {0.1, 0.2, 0.3};
    CHECK(LoadedScene(description).view.parameters().held.inertia_kg_m2[0] == 0.0);
    description.parameters.held.mass_kg = 0.6;
    const LoadedScene scene(description);
    const HeldPartParameters& h = scene.view.parameters().held;
    const auto near = [](double x) { return doctest::Approx(x).epsilon(1e-12); };
    CHECK(h.centre_m[0] == near(0.5));
    CHECK(h.centre_m[1] == near(1.0));
    CHECK(h.centre_m[2] == near(1.5));
    // m (b^2 + c^2) / 3 about a corner; -m a b / 4 off the diagonal.
    CHECK(h.inertia_kg_m2[0] == near(0.6 * (4 + 9) / 3));
    CHECK(h.inertia_kg_m2[1] == near(0.6 * (1 + 9) / 3));
    CHECK(h.inertia_kg_m2[2] == near(0.6 * (1 + 4) / 3));
    CHECK(h.inertia_kg_m2[3] == near(-0.6 * 2 / 4));
    CHECK(h.inertia_kg_m2[4] == near(-0.6 * 3 / 4));
    CHECK(h.inertia_kg_m2[5] == near(-0.6 * 6 / 4));
  }

  TEST_CASE("the lanes are the vertices by coordinate, padded with the first") {
    const LoadedScene scene(scene_of(prism(5, 0.02, 0.1), {box({0, 0, 0}, {1, 2, 3})}));
    for (std::uint32_t i = 0; i < 2; ++i) {
      const PieceView piece = scene.view.piece(i);
      CHECK(piece.lane_count == (i == 0 ? 16 : 8));
      for (std::uint32_t v = 0; v < piece.lane_count; ++v) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          CHECK(piece.lanes[k * piece.lane_count + v] ==
                piece.vertices[3 * (v < piece.vertex_count ? v : 0) + k]);
        }
      }
    }
  }

  TEST_CASE("more pairs than a list holds are refused before anything is made of the pieces") {
    // Pieces without corners: what comes after the count refuses the width of the near set.
    const auto refusal = [](std::size_t moving, std::size_t fixed,
                            std::uint32_t goal_contact = 1) -> std::string {
      tools::SceneDescription scene;
      scene.name = "many";
      scene.parameters.epsilon_m = -1.0;
      scene.parameters.goal_contact = goal_contact;
      scene.moving.body.pieces.resize(moving);
      scene.statics.resize(2);
      scene.statics[0].body.pieces.resize(fixed / 2);
      scene.statics[1].body.pieces.resize(fixed - fixed / 2);
      try {
        (void)tools::write_scene(scene);
      } catch (const tools::InputError& error) {
        return error.what();
      }
      return "";
    };
    CHECK(refusal(65536, 65536) ==
          "scene 'many': 65536 pieces of the moving part and 65536 of the static ones make "
          "4294967296 pairs, limit where they are listed (goal_contact) "
          "4294967294; simplify a part, to 65535 pieces of the moving one or 65535 of the static "
          "ones");
    CHECK(refusal(65535, 65537).find("4294967295 pairs, limit") != std::string::npos);
    CHECK(refusal(65536, 65536, 0).find("epsilon_m is out of its range") != std::string::npos);
    CHECK(refusal(65535, 65536).find("epsilon_m is out of its range") != std::string::npos);
    CHECK(refusal(1, 1).find("epsilon_m is out of its range") != std::string::npos);
  }

  TEST_CASE("scenes that cannot be are refused with the reason") {
    tools::SceneDescription none = scene_of(box({0, 0, 0}, {1, 1, 1}), {});
    CHECK_THROWS_WITH_AS(tools::write_scene(none), doctest::Contains("no static part"),
                         tools::InputError);
    tools::SceneDescription turned =
        scene_of(box({0, 0, 0}, {1, 1, 1}), {box({0, 0, 0}, {1, 1, 1})});
    turned.statics[0].quaternion_wxyz = {1, 1, 0, 0};
    CHECK_THROWS_WITH_AS(tools::write_scene(turned), doctest::Contains("not of unit length"),
                         tools::InputError);
    tools::SceneDescription soft = scene_of(box({0, 0, 0}, {1, 1, 1}), {box({0, 0, 0}, {1, 1, 1})});
    soft.parameters.k_f_n_per_m = 0;
    CHECK_THROWS_WITH_AS(tools::write_scene(soft), doctest::Contains("out of its range"),
                         tools::InputError);
  }
}
