// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/moving_frame.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/base/rotation.hpp"

using namespace haptic;

namespace {

constexpr std::int64_t kFrameMs_ns = 1'000'000;

/// A frame and its owner, who gives poses along x and turns about z.
struct FrameBench {
  FrameRecord record;
  MovingFrame frame;
  std::int64_t now_ns = 5'000 * kFrameMs_ns;
  bool felt = true;
  double largest_step_m = 0, largest_turn_rad = 0;
  bool cause = false;

  FrameBench() {
    record.fastest_m_per_s = 0.2;
    record.fastest_rad_per_s = 1.0;
    record.late_ns = 50 * kFrameMs_ns;
  }
  void give(double x_m, double angle_rad = 0) {
    record.number += 1;
    record.stamp_ns = now_ns;
    record.p_m[0] = x_m;
    record.q_xyzw[2] = std::sin(0.5 * angle_rad);
    record.q_xyzw[3] = std::cos(0.5 * angle_rad);
  }
  /// A millisecond later.
  bool tick() {
    const Pose last = frame.pose();
    now_ns += kFrameMs_ns;
    cause = frame.follow(record, now_ns, felt);
    if (!frame.has_jumped()) {
      const Pose& now = frame.pose();
      largest_step_m = std::max(largest_step_m, static_cast<double>((now.p_wa - last.p_wa).norm()));
      const Vec3 turn = so3_log((now.q_wa * last.q_wa.conjugate()).normalized());
      largest_turn_rad = std::max(largest_turn_rad, static_cast<double>(turn.norm()));
    }
    return cause;
  }
  bool ticks(int count) {
    for (int k = 0; k < count; ++k) tick();
    return cause;
  }
  [[nodiscard]] double x_m() const { return static_cast<double>(frame.pose().p_wa.x()); }
  [[nodiscard]] double angle_rad() const {
    return static_cast<double>(so3_log(frame.pose().q_wa).z());
  }
};

/// A bench whose frame has gone at 0.1 m/s and 0.5 rad/s for half a second, a pose every 10 ms.
struct GoingBench : FrameBench {
  GoingBench() {
    give(0);
    ticks(10);
    for (int k = 1; k <= 50; ++k) go_on();
  }
  void go_on() {
    steps += 1;
    give(0.001 * steps, 0.005 * steps);
    ticks(10);
  }
  int steps = 0;
};

}  // namespace

