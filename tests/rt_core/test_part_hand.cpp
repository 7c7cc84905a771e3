// SPDX-License-Identifier: Apache-2.0
// A hand that holds one part after another: a block is put down on a table, a second one beside it,
// and the first is taken up again.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "rt_core/part_hand.hpp"
#include "tests/support/shapes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kBlockHalf_m = 0.01, kHandStiffness_n_per_m = 1000;
constexpr double kNear_m = HAPTIC_REAL_IS_FLOAT ? 2e-6 : 2e-7;
constexpr double kTurn_rad = 0.3;  ///< about z, of the second block at the start

tools::Body block() {
  return box({-kBlockHalf_m, -kBlockHalf_m, -kBlockHalf_m},
             {kBlockHalf_m, kBlockHalf_m, kBlockHalf_m});
}

/// Where it starts: the first over the table, the second on it, the table below z = 0.
tools::PlacedBody placed(std::size_t part) {
  tools::PlacedBody body;
  if (part == 2) {
    body.body = box({-0.1, -0.1, -0.02}, {0.1, 0.1, 0});
    return body;
  }
  body.body = block();
  body.position_m = part == 0 ? Point{0, 0, 0.03} : Point{0.05, 0, kBlockHalf_m + 1e-5};
  if (part == 1) body.quaternion_wxyz = {std::cos(kTurn_rad / 2), 0, 0, std::sin(kTurn_rad / 2)};
  return body;
}

tools::SceneDescription holding(std::size_t part) {
  std::vector<tools::Body> statics;
  std::vector<tools::PlacedBody> others;
  for (std::size_t k = 0; k < 3; ++k) {
    if (k == part) continue;
    others.push_back(placed(k));
    statics.push_back(others.back().body);
  }
  tools::SceneDescription scene = scene_of(placed(part).body, statics);
  scene.moving = placed(part);
  scene.statics = others;
  scene.parameters.law = LawId::kProxy;
  scene.parameters.goal_contact = 0;
  scene.parameters.coupling.k_t_n_per_m = kHandStiffness_n_per_m;
  return scene;
}

/// The scene of all three, and a hand.
struct Bench {
  Bench() {
    std::vector<tools::HeldPart> parts(3);
    for (std::uint32_t k = 0; k < 3; ++k) {
      parts[k].role = k == 0 ? PartRole::kHand : k == 1 ? PartRole::kPlaced : PartRole::kFixed;
      const tools::PlacedBody body = placed(k);
      for (std::size_t i = 0; i < 3; ++i) parts[k].start.p_wa_m[i] = body.position_m[i];
      for (std::size_t i = 0; i < 4; ++i)
        parts[k].start.q_wa_xyzw[i] = body.quaternion_wxyz[(i + 1) % 4];
      if (k == 2) continue;
      parts[k].scene = tools::write_scene(holding(k));
      for (std::uint32_t other = 0; other < 3; ++other)
        if (other != k) parts[k].others.push_back(other);
    }
    const std::vector<std::byte> bytes = tools::with_parts(tools::write_scene(holding(0)), parts);
    blob = tools::SceneBytes(bytes);
    REQUIRE(SceneView::open(blob.span(), view) == RtStatus::kOk);
    REQUIRE(PartScenes::open(view, scenes) == RtStatus::kOk);
    for (int k = 0; k < 2; ++k) {
      room[k] = tools::SceneBytes(scenes.most_bytes());
      state[k] = tools::SceneBytes(scenes.most_state_bytes());
    }
    REQUIRE(hand.begin(scenes, {room[0].span(), state[0].span(), {}},
                       {room[1].span(), state[1].span(), {}}) == RtStatus::kOk);
  }

  StepResult step(const Point& p) {
    StepInput input;
    for (int k = 0; k < 3; ++k)
      input.pose_wa.p_wa[k] = static_cast<Real>(p[static_cast<std::size_t>(k)]);
    device = p;
    const StepResult result = hand.step(input);
    const double force_n = static_cast<double>(result.wrench_w.force_w.norm());
    largest_step_n =
        std::max(largest_step_n,
                 static_cast<double>((result.wrench_w.force_w - last.wrench_w.force_w).norm()));
    most_n = std::max(most_n, force_n);
    rejected += result.counters.proxy_rejected;
    last = result;
    return result;
  }
  /// Straight from where the device is.
  StepResult go(const Point& to, int ticks) {
    const Point from = device;
    for (int k = 1; k <= ticks; ++k) {
      const double s = static_cast<double>(k) / ticks;
      step({from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
            from[2] + s * (to[2] - from[2])});
    }
    return last;
  }
  void let_go() {
    hand.release();
    for (int k = 0; k < 500 && hand.phase() != PartHand::Phase::kEmpty; ++k) step(device);
    REQUIRE(hand.phase() == PartHand::Phase::kEmpty);
  }

