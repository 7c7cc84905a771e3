// SPDX-License-Identifier: Apache-2.0
// Static bodies that stand elsewhere than where their scene was compiled. The judge needs no second
// scene: where the whole world is moved by one rigid motion, forces turn with it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "rt_core/scene/placed_bodies.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// Differences of what is felt, over the largest force. What sticks and slips does so a tick sooner
/// or later.
constexpr double kShare = HAPTIC_REAL_IS_FLOAT ? 5e-3 : 2e-4, kRubbingShare = 1e-2;

struct alignas(kSceneAlignment) Line {
  std::byte bytes[kSceneAlignment];
};

PartPlace start_of(const SceneView& scene) {
  PartPlace place;
  std::copy_n(scene.parameters().start_p_wa_m, 3, place.p_wa_m);
  std::copy_n(scene.parameters().start_q_wa_xyzw, 4, place.q_wa_xyzw);
  return place;
}

RtStatus place_bodies(const SceneView& scene, const PartPlace& start,
                      const std::vector<BodyMove>& moves, std::span<std::byte> memory) {
  PlacedBodies placed;
  RtStatus status = placed.begin(scene, start, memory);
  for (std::size_t b = 0; b < moves.size() && status == RtStatus::kOk; ++b)
    status = placed.move(b + 1, moves[b]);
  if (status == RtStatus::kOk) CHECK(placed.finish().size() == scene.blob().size());
  return status;
}

/// A copy of a scene with its static bodies elsewhere.
struct Placed {
  Placed(const SceneView& scene, const std::vector<BodyMove>& moves)
      : lines(scene.blob().size() / kSceneAlignment + 2), size(scene.blob().size()) {
    status = place_bodies(scene, start_of(scene), moves, memory());
  }
  std::span<std::byte> memory() { return {lines[0].bytes, size}; }
  std::vector<std::byte> blob() { return {memory().begin(), memory().end()}; }

  std::vector<Line> lines;
  std::size_t size;
  RtStatus status = RtStatus::kOk;
};

BodyMove move_of(const Eigen::Quaterniond& turn, const Eigen::Vector3d& shift_m) {
  BodyMove move;
  for (int k = 0; k < 3; ++k) move.shift_m[k] = shift_m[k];
  for (int k = 0; k < 4; ++k) move.turn_xyzw[k] = turn.coeffs()[k];
  return move;
}

BodyMove random_move(Random& random) {
  const auto number = [&] { return random.uniform(-1, 1); };
  const Eigen::Quaterniond turn(number(), number(), number(), number());
  return move_of(turn.normalized(), {0.05 * number(), 0.05 * number(), 0.05 * number()});
}

Eigen::Quaterniond turn_of(const BodyMove& move) {
  return Eigen::Quaterniond(move.turn_xyzw[3], move.turn_xyzw[0], move.turn_xyzw[1],
                            move.turn_xyzw[2]);
}
Eigen::Vector3d shift_of(const BodyMove& move) { return Eigen::Vector3d(move.shift_m); }

/// A slab, a wedge on it and a hull beside it: faces, edges and a vertex to touch.
tools::SceneDescription world(LawId law, double friction) {
  tools::SceneDescription scene = scene_of(
      random_hull(3, 14, {0.01, 0.012, 0.009}),
      {box({-0.05, -0.05, -0.03}, {0.05, 0.05, 0}),
       tetrahedron({0.01, 0, 0.02}, {0.04, 0.03, -0.01}, {0.04, -0.03, -0.01}, {0.015, 0, -0.01}),
       random_hull(5, 12, {0.02, 0.015, 0.02})});
  scene.parameters.law = law;
  scene.parameters.goal_contact = law == LawId::kProxy ? 0 : 1;
  for (tools::PlacedBody& body : scene.statics) body.friction = body.friction_static = friction;
  scene.statics[2].position_m = {-0.035, 0, 0.015};
  return scene;
}

Wrench in_world(const Wrench& wrench, const BodyMove& move) {
  const Quat turn = turn_of(move).cast<Real>();
  return {turn * wrench.force_w, turn * wrench.torque_w};
}

double apart(const Wrench& a, const Wrench& b) {
  return static_cast<double>(
      std::max((a.force_w - b.force_w).norm(), 50 * (a.torque_w - b.torque_w).norm()));
}

/// Slides along what is there, in both worlds; the largest difference of what is felt.
double largest_difference(const tools::SceneDescription& description, const BodyMove& move,
                          const BodyMove& seen, double& most_n) {
  LoadedScene home(description);
  Placed placed(home.view, std::vector<BodyMove>(home.view.bodies().size() - 1, move));
  REQUIRE(placed.status == RtStatus::kOk);
  LoadedScene away(placed.blob());
  double worst = 0;
  most_n = 0;
  for (int k = 0; k < 600; ++k) {
    const double s = k / 600.0;
    const Eigen::Vector3d at(-0.03 + 0.06 * s, 0.01 * std::sin(6 * s), 0.025 - 0.02 * s);
    const Eigen::Quaterniond q(
        Eigen::AngleAxisd(0.4 * std::sin(9 * s), Eigen::Vector3d(1, 2, 3).normalized()));
    const auto step = [](LoadedScene& scene, const Eigen::Vector3d& p,
                         const Eigen::Quaterniond& turn) {
      return scene.step({p[0], p[1], p[2]}, {turn.w(), turn.x(), turn.y(), turn.z()}).spring_w;
    };
    const Wrench here = step(home, at, q);
    const Wrench there =
        step(away, turn_of(move) * at + shift_of(move), (turn_of(move) * q).normalized());
    worst = std::max(worst, apart(in_world(here, seen), there));
    most_n = std::max(most_n, static_cast<double>(here.force_w.norm()));
  }
  return worst;
}

}  // namespace

