// SPDX-License-Identifier: Apache-2.0
// Two blocks on a plate, held one after another: by a core, and in a session.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"

using namespace haptic::test;

namespace {

constexpr std::uint32_t kBlock = 0, kOther = 1, kPlate = 2;

/// The other block stands 0.1 mm above the plate, 30 mm beside the first.
struct TwoBlocks : BlockOnPlate {
  TwoBlocks() : other(block), parts{part_of(other), fixed} {
    moving.name = "block";
    parts[0].name = "other";
    parts[0].may_be_held = 1;
    parts[0].pose[0] = 0.030;
    parts[0].pose[2] = 0.0151;
    parts[1].name = "plate";
    input.fixed = parts.data();
    input.fixed_count = parts.size();
  }
  BoxArrays other;
  std::array<haptic_part, 2> parts;
};

std::span<const std::byte> two_blocks() {
  static const CompiledHandle scene = compiled(TwoBlocks().input);
  return bytes_of(scene);
}

/// A core with a hand that is led from place to place at 0.1 m/s.
struct LedCore {
  explicit LedCore(haptic_core* led) : core(led) { input.pose[2] = 0.035; }

  void step() {
    REQUIRE(haptic_core_step(core, &input, &output) == HAPTIC_OK);
    input.time_s += 0.001;
    const double before_n = force_n;
    force_n = std::hypot(output.wrench[0], output.wrench[1], output.wrench[2]);
    largest_step_n = std::max(largest_step_n, std::abs(force_n - before_n));
  }
  void go_to(double x_m, double z_m) {
    const double way_m = std::hypot(x_m - input.pose[0], z_m - input.pose[2]);
    const int ticks = static_cast<int>(std::ceil(way_m / 1e-4));
    const double from_x = input.pose[0], from_z = input.pose[2];
    for (int k = 1; k <= ticks; ++k) {
      input.pose[0] = from_x + (x_m - from_x) * k / ticks;
      input.pose[2] = from_z + (z_m - from_z) * k / ticks;
      step();
    }
    for (int k = 0; k < 20; ++k) step();
  }
  /// @return how many ticks it took to let go of what was held.
  int hold(std::uint32_t part) {
    for (int ticks = 0; ticks < 1000; ++ticks) {
      const int error = haptic_core_hold_part(core, 0, part);
      if (error == HAPTIC_OK) return ticks;
      REQUIRE(error == HAPTIC_ERROR_BUSY);
      step();
    }
    FAIL("the hand does not let go");
    return 0;
  }
  std::vector<haptic_body> bodies() const {
    std::vector<haptic_body> bodies(8);
    std::size_t count = 0;
    REQUIRE(haptic_core_bodies(core, bodies.data(), bodies.size(), sizeof bodies[0], &count) ==
            HAPTIC_OK);
    bodies.resize(count);
    return bodies;
  }

  haptic_core* core;
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  double force_n = 0, largest_step_n = 0;
};

}  // namespace

