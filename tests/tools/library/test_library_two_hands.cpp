// SPDX-License-Identifier: Apache-2.0
// A block in each of two hands, in a session: each on a device of its own, both in one tick.
#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"

using namespace haptic::test;

namespace {

/// 10 mm apart, 10 mm above the plate.
struct BlocksInHands : BlockOnPlate {
  BlocksInHands() : other(block), parts{part_of(other), fixed} {
    moving.name = "block";
    parts[0].name = "other";
    parts[0].may_be_held = HAPTIC_HAND2;
    parts[0].pose[0] = 0.030;
    parts[0].pose[2] = 0.035;
    parts[1].name = "plate";
    input.fixed = parts.data();
    input.fixed_count = parts.size();
  }
  BoxArrays other;
  std::array<haptic_part, 2> parts;
};

std::span<const std::byte> blocks_in_hands() {
  static const CompiledHandle scene = compiled(BlocksInHands().input);
  return bytes_of(scene);
}

class TwoHandSession {
 public:
  explicit TwoHandSession(std::uint32_t hold) {
    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    options.hands = 2;
    options.hold = hold;
    REQUIRE(haptic_session_open(blocks_in_hands().data(), blocks_in_hands().size(), &options,
                                &session) == HAPTIC_OK);
  }
  ~TwoHandSession() { (void)haptic_session_free(&session); }
  TwoHandSession(const TwoHandSession&) = delete;
  TwoHandSession& operator=(const TwoHandSession&) = delete;