TEST_SUITE("rt_core.placed_bodies") {
  TEST_CASE("bodies that stay keep every bit; one that is moved leaves the others theirs") {
    LoadedScene home(world(LawId::kProxy, 0));
    Placed same(home.view, std::vector<BodyMove>(3));
    REQUIRE(same.status == RtStatus::kOk);
    CHECK(std::memcmp(same.memory().data(), home.view.blob().data(), same.size) == 0);

    Random random(1);
    Placed other(home.view, {BodyMove{}, random_move(random), BodyMove{}});
    LoadedScene away(other.blob());
    for (const std::size_t b : {std::size_t{0}, std::size_t{1}, std::size_t{3}}) {
      const BodyRecord& body = home.view.bodies()[b];
      CHECK(std::memcmp(&body, &away.view.bodies()[b], sizeof body) == 0);
      for (std::uint32_t i = body.piece_begin; i < body.piece_begin + body.piece_count; ++i) {
        const PieceView was = home.view.piece(i), is = away.view.piece(i);
        CHECK(std::memcmp(was.vertices, is.vertices, 3 * sizeof(Real) * was.vertex_count) == 0);
        CHECK(std::memcmp(was.arcs, is.arcs, sizeof(EdgeArc) * was.edge_count) == 0);
      }
    }
  }

  TEST_CASE("a world that is moved as a whole is felt as before, turned") {
    Random random(2);
    for (const double friction : {0.0, 0.3}) {
      for (int trial = 0; trial < 6; ++trial) {
        CAPTURE(friction);
        CAPTURE(trial);
        const BodyMove move = random_move(random);
        double most_n = 0;
        const double worst = largest_difference(world(LawId::kProxy, friction), move, move, most_n);
        CHECK(most_n > 1);
        CHECK(worst <= (friction > 0 ? std::max(kRubbingShare, kShare) : kShare) * most_n);
      }
    }
  }

  TEST_CASE("turned by next to nothing about any axis, a part is a sound one still") {
    Random random(4);
    tools::SceneDescription scene = scene_of(prism(24, 0.005, 0.04), {prism(24, 0.005, 0.04)});
    scene.statics[0].position_m = {0, 0, -0.05};
    LoadedScene home(scene);
    for (int trial = 0; trial < 200; ++trial) {
      const auto number = [&] { return random.uniform(-1, 1); };
      const Eigen::Vector3d axis(number(), number(), number());
      const double angle = std::pow(10.0, 8 * number() - 8);
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, axis.normalized()));
      Placed placed(home.view, {move_of(turn, {0.001 * number(), 0, 0})});
      SceneView view;
      CAPTURE(angle);
      CHECK(SceneView::open(placed.memory(), view) == RtStatus::kOk);
    }
  }

  TEST_CASE("a facet that is moved is a sound one, and felt as before beside solids") {
    tools::SceneDescription scene = world(LawId::kProxy, 0);
    scene.statics.insert(scene.statics.begin(), {facet({{-0.02, -0.05, 0.004},
                                                        {0.01, -0.05, 0.004},
                                                        {0.01, 0.05, 0.01},
                                                        {-0.02, 0.05, 0.01}}),
                                                 {0, 0, 0}});
    Random random(5);
    for (int trial = 0; trial < 4; ++trial) {
      CAPTURE(trial);
      const BodyMove move = random_move(random);
      double most_n = 0;
      const double worst = largest_difference(scene, move, move, most_n);
      CHECK(most_n > 1);
      CHECK(worst <= kShare * most_n);
    }
  }

  TEST_CASE("so is one without a part of its own, under law paper") {
    Random random(3);
    const BodyMove move = random_move(random);
    double most_n = 0;
    const double worst = largest_difference(world(LawId::kPaper, 0), move, move, most_n);
    CHECK(most_n > 1);
    CHECK(worst <= kShare * most_n);
  }

  TEST_CASE("the judge sees a world that is turned by a degree more") {
    Random random(2);
    const BodyMove move = random_move(random);
    const Eigen::Quaterniond more =
        turn_of(move) * Eigen::AngleAxisd(0.0175, Eigen::Vector3d::UnitX());
    double most_n = 0;
    const double worst = largest_difference(world(LawId::kProxy, 0), move,
                                            move_of(more.normalized(), shift_of(move)), most_n);
    CHECK(worst > 2 * kShare * most_n);
  }

  TEST_CASE("what cannot be placed is refused") {
    LoadedScene home(world(LawId::kProxy, 0));
    const std::vector<BodyMove> none(3);
    std::vector<Line> lines(home.view.blob().size() / kSceneAlignment + 2);
    const std::span<std::byte> memory(lines[0].bytes, home.view.blob().size());
    CHECK(place_bodies(home.view, start_of(home.view), none, memory) == RtStatus::kOk);
    CHECK(place_bodies(home.view, start_of(home.view), none, memory.first(memory.size() - 1)) ==
          RtStatus::kMemoryTooSmall);
    CHECK(place_bodies(home.view, start_of(home.view), none, {lines[0].bytes + 8, memory.size()}) ==
          RtStatus::kMemoryMisaligned);
    CHECK(place_bodies(home.view, start_of(home.view), std::vector<BodyMove>(4), memory) ==
          RtStatus::kBlobBadCount);
    std::vector<BodyMove> far = none, bent = none, lost = none;
    far[1].shift_m[2] = 2 * kMaxSceneLength_m;
    bent[1].turn_xyzw[0] = 0.1;
    lost[1].turn_xyzw[0] = std::nan("");
    for (const std::vector<BodyMove>& moves : {far, bent, lost})
      CHECK(place_bodies(home.view, start_of(home.view), moves, memory) ==
            RtStatus::kBlobBadNumber);
  }
}