  tools::SceneBytes blob, room[2], state[2];
  SceneView view;
  PartScenes scenes;
  PartHand hand;
  Point device{0, 0, 0.03};
  StepResult last;
  double largest_step_n = 0, most_n = 0;
  std::uint32_t rejected = 0;
};

double z_of(const PartPlace& place) { return place.p_wa_m[2]; }

}  // namespace

TEST_SUITE("rt_core.part_hand") {
  TEST_CASE("a block is put down, another one beside it, and the first is taken up again") {
    Bench bench;
    CHECK(bench.scenes.count() == 3);
    CHECK(bench.scenes.may_be_held(1));
    CHECK_FALSE(bench.scenes.may_be_held(2));
    bench.step(bench.device);
    CHECK(bench.last.wrench_w.force_w.norm() == 0);

    // Down onto the table, pressed with 2 N, let go: it stays where it was felt.
    bench.go({0, 0, kBlockHalf_m - 2e-3}, 400);
    CHECK(static_cast<double>(bench.last.wrench_w.force_w.z()) == doctest::Approx(2).epsilon(1e-3));
    const Pose felt = bench.last.proxy_pose_wa;
    bench.largest_step_n = 0;
    bench.let_go();
    CHECK(bench.largest_step_n <= 2.0 / 45);  // the ramp takes 50 ms
    const PartPlace down = bench.hand.places()[0];
    CHECK(std::abs(z_of(down) - kBlockHalf_m) <= kNear_m);
    CHECK(std::abs(z_of(down) - static_cast<double>(felt.p_wa.z())) <= kNear_m);

    // The hand goes elsewhere, and feels nothing.
    bench.go({0.02, 0.03, 0.07}, 100);
    CHECK(bench.last.wrench_w.force_w.norm() == 0);
    CHECK((bench.last.proxy_pose_wa.p_wa - felt.p_wa).norm() <= static_cast<Real>(kNear_m));

    // The second block is taken where it lies, by a device elsewhere, and with no force.
    bench.largest_step_n = 0;
    REQUIRE(bench.hand.prepare(1) == RtStatus::kOk);
    bench.step(bench.device);
    CHECK(bench.hand.part() == 1);
    CHECK(bench.last.wrench_w.force_w.norm() == 0);
    CHECK(std::abs(static_cast<double>(bench.last.proxy_pose_wa.p_wa.x()) - 0.05) <= kNear_m);
    for (int k = 0; k < 300; ++k) bench.step(bench.device);
    CHECK(bench.largest_step_n == 0);
    CHECK(bench.last.wrench_w.force_w.norm() == 0);

    // 1 mm up, then against the first block: an edge of the one, turned by 0.3 rad, meets a face of
    // the other 2 mm before the goal.
    const double half = kBlockHalf_m * (std::cos(kTurn_rad) + std::sin(kTurn_rad));
    const double way_m = 0.05 - half - kBlockHalf_m + 2e-3;
    const Point from = bench.device;
    bench.go({from[0], from[1], from[2] + 1e-3}, 50);
    bench.go({from[0] - way_m, from[1], from[2] + 1e-3}, 600);
    CHECK(static_cast<double>(bench.last.wrench_w.force_w.x()) == doctest::Approx(2).epsilon(0.05));
    bench.let_go();
    CHECK(std::abs(bench.hand.places()[1].p_wa_m[0] - (half + kBlockHalf_m)) <= 2e-4);
    CHECK(bench.hand.places()[0] == down);

    // The first one again: free to go up, stopped by the second.
    REQUIRE(bench.hand.prepare(0) == RtStatus::kOk);
    bench.step(bench.device);
    for (int k = 0; k < 200; ++k) bench.step(bench.device);
    CHECK(bench.last.wrench_w.force_w.norm() <= static_cast<Real>(1e3 * kNear_m));
    const Point at = bench.device;
    bench.go({at[0] + 3e-3, at[1], at[2]}, 200);
    CHECK(static_cast<double>(bench.last.wrench_w.force_w.x()) < -1);
    bench.go({at[0], at[1], at[2] + 0.03}, 400);
    CHECK(bench.last.wrench_w.force_w.norm() == 0);
    CHECK(std::abs(static_cast<double>(bench.last.proxy_pose_wa.p_wa.z()) - (z_of(down) + 0.03)) <=
          kNear_m);
    if (!HAPTIC_REAL_IS_FLOAT) CHECK(bench.rejected == 0);
  }

  TEST_CASE("a part that stays keeps its place to the bit over any number of holds") {
    Bench bench;
    const PartPlace second = bench.hand.places()[1];
    bench.step(bench.device);
    bench.let_go();
    const PartPlace first = bench.hand.places()[0];
    for (int k = 0; k < 5; ++k) {
      for (const std::uint32_t part : {1u, 0u}) {
        REQUIRE(bench.hand.prepare(part) == RtStatus::kOk);
        for (int tick = 0; tick < 3; ++tick) bench.step(bench.device);
        bench.let_go();
      }
    }
    CHECK(bench.hand.places()[0] == first);
    CHECK(bench.hand.places()[1] == second);
  }

  TEST_CASE("a reset leaves a part that was taken, or is being let go, where it is felt") {
    const auto apart_m = [](const StepResult& result, const Pose& from) {
      return static_cast<double>((result.proxy_pose_wa.p_wa - from.p_wa).norm());
    };
    Bench bench;
    bench.step(bench.device);
    // The first part, led from its start on: it begins where the device is.
    bench.hand.reset();
    CHECK(bench.step({0, 0, 0.04}).proxy_pose_wa.p_wa.z() == 0.04_r);

    // Being let go while it presses.
    bench.go({0, 0, kBlockHalf_m - 2e-3}, 400);
    const Pose pressed = bench.last.proxy_pose_wa;
    bench.hand.release();
    for (int k = 0; k < 5; ++k) bench.step(bench.device);
    bench.hand.reset();
    bench.step({0.01, 0, 0.05});
    CHECK(apart_m(bench.last, pressed) <= kNear_m);
    for (int k = 0; k < 100; ++k) bench.step(bench.device);
    REQUIRE(bench.hand.phase() == PartHand::Phase::kEmpty);
    CHECK(apart_m(bench.last, pressed) <= kNear_m);

    // Each one taken where it lies by a device far away; the first time before it has had a tick.
    bench.go({0.02, 0.03, 0.07}, 100);
    for (const std::uint32_t part : {0u, 1u, 0u}) {
      CAPTURE(part);
      const PartPlace place = bench.hand.places()[part];
      REQUIRE(bench.hand.prepare(part) == RtStatus::kOk);
      CHECK(bench.step({NAN, 0, 0}).status != RtStatus::kOk);
      bench.hand.reset();
      bench.step({0.02, 0.03, 0.07});
      for (int k = 0; k < 3; ++k)
        CHECK(std::abs(static_cast<double>(bench.last.proxy_pose_wa.p_wa[k]) - place.p_wa_m[k]) <=
              kNear_m);
      for (int k = 0; k < 100; ++k) bench.step(bench.device);
      bench.go({0.02, 0.03, 0.075}, 50);
      const Pose lifted = bench.last.proxy_pose_wa;
      CHECK(static_cast<double>(lifted.p_wa.z()) - place.p_wa_m[2] ==
            doctest::Approx(0.005).epsilon(1e-3));
      bench.hand.reset();
      bench.step({-0.01, 0.02, 0.06});
      CHECK(apart_m(bench.last, lifted) <= kNear_m);
      CHECK(bench.last.wrench_w.force_w.norm() == 0);
      bench.go({0.02, 0.03, 0.07}, 50);
      bench.let_go();
    }
  }

  TEST_CASE("what cannot be held is refused, and changes nothing") {
    Bench bench;
    bench.step(bench.device);
    CHECK(bench.hand.prepare(1) == RtStatus::kNotGraspable);  // it holds the first still
    bench.let_go();
    CHECK(bench.hand.prepare(2) == RtStatus::kNotGraspable);  // the table
    CHECK(bench.hand.prepare(7) == RtStatus::kNotGraspable);
    CHECK(bench.hand.phase() == PartHand::Phase::kEmpty);
    bench.hand.release();
    CHECK(bench.hand.phase() == PartHand::Phase::kEmpty);
    CHECK(bench.hand.prepare(0) == RtStatus::kOk);
    CHECK(bench.hand.prepare(1) == RtStatus::kNotGraspable);  // it is to take the first

    const LoadedScene alone(tools::write_scene(holding(0)));
    PartScenes none;
    REQUIRE(PartScenes::open(alone.view, none) == RtStatus::kOk);
    CHECK(none.count() == 0);
    PartHand hand;
    CHECK(hand.begin(none, {}, {}) == RtStatus::kNotGraspable);
  }
}