TEST_SUITE("rt_core.moving_frame") {
  TEST_CASE("no pose: the frame is W, for ever") {
    FrameBench b;
    b.record.late_ns = 0;
    CHECK_FALSE(b.ticks(100));
    CHECK_FALSE(b.frame.is_used());
    CHECK(b.frame.pose().p_wa == Vec3::Zero());
  }

  TEST_CASE("poses every 10 ms: even steps, an interval behind, and no cause") {
    GoingBench b;
    CHECK_FALSE(b.cause);
    CHECK(b.x_m() == doctest::Approx(0.05).epsilon(0.01));
    CHECK(b.angle_rad() == doctest::Approx(0.25).epsilon(0.01));
    CHECK(b.largest_step_m == doctest::Approx(1e-4).epsilon(0.02));
    CHECK(b.largest_turn_rad == doctest::Approx(5e-4).epsilon(0.02));
    // Half of an interval after a pose was given: half of the way to it.
    const double before_m = b.x_m();
    b.give(0.051, 0.255);
    b.ticks(5);
    CHECK(b.x_m() - before_m == doctest::Approx(0.0005).epsilon(0.02));
  }

  TEST_CASE("a pose that is too fast: the frame stays until nobody feels it, then it is there") {
    for (const bool turns : {false, true}) {
      CAPTURE(turns);
      GoingBench b;
      const double stood_m = b.x_m();
      b.give(turns ? 0.051 : 0.06, turns ? 0.30 : 0.255);
      CHECK(b.ticks(10));
      CHECK(b.x_m() == stood_m);
      // The next poses go on from there: they are good, but the frame is elsewhere.
      for (int k = 1; k <= 5; ++k) {
        b.give(turns ? 0.051 : 0.06 + 0.001 * k, turns ? 0.30 : 0.255);
        CHECK(b.ticks(10));
        CHECK(b.x_m() == stood_m);
      }
      b.felt = false;
      CHECK_FALSE(b.tick());
      CHECK(b.frame.has_jumped());
      CHECK(b.x_m() == doctest::Approx(turns ? 0.051 : 0.065));
      CHECK_FALSE(b.tick());
      CHECK_FALSE(b.frame.has_jumped());
    }
  }

  TEST_CASE("poses that are none, or out of order, are a cause; the frame stays finite") {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), 1e300}) {
      for (int k = 0; k < 7; ++k) {
        GoingBench b;
        const double stood_m = b.x_m();
        b.give(0.051, 0.255);
        (k < 3 ? b.record.p_m[k] : b.record.q_xyzw[k - 3]) = bad;
        CHECK(b.ticks(3));
        CHECK(b.x_m() == stood_m);
        b.record.p_m[1] = b.record.p_m[2] = b.record.q_xyzw[0] = b.record.q_xyzw[1] = 0;
        b.give(0.052, 0.26);
        CHECK(b.tick());  // felt still
        b.felt = false;
        b.give(0.052, 0.26);
        CHECK_FALSE(b.ticks(2));
        CHECK(b.x_m() == doctest::Approx(0.052));
      }
    }
    GoingBench b;
    b.give(0.051, 0.255);
    b.record.stamp_ns -= 100 * kFrameMs_ns;
    CHECK(b.tick());
  }

  TEST_CASE("no newer pose for longer than stated is a cause, but not where the frame stands") {
    GoingBench b;
    CHECK_FALSE(b.ticks(40));
    CHECK(b.x_m() == doctest::Approx(0.05));  // it has come to the last pose, and went no farther
    CHECK(b.ticks(2));
    b.give(0.05, 0.25);
    CHECK(b.tick());
    b.felt = false;
    CHECK_FALSE(b.tick());
    b.felt = true;
    b.record.stands = 1;
    b.give(0.05, 0.25);
    CHECK_FALSE(b.ticks(1000));
    // And from there on again.
    b.record.stands = 0;
    b.give(0.051, 0.25);
    CHECK_FALSE(b.ticks(10));
    CHECK(b.ticks(50));
  }

  TEST_CASE("a first pose that is not W's: at once where nobody feels it, else a cause") {
    FrameBench b;
    b.felt = false;
    b.give(0.3, 1.0);
    CHECK_FALSE(b.tick());
    CHECK(b.frame.has_jumped());
    CHECK(b.x_m() == doctest::Approx(0.3));
    FrameBench felt;
    felt.give(0.3);
    CHECK(felt.tick());
    CHECK(felt.x_m() == 0);
  }

  TEST_CASE("an owner a little faster than stated is told before the frame lags behind him") {
    FrameBench b;
    b.give(0);
    b.tick();
    b.felt = true;
    // 1.35 mm every 5 ms: less than what one record may be off by, more than the frame may go.
    double lag_m = 0;
    bool told = false;
    for (int k = 1; k <= 400 && !told; ++k) {
      b.give(1.35e-3 * k);
      told = b.ticks(5);
      lag_m = 1.35e-3 * k - b.x_m();
    }
    CHECK(told);
    CHECK(lag_m < 0.05);
  }

  TEST_CASE("an owner who falls silent with an empty record does not move the frame to W") {
    FrameBench b;
    b.give(0.3);
    b.tick();
    b.felt = false;
    b.tick();
    CHECK(b.x_m() == doctest::Approx(0.3));
    b.record = FrameRecord{};
    b.felt = true;
    for (int k = 0; k < 300; ++k) b.tick();
    CHECK(b.cause);
    CHECK(b.x_m() == doctest::Approx(0.3));
  }

  TEST_CASE("for any input of its owner the frame goes no faster than stated while it is felt") {
    FrameBench b;
    b.give(0);
    b.tick();
    std::uint32_t random = 1;
    for (int k = 0; k < 5000; ++k) {
      random = random * 1664525u + 1013904223u;
      const double u = static_cast<double>(random >> 8) / (1 << 24);
      if (u < 0.3) b.give(b.x_m() + 0.02 * (u - 0.15), b.angle_rad() + 0.1 * (u - 0.15));
      b.felt = !b.cause;
      b.ticks(1 + static_cast<int>(random >> 28));
    }
    CHECK(b.largest_step_m > 1e-4);
    CHECK(b.largest_step_m <= 0.2 * 1e-3 * (1 + 1e-5) + 1e-7);
    CHECK(b.largest_turn_rad <= 1.0 * 1e-3 * (1 + 1e-5) + 1e-6);
  }

  TEST_CASE("into the frame and back: poses, velocities, wrenches, and the power of both") {
    GoingBench b;
    b.give(0.051, 0.255);
    b.tick();
    const Pose at_w{Vec3(0.2_r, -0.1_r, 0.3_r), so3_exp(Vec3(0.3_r, -0.2_r, 0.5_r))};
    const Pose inside = b.frame.inside(at_w);
    const Vec3 back = b.frame.pose().p_wa + b.frame.pose().q_wa * inside.p_wa;
    CHECK(static_cast<double>((back - at_w.p_wa).norm()) < 1e-6);
    const Quat turned = b.frame.pose().q_wa * inside.q_wa;
    CHECK(static_cast<double>(turned.angularDistance(at_w.q_wa)) < 1e-3);
    // A point that the frame carries along stands still in it.
    const Vec3 angular(0, 0, 0.5_r);
    const Vec3 carried = Vec3(0.1_r, 0, 0) + angular.cross(at_w.p_wa - b.frame.pose().p_wa);
    const Twist still = b.frame.inside(Twist{carried, angular}, at_w.p_wa);
    CHECK(static_cast<double>(still.linear_w.norm()) < 0.02);
    CHECK(static_cast<double>(still.angular_w.norm()) < 0.1);
    const Wrench w{Vec3(1, 2, 3), Vec3(-1, 0.5_r, 2)};
    const Wrench again = b.frame.outside(b.frame.inside(w));
    CHECK(static_cast<double>((again.force_w - w.force_w).norm()) < 1e-5);
    CHECK(static_cast<double>((again.torque_w - w.torque_w).norm()) < 1e-5);
  }
}