  [[nodiscard]] haptic_state state(std::uint32_t hand) const {
    haptic_state now = HAPTIC_STATE_INIT;
    REQUIRE(haptic_session_state_of(session, hand, &now) == HAPTIC_OK);
    return now;
  }
  /// A tick will make it true.
  [[nodiscard]] bool comes(const std::function<bool()>& wanted, int within_ms = 20'000) const {
    for (int k = 0; k < within_ms && !wanted(); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return wanted();
  }
  void go_to(std::uint32_t hand, double x_m) const {
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    goal.hand = hand;
    goal.pose[0] = x_m;
    goal.pose[2] = 0.035;
    goal.seconds = 0.3;
    std::uint64_t number = 0;
    REQUIRE(haptic_session_move_hand(session, &goal, &number) == HAPTIC_OK);
    REQUIRE(comes([&] { return state(hand).goals_reached >= number; }));
  }
  [[nodiscard]] double force_n(std::uint32_t hand) const { return state(hand).sent_wrench[0]; }

  haptic_session* session = nullptr;
};

constexpr std::uint32_t kArmed = 2, kFaulted = 4;

/// Two hands that press. On a busy machine a late tick may release one on its way: it is armed
/// again where its part is then, and presses no more. Then they begin again.
std::unique_ptr<TwoHandSession> pressing() {
  constexpr int kTries = 8, kWithin_ms = 2000;
  for (int k = 0; k < kTries; ++k) {
    auto two = std::make_unique<TwoHandSession>(HAPTIC_HOLD_AGAIN);
    REQUIRE(two->comes(
        [&] { return two->state(0).arming == kArmed && two->state(1).arming == kArmed; }));
    two->go_to(0, 0.010);  // 10 mm are between them
    two->go_to(1, 0.020);
    const auto presses = [&] {
      return two->force_n(0) < -0.3 && std::abs(two->force_n(0) + two->force_n(1)) < 0.05;
    };
    if (two->comes(presses, kWithin_ms)) return two;
    REQUIRE(two->state(0).armings + two->state(1).armings > 2);
  }
  FAIL("a hand was released on its way in each try");
  return nullptr;
}

}  // namespace

TEST_SUITE("tools.library.two_hands") {
  TEST_CASE("session: two hands press their blocks on each other, and feel the same") {
    const std::unique_ptr<TwoHandSession> made = pressing();
    const TwoHandSession& two = *made;
    const haptic_state first = two.state(0), second = two.state(1);
    CHECK(second.felt_pose[0] - first.felt_pose[0] == doctest::Approx(0.020).epsilon(1e-3));
    std::array<haptic_body, 3> bodies{};
    std::size_t count = 0;
    REQUIRE(haptic_session_bodies(two.session, bodies.data(), bodies.size(), sizeof bodies[0],
                                  &count) == HAPTIC_OK);
    CHECK(bodies[0].held_by == 1);
    CHECK(bodies[1].held_by == 2);
    // One lets go of its switch: its force goes, and the other one feels its part held still.
    REQUIRE(haptic_session_hold_of(two.session, 1, HAPTIC_RELEASE) == HAPTIC_OK);
    CHECK(two.comes([&] { return two.state(1).arming == 0 && two.force_n(1) == 0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (two.state(0).arming == kArmed && two.state(0).armings == 1) CHECK(two.force_n(0) < -0.1);
    REQUIRE(haptic_session_hold_of(two.session, 1, HAPTIC_HOLD_AGAIN) == HAPTIC_OK);
    CHECK(two.comes([&] { return two.state(1).arming == kArmed && two.force_n(1) > 0.1; }));
    // A stop is of both.
    REQUIRE(haptic_session_stop(two.session) == HAPTIC_OK);
    CHECK(two.comes([&] { return two.force_n(0) == 0 && two.force_n(1) == 0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    for (const std::uint32_t hand : {0u, 1u}) CHECK(two.state(hand).arming == kFaulted);
    REQUIRE(haptic_session_close(two.session) == HAPTIC_OK);
    for (const std::uint32_t hand : {0u, 1u}) {
      haptic_verdict verdict = HAPTIC_VERDICT_INIT;
      REQUIRE(haptic_session_verdict_of(two.session, hand, &verdict) == HAPTIC_OK);
      CHECK(verdict.verdict == HAPTIC_VERDICT_FOLLOWED);
      CHECK(verdict.contact_ticks > 100);
      std::vector<haptic_tick> ticks(20'000);
      std::size_t told = 0;
      REQUIRE(haptic_session_history_of(two.session, hand, ticks.data(), ticks.size(),
                                        sizeof ticks[0], &told) == HAPTIC_OK);
      CHECK(told > 500);
      CHECK(std::abs(ticks[told - 1].hand_pose[0] - (hand == 0 ? 0.0 : 0.03)) > 0.005);
    }
  }

  TEST_CASE("session: a hand that is not led, and hands that the scene has not") {
    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    haptic_session* session = nullptr;
    options.hands = 2;
    CHECK(haptic_session_open(block_scene().data(), block_scene().size(), &options, &session) ==
          HAPTIC_ERROR_PART);
    for (const int wrong : {-1, 3}) {
      options.hands = wrong;
      CHECK(haptic_session_open(blocks_in_hands().data(), blocks_in_hands().size(), &options,
                                &session) == HAPTIC_ERROR_NUMBER);
    }
    CHECK(session == nullptr);
    options.hands = 0;  // the second block is held still
    REQUIRE(haptic_session_open(blocks_in_hands().data(), blocks_in_hands().size(), &options,
                                &session) == HAPTIC_OK);
    haptic_state state = HAPTIC_STATE_INIT;
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    haptic_tick tick;
    std::size_t count = 0;
    goal.hand = 1;
    CHECK(haptic_session_state_of(session, 1, &state) == HAPTIC_ERROR_PART);
    CHECK(haptic_session_verdict_of(session, 1, &verdict) == HAPTIC_ERROR_PART);
    CHECK(haptic_session_history_of(session, 1, &tick, 1, sizeof tick, &count) ==
          HAPTIC_ERROR_PART);
    CHECK(haptic_session_move_hand(session, &goal, nullptr) == HAPTIC_ERROR_PART);
    CHECK(haptic_session_hold_of(session, 1, HAPTIC_HOLD) == HAPTIC_ERROR_PART);
    CHECK(haptic_session_hold_of(session, 0, 3) == HAPTIC_ERROR_NUMBER);
    CHECK(haptic_session_state_of(session, 0, &state) == HAPTIC_OK);
    CHECK(haptic_session_hold_of(nullptr, 0, HAPTIC_HOLD) == HAPTIC_ERROR_NULL);
    CHECK(haptic_session_state_of(nullptr, 0, &state) == HAPTIC_ERROR_NULL);
    (void)haptic_session_free(&session);
  }
}
