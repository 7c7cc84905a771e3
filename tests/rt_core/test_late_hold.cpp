// SPDX-License-Identifier: Apache-2.0
// The pull that is felt while the part is late.
#include <doctest/doctest.h>

#include "rt_core/proxy/late_hold.hpp"

using namespace haptic;

namespace {

constexpr Real kRadius_m = 0.05_r;

struct Bench {
  LateHold hold;
  Spring spring;
  LeftPull pull;
  Bench() {
    spring.k_t_n_per_m = 1000;
    spring.k_r_nm_per_rad = 2;
  }
  /// A tick whose spring is stretched by `place_m` along x and `turn_rad` about z.
  PoseError felt(Real place_m, Real turn_rad = 0) {
    pull.error.translation_m = Vec3(place_m, 0, 0);
    pull.error.rotation_rad = Vec3(0, 0, turn_rad);
    return hold.felt(pull, spring, kRadius_m);
  }
};

}  // namespace

TEST_SUITE("rt_core.late_hold") {
  TEST_CASE("what is never late is felt to the bit") {
    Bench b;
    for (int k = 0; k < 100; ++k) {
      const Real x = 1e-3_r * static_cast<Real>(k), turn = 1e-2_r * static_cast<Real>(k % 7);
      const PoseError felt = b.felt(x, turn);
      CHECK(felt.translation_m.x() == x);
      CHECK(felt.rotation_rad.z() == turn);
      CHECK_FALSE(b.hold.holds());
    }
  }

  TEST_CASE("a pull that grows while ticks end on their budget is held, place and turn") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r, 0.01_r));
    b.pull.spent = true;
    b.pull.moved = true;
    for (int k = 1; k <= 20; ++k) {
      const Real wound = 1 + static_cast<Real>(k);
      const PoseError felt = b.felt(1e-3_r * wound, 0.01_r * wound);
      CHECK(felt.translation_m.x() == doctest::Approx(1e-3));
      CHECK(felt.rotation_rad.z() == doctest::Approx(0.01));
      CHECK(b.hold.holds());
    }
    // A shorter pull is felt at once.
    CHECK(b.felt(4e-4_r, 0.002_r).translation_m.x() == 4e-4_r);
    CHECK_FALSE(b.hold.holds());
  }

  TEST_CASE("a press against planes that are known is felt while late") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r));
    b.pull.spent = true;
    b.pull.held_m = 3e-3_r;
    CHECK(b.felt(2.5e-3_r).translation_m.x() == 2.5e-3_r);
    CHECK(b.felt(5e-3_r).translation_m.x() == doctest::Approx(3e-3));
  }

  TEST_CASE("it comes back by 0.1 N or 5 % of the spring's in a tick, and no faster") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r, 0.01_r));
    b.pull.spent = true;
    static_cast<void>(b.felt(1e-2_r, 0.3_r));
    b.pull.spent = false;
    Real place = 1e-3_r, turn = 0.01_r;
    int ticks = 0;
    for (bool held = true; held && ticks < 200; ++ticks) {
      const PoseError felt = b.felt(1e-2_r, 0.3_r);
      held = b.hold.holds();
      const Real more = felt.translation_m.x() - place;
      const Real more_turn = felt.rotation_rad.z() - turn;
      CHECK(more >= 0);
      CHECK(more <= 0.05_r * 1e-2_r * (1 + 1e-5_r));
      CHECK(more_turn >= 0);
      CHECK(more_turn <= 0.05_r * 0.3_r * (1 + 1e-5_r));
      place = felt.translation_m.x();
      turn = felt.rotation_rad.z();
    }
    CHECK(ticks < 25);
    CHECK(place == 1e-2_r);
    CHECK(turn == 0.3_r);
  }

  TEST_CASE("a pull that is open still is held for 32 ticks after the last spent one") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r));
    b.pull.spent = true;
    static_cast<void>(b.felt(2e-3_r));
    b.pull.spent = false;
    b.pull.open_n = 1;
    b.pull.moved = true;
    for (int k = 0; k < 32; ++k) CHECK(b.felt(2e-3_r).translation_m.x() == doctest::Approx(1e-3));
    CHECK(b.felt(2e-3_r).translation_m.x() > 1.05e-3_r);
  }

  TEST_CASE("what does not move at all for long is felt, though no budget is left") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r));
    b.pull.spent = true;
    b.pull.moved = false;
    const auto rests = [&](int ticks) {
      for (int k = 0; k < ticks; ++k)
        CHECK(b.felt(5e-3_r).translation_m.x() == doctest::Approx(1e-3));
    };
    rests(31);
    b.pull.moved = true;  // now and then it does
    rests(1);
    b.pull.moved = false;
    rests(32);
    CHECK(b.felt(5e-3_r).translation_m.x() == doctest::Approx(1e-3 + 0.05 * 5e-3));
  }

  TEST_CASE("a reset forgets it") {
    Bench b;
    static_cast<void>(b.felt(1e-3_r));
    b.pull.spent = true;
    static_cast<void>(b.felt(2e-3_r));
    b.hold.reset();
    b.pull.spent = false;
    CHECK(b.felt(3e-3_r).translation_m.x() == 3e-3_r);
  }
}