TEST_SUITE("tools.library") {
  TEST_CASE("core: one block is let go without a jump, the other is taken and laid on it") {
    const CoreBench bench(two_blocks());
    LedCore hand(bench.core());
    hand.step();
    std::vector<haptic_body> bodies = hand.bodies();
    REQUIRE(bodies.size() == 3);
    CHECK(std::string(bodies[kBlock].name) == "block");
    CHECK(std::string(bodies[kOther].name) == "other");
    CHECK(bodies[kBlock].role == 2);
    CHECK(bodies[kOther].role == 3);
    CHECK(bodies[kPlate].role == 1);
    CHECK(bodies[kBlock].held_by == 1);

    hand.go_to(0, 0.010);
    CHECK(hand.force_n == doctest::Approx(2.5).epsilon(0.02));
    hand.largest_step_n = 0;
    CHECK(hand.hold(kOther) > 20);
    CHECK(hand.force_n == 0);
    hand.step();
    CHECK(hand.force_n < 1e-3);
    CHECK(hand.largest_step_n < 2.5 / 20);
    bodies = hand.bodies();
    CHECK(bodies[kBlock].held_by == 0);
    CHECK(bodies[kOther].held_by == 1);
    CHECK(bodies[kBlock].pose[2] == doctest::Approx(0.015).epsilon(1e-4));
    CHECK(bodies[kOther].pose[2] == doctest::Approx(0.0151).epsilon(1e-6));
    const double left_z_m = bodies[kBlock].pose[2];

    // The hand is at z = 10 mm, the block that it holds at 15.1: it leads it on from there.
    hand.go_to(0, 0.040);
    CHECK(hand.bodies()[kOther].pose[2] == doctest::Approx(0.0451).epsilon(1e-4));
    hand.go_to(-0.030, 0.040);
    hand.go_to(-0.030, 0.026);  // 4 mm below the top of the first block
    CHECK(hand.force_n == doctest::Approx(500 * 0.0039).epsilon(0.02));
    bodies = hand.bodies();
    CHECK(bodies[kOther].pose[0] == doctest::Approx(0).epsilon(1e-6));
    CHECK(bodies[kOther].pose[2] == doctest::Approx(0.035).epsilon(1e-4));
    CHECK(bodies[kBlock].pose[2] == left_z_m);

    REQUIRE(haptic_core_release_part(hand.core, 0) == HAPTIC_OK);
    for (int k = 0; k < 100; ++k) hand.step();
    CHECK(hand.force_n == 0);
    CHECK(hand.bodies()[kOther].held_by == 0);
    CHECK(hand.hold(kBlock) == 0);
    hand.step();
    CHECK(hand.bodies()[kBlock].held_by == 1);
    // Held again, with the other lying on it.
    hand.go_to(-0.030, 0.036);
    CHECK(hand.force_n > 1);
    CHECK(hand.bodies()[kBlock].pose[2] == doctest::Approx(left_z_m).epsilon(1e-3));
  }

  TEST_CASE("core and session: what is no part, no hand, or no room for bodies") {
    const CoreBench parts(two_blocks()), one;
    for (const std::uint32_t none : {kPlate, 3u, 99u})
      CHECK(haptic_core_hold_part(parts.core(), 0, none) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_hold_part(parts.core(), 1, kOther) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_release_part(parts.core(), 1) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_hold_part(one.core(), 0, 0) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_release_part(one.core(), 0) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_hold_part(nullptr, 0, 0) == HAPTIC_ERROR_NULL);
    haptic_body body;
    std::size_t count = 7;
    CHECK(haptic_core_bodies(one.core(), &body, 1, sizeof body, &count) == HAPTIC_ERROR_PART);
    CHECK(count == 0);
    CHECK(haptic_core_bodies(parts.core(), &body, 1, sizeof body, &count) == HAPTIC_OK);
    CHECK(count == 3);
    CHECK(haptic_core_bodies(parts.core(), &body, 0, sizeof body, &count) == HAPTIC_ERROR_SIZE);
    CHECK(haptic_core_bodies(parts.core(), &body, 1, 8, &count) == HAPTIC_ERROR_VERSION);
    CHECK(haptic_core_bodies(parts.core(), nullptr, 1, sizeof body, &count) == HAPTIC_ERROR_NULL);
    CHECK(haptic_core_bodies(parts.core(), &body, 1, sizeof body, nullptr) == HAPTIC_ERROR_NULL);
    CHECK(haptic_session_hold_part(nullptr, 0, 0) == HAPTIC_ERROR_NULL);
    CHECK(haptic_session_release_part(nullptr, 0) == HAPTIC_ERROR_NULL);
    CHECK(haptic_session_bodies(nullptr, &body, 1, sizeof body, &count) == HAPTIC_ERROR_NULL);
  }

  TEST_CASE("core: two hands press their blocks on each other, and feel the same") {
    TwoBlocks scene;
    scene.parts[0].may_be_held = HAPTIC_HAND2;
    scene.parts[0].pose[2] = 0.035;
    const CompiledHandle compiled_scene = compiled(scene.input);
    const CoreBench bench(bytes_of(compiled_scene)), one_hand(two_blocks());
    haptic_step_input first = HAPTIC_STEP_INPUT_INIT, second = HAPTIC_STEP_INPUT_INIT;
    haptic_step_output of_first = HAPTIC_STEP_OUTPUT_INIT, of_second = HAPTIC_STEP_OUTPUT_INIT;
    first.pose[2] = second.pose[2] = 0.035;
    second.pose[0] = 0.030;
    const auto step = [&] {
      first.time_s = second.time_s = first.time_s + 0.001;
      return haptic_core_step_hands(bench.core(), &first, &second, &of_first, &of_second);
    };
    for (int k = 0; k < 5; ++k) REQUIRE(step() == HAPTIC_OK);
    // 10 mm are between them; the first comes 20 mm, and the springs share what is left.
    for (int k = 0; k < 200; ++k) {
      first.pose[0] += 1e-4;
      REQUIRE(step() == HAPTIC_OK);
    }
    for (int k = 0; k < 100; ++k) REQUIRE(step() == HAPTIC_OK);
    CHECK(of_first.wrench[0] < -1);
    CHECK(of_first.wrench[0] == doctest::Approx(-of_second.wrench[0]));
    CHECK(of_second.felt_pose[0] - of_first.felt_pose[0] == doctest::Approx(0.020));
    std::vector<haptic_body> bodies(3);
    std::size_t count = 0;
    REQUIRE(haptic_core_bodies(bench.core(), bodies.data(), 3, sizeof bodies[0], &count) ==
            HAPTIC_OK);
    CHECK(bodies[0].held_by == 1);
    CHECK(bodies[1].held_by == 2);
    CHECK(bodies[1].role == 5);
    CHECK(bodies[1].pose[0] == of_second.felt_pose[0]);
    // Without an input a hand keeps its goal, and a bad pose stops one alone.
    first.time_s += 0.001;
    CHECK(haptic_core_step_hands(bench.core(), &first, nullptr, &of_first, nullptr) == HAPTIC_OK);
    second.pose[6] = 0.5;
    CHECK(step() == HAPTIC_ERROR_POSE);
    CHECK(of_second.wrench[0] == 0);
    CHECK(of_first.wrench[0] < -1);
    second.pose[6] = 1;
    second.time_s = 7;
    CHECK(haptic_core_step_hands(bench.core(), &first, &second, &of_first, &of_second) ==
          HAPTIC_ERROR_NUMBER);
    CHECK(haptic_core_step_hands(bench.core(), nullptr, nullptr, &of_first, &of_second) ==
          HAPTIC_ERROR_NULL);
    CHECK(haptic_core_step_hands(bench.core(), &first, &second, &of_first, nullptr) ==
          HAPTIC_ERROR_NULL);
    CHECK(haptic_core_step_hands(one_hand.core(), &first, nullptr, &of_first, nullptr) ==
          HAPTIC_ERROR_PART);
    CHECK(haptic_core_hold_part(bench.core(), 0, 0) == HAPTIC_ERROR_PART);
    CHECK(haptic_core_release_part(bench.core(), 0) == HAPTIC_ERROR_PART);
    // One hand's calls move the first, and the second is held still.
    CHECK(haptic_core_step(bench.core(), &first, &of_first) == HAPTIC_OK);
  }

  TEST_CASE("compile: parts of one name are refused") {
    TwoBlocks scene;
    scene.parts[1].name = "block";
    haptic_compiled* compiled = nullptr;
    CHECK(haptic_compile(&scene.input, &compiled) == HAPTIC_ERROR_INPUT);
    haptic_message message = HAPTIC_MESSAGE_INIT;
    REQUIRE(haptic_compiled_message(compiled, 0, &message) == HAPTIC_OK);
    CHECK(std::string(message.text) == "block: is the name of another part too; give each its own");
    (void)haptic_compiled_free(&compiled);
  }

  TEST_CASE("session: the blocks are laid on each other") {
    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    haptic_session* session = nullptr;
    REQUIRE(haptic_session_open(two_blocks().data(), two_blocks().size(), &options, &session) ==
            HAPTIC_OK);
    const auto bodies = [&] {
      std::array<haptic_body, 3> now{};
      std::size_t count = 0;
      REQUIRE(haptic_session_bodies(session, now.data(), now.size(), sizeof now[0], &count) ==
              HAPTIC_OK);
      REQUIRE(count == now.size());
      return now;
    };
    const auto go_to = [&](double x_m, double z_m) {
      haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
      goal.pose[0] = x_m;
      goal.pose[2] = z_m;
      goal.seconds = 0.3;
      std::uint64_t number = 0;
      REQUIRE(haptic_session_move_hand(session, &goal, &number) == HAPTIC_OK);
      haptic_state now = HAPTIC_STATE_INIT;
      for (int k = 0; k < 60'000 && now.goals_reached < number; ++k) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        REQUIRE(haptic_session_state(session, &now) == HAPTIC_OK);
      }
      REQUIRE(now.goals_reached >= number);
    };
    /// A tick will make it true.
    const auto wait_for = [&](const auto& wanted) {
      for (int k = 0; k < 60'000 && !wanted(bodies()); ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return bodies();
    };
    using Bodies = std::array<haptic_body, 3>;
    (void)wait_for([](const Bodies& b) { return b[kBlock].held_by == 1; });
    CHECK(haptic_session_hold_part(session, 0, kPlate) == HAPTIC_ERROR_PART);
    CHECK(haptic_session_hold_part(session, 2, kOther) == HAPTIC_ERROR_PART);
    go_to(0, 0.010);
    REQUIRE(haptic_session_hold_part(session, 0, kOther) == HAPTIC_OK);
    Bodies now = wait_for([](const Bodies& b) { return b[kOther].held_by == 1; });
    CHECK(now[kBlock].held_by == 0);
    CHECK(now[kBlock].pose[2] == doctest::Approx(0.015).epsilon(1e-3));
    const double left_z_m = now[kBlock].pose[2];
    go_to(0, 0.045);
    go_to(-0.030, 0.045);
    go_to(-0.030, 0.020);
    now = wait_for([](const Bodies& b) { return std::abs(b[kOther].pose[2] - 0.035) < 1e-4; });
    CHECK(now[kOther].pose[2] == doctest::Approx(0.035).epsilon(1e-3));
    CHECK(now[kBlock].pose[2] == left_z_m);
    REQUIRE(haptic_session_release_part(session, 0) == HAPTIC_OK);
    now = wait_for([](const Bodies& b) { return b[kOther].held_by == 0; });
    CHECK(now[kOther].held_by == 0);
    CHECK(now[kOther].pose[2] == doctest::Approx(0.035).epsilon(1e-3));
    REQUIRE(haptic_session_close(session) == HAPTIC_OK);
    CHECK(haptic_session_hold_part(session, 0, kOther) == HAPTIC_ERROR_CLOSED);
    CHECK(bodies()[kBlock].pose[2] == left_z_m);
    (void)haptic_session_free(&session);
  }
}
