// SPDX-License-Identifier: Apache-2.0
// Motions with a closed form, rounded to an encoder step and stamped with jitter, lateness and
// gaps; the estimate is held against the noise and the delay that it claims for itself.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kTwistSeed = 0x7157;
constexpr double kTwistPi = 3.14159265358979323846;
// What rounding of the build's scalar may add to a position of a tenth of a metre or an angle of a
// radian.
constexpr double kRounding = 4.0 * static_cast<double>(kRealEpsilon);

// Stamps of a 1 kHz loop: jitter of +-10 %, one tick in 50 late by 1 to 5 ms.
class Stamps {
 public:
  explicit Stamps(std::uint64_t seed) : random_(seed) {}
  std::int64_t next() {
    double step_s = 1.0e-3 * random_.uniform(0.9, 1.1);
    if (random_.uniform(0.0, 1.0) < 0.02) step_s += random_.uniform(1.0e-3, 5.0e-3);
    stamp_ns_ += static_cast<std::int64_t>(step_s * 1.0e9);
    return stamp_ns_;
  }

 private:
  Random random_;
  std::int64_t stamp_ns_ = 1'700'000'000'000'000'000;  // an origin that no float could hold
};

double seconds_since(std::int64_t origin_ns, std::int64_t stamp_ns) {
  return static_cast<double>(stamp_ns - origin_ns) * 1.0e-9;
}

double rounded(double value, double step) {
  return step > 0.0 ? step * std::floor(value / step + 0.5) : value;
}

TwistSample sample_at(std::int64_t stamp_ns, const std::array<double, 3>& x, double step) {
  TwistSample sample;
  sample.stamp_ns = stamp_ns;
  for (int axis = 0; axis < 3; ++axis) {
    sample.grip_w[axis] = static_cast<Real>(rounded(x[static_cast<std::size_t>(axis)], step));
  }
  return sample;
}

TwistWindow window_of(double step_m, double step_rad = 0.0) {
  TwistWindow window;
  window.step_m = static_cast<Real>(step_m);
  window.step_rad = static_cast<Real>(step_rad);
  return window;
}

double component(const Vec3& v, int axis) { return static_cast<double>(v[axis]); }

// Turn about a fixed axis, rounded to `step` about it.
Quat turned(const Vec3& axis, double angle_rad, double step) {
  const double angle = std::remainder(rounded(angle_rad, step), 2.0 * kTwistPi);
  return so3_exp(static_cast<Real>(angle) * axis);
}

}  // namespace

TEST_SUITE("rt_core.twist_estimator") {
  TEST_CASE("constant velocity: exact under jitter, late ticks and gaps") {
    CAPTURE(kTwistSeed);
    const std::array<double, 3> v = {0.12, -0.03, 0.4};
    for (const double step : {0.0, 1.0e-5}) {
      TwistEstimator estimator(window_of(step));
      Stamps stamps(kTwistSeed);
      const std::int64_t origin = stamps.next();
      for (int tick = 0; tick < 2000; ++tick) {
        const std::int64_t stamp = stamps.next();
        const double t = std::fmod(seconds_since(origin, stamp), 0.2) - 0.1;
        if (t < -0.095) estimator.reset();  // the way back is not part of the motion
        const TwistEstimate e =
            estimator.update(sample_at(stamp, {v[0] * t, v[1] * t, v[2] * t}, 0.0));  // unrounded
        if (!e.valid) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double error =
              component(e.twist_w.linear_w, axis) - v[static_cast<std::size_t>(axis)];
          REQUIRE(std::abs(error) <=
                  0.1 * kRounding / static_cast<double>(e.linear_window_s) + 1.0e-6 * 0.4);
        }
      }
    }
  }

  TEST_CASE("constant velocity, rounded: longest window, error within the claimed noise") {
    CAPTURE(kTwistSeed);
    Random random(kTwistSeed);
    double worst_share = 0, least_window_s = 1;
    for (int run = 0; run < 200; ++run) {
      const double step = std::exp2(random.uniform(-20.0, -12.0));  // 1 um to 0.25 mm
      const double speed = std::exp2(random.uniform(-12.0, 0.0));
      const std::array<double, 3> v = {speed * random.uniform(-1, 1), speed * random.uniform(-1, 1),
                                       speed * random.uniform(-1, 1)};
      TwistEstimator estimator(window_of(step));
      Stamps stamps(kTwistSeed + static_cast<std::uint64_t>(run));
      const std::int64_t origin = stamps.next();
      for (int tick = 0; tick < 100; ++tick) {
        const std::int64_t stamp = stamps.next();
        const double t = seconds_since(origin, stamp) - 0.05;
        const TwistEstimate e =
            estimator.update(sample_at(stamp, {v[0] * t, v[1] * t, v[2] * t}, step));
        if (!e.valid) continue;
        const double window_s = static_cast<double>(e.linear_window_s);
        REQUIRE(static_cast<double>(e.linear_noise_m_per_s) * window_s ==
                doctest::Approx(step).epsilon(1e-5));
        REQUIRE(static_cast<double>(e.linear_delay_s) == doctest::Approx(0.5 * window_s));
        for (int axis = 0; axis < 3; ++axis) {
          const double error =
              std::abs(component(e.twist_w.linear_w, axis) - v[static_cast<std::size_t>(axis)]);
          const double noise = static_cast<double>(e.linear_noise_m_per_s);
          REQUIRE(error <= noise * (1.0 + 1.0e-6) + 0.1 * kRounding / window_s + 1.0e-6 * speed);
          worst_share = std::max(worst_share, error / noise);
        }
        if (tick > 40) least_window_s = std::min(least_window_s, window_s);
      }
    }
    MESSAGE("largest error: " << worst_share << " of the claimed noise; least window "
                              << least_window_s << " s");
    CHECK(worst_share > 0.5);  // the claim is not idle
    // 20 ms less one interval, the longest being 6.1 ms. In float the ends' own rounding may fall
    // outside a step of a micrometre.
    if (sizeof(Real) == sizeof(double)) CHECK(least_window_s >= 13.9e-3);
  }

  TEST_CASE("oscillation, rounded: the velocity of half a window ago within the claimed noise") {
    CAPTURE(kTwistSeed);
    const double amplitude = 0.02;
    const double step = 1.0e-5;
    double longest_s = 0, shortest_s = 1;
    for (const double frequency_hz : {0.1, 1.0, 5.0, 20.0}) {
      const double w = 2.0 * kTwistPi * frequency_hz;
      TwistEstimator estimator(window_of(step));
      Stamps stamps(kTwistSeed);
      const std::int64_t origin = stamps.next();
      for (int tick = 0; tick < 5000; ++tick) {
        const std::int64_t stamp = stamps.next();
        const double t = seconds_since(origin, stamp);
        const TwistEstimate e = estimator.update(sample_at(
            stamp, {amplitude * std::sin(w * t), amplitude * std::cos(w * t), 0.0}, step));
        if (!e.valid) continue;
        const double window_s = static_cast<double>(e.linear_window_s);
        const double then = t - static_cast<double>(e.linear_delay_s);
        // The mean over the window differs from the velocity in its middle by |v''| W^2 / 24.
        const double bound = static_cast<double>(e.linear_noise_m_per_s) +
                             amplitude * w * w * w * window_s * window_s / 24.0 +
                             0.1 * kRounding / window_s + 1.0e-6;
        REQUIRE(std::abs(component(e.twist_w.linear_w, 0) - amplitude * w * std::cos(w * then)) <=
                bound);
        REQUIRE(std::abs(component(e.twist_w.linear_w, 1) + amplitude * w * std::sin(w * then)) <=
                bound);
        REQUIRE(component(e.twist_w.linear_w, 2) == 0.0);
        longest_s = std::max(longest_s, window_s);
        if (tick > 40) shortest_s = std::min(shortest_s, window_s);
      }
    }
    MESSAGE("windows from " << shortest_s << " to " << longest_s << " s");
    CHECK(longest_s > 0.015);    // slow: little noise
    CHECK(shortest_s < 3.0e-3);  // fast: little delay
  }

  TEST_CASE("reversal: the window lets go of the past as soon as it shows") {
    const double step = 1.0e-5;
    for (const double speed : {0.02, 0.1, 1.0}) {
      TwistEstimator estimator(window_of(step));
      std::int64_t stamp = 0;
      int ticks = 0;
      for (int tick = -100; tick <= 60; ++tick) {
        stamp += 1'000'000;
        const double t = 1.0e-3 * static_cast<double>(tick);
        const TwistEstimate e =
            estimator.update(sample_at(stamp, {-speed * std::abs(t), 0.0, 0.0}, step));
        if (tick < 0 && tick > -60) {
          CHECK(component(e.twist_w.linear_w, 0) == doctest::Approx(speed).epsilon(0.05));
        }
        // From then on the estimate is that of the new direction.
        const bool reversed = std::abs(component(e.twist_w.linear_w, 0) + speed) <=
                              static_cast<double>(e.linear_noise_m_per_s) + 0.2 * kRounding * 1.0e3;
        if (tick > 0 && !reversed) ticks = tick;
      }
      CAPTURE(speed);
      // A window that reaches T before the turn, s after it, sags by about 2 v s T / (s + T): what
      // is left unnoticed after s = 1 ms is a T of e / 2 v, one interval or less here.
      const int allowed = 1 + static_cast<int>(std::ceil(step / (2.0 * speed * 1.0e-3)));
      CHECK(ticks <= allowed);
    }
  }

  TEST_CASE("rotations at 10 rad/s: about any axis, exact and rounded") {
    CAPTURE(kTwistSeed);
    Random random(kTwistSeed);
    for (int run = 0; run < 50; ++run) {
      Vec3 axis(static_cast<Real>(random.uniform(-1, 1)), static_cast<Real>(random.uniform(-1, 1)),
                static_cast<Real>(random.uniform(-1, 1)));
      axis.normalize();
      const double step = run % 2 == 0 ? 0.0 : 1.0e-3;
      TwistEstimator estimator(window_of(0.0, step));
      Stamps stamps(kTwistSeed + static_cast<std::uint64_t>(run));
      const std::int64_t origin = stamps.next();
      const Quat start = so3_exp(Vec3(0.3_r, -1.0_r, 0.5_r));
      for (int tick = 0; tick < 500; ++tick) {
        const std::int64_t stamp = stamps.next();
        TwistSample sample = sample_at(stamp, {0.0, 0.0, 0.0}, 0.0);
        const Quat turn = turned(axis, 10.0 * seconds_since(origin, stamp), step);
        const Real sign = tick % 3 == 0 ? -1.0_r : 1.0_r;  // q and -q are one orientation
        sample.q_wa.coeffs() = sign * (turn * start).coeffs();
        const TwistEstimate e = estimator.update(sample);
        if (!e.valid) continue;
        const double window_s = static_cast<double>(e.angular_window_s);
        const double error = static_cast<double>((e.twist_w.angular_w - 10.0_r * axis).norm());
        REQUIRE(error <= 1.05 * static_cast<double>(e.angular_noise_rad_per_s) +
                             2.0 * kRounding / window_s + 1.0e-6 * 10.0);
        REQUIRE(e.twist_w.linear_w == Vec3::Zero());
        if (step > 0.0 && tick > 60) REQUIRE(window_s >= 10.0e-3);
      }
    }
  }

  TEST_CASE("rotation: a window ends before a turn of a radian, but has one interval") {
    TwistEstimator estimator(window_of(0.0, 1.0e-3));
    for (int tick = 0; tick < 100; ++tick) {
      TwistSample sample = sample_at(tick * 1'000'000, {0.0, 0.0, 0.0}, 0.0);
      const double speed = tick < 50 ? 200.0 : 2500.0;
      sample.q_wa = turned(Vec3::UnitZ(), speed * 1.0e-3 * static_cast<double>(tick), 0.0);
      const TwistEstimate e = estimator.update(sample);
      if (tick > 10 && tick != 50) {
        REQUIRE(e.valid);
        CHECK(component(e.twist_w.angular_w, 2) == doctest::Approx(speed).epsilon(1e-3));
        CHECK(static_cast<double>(e.angular_window_s) <= (tick < 50 ? 5.001e-3 : 1.001e-3));
      }
    }
  }

  TEST_CASE("step 0: the shortest window, at every rate") {
    for (const std::int64_t period_ns : {250'000, 1'000'000, 3'000'000}) {
      TwistEstimator estimator(window_of(0.0));
      const double shortest_s = std::max(1.0e-3, static_cast<double>(period_ns) * 1.0e-9);
      for (std::int64_t tick = 0; tick < 50; ++tick) {
        const double t = static_cast<double>(tick * period_ns) * 1.0e-9;
        const TwistEstimate e =
            estimator.update(sample_at(tick * period_ns, {t * t, 0.0, 0.0}, 0.0));
        const bool spanned = t >= 0.999 * shortest_s;
        REQUIRE(e.valid == spanned);
        if (!spanned) continue;
        CHECK(static_cast<double>(e.linear_window_s) == doctest::Approx(shortest_s).epsilon(1e-5));
        CHECK(component(e.twist_w.linear_w, 0) ==
              doctest::Approx(2.0 * t - shortest_s).epsilon(1e-3));
        CHECK(e.linear_noise_m_per_s == 0.0_r);
      }
    }
  }

  TEST_CASE("a late tick: its real time, and the window of one interval") {
    TwistEstimator estimator(window_of(1.0e-5));
    std::int64_t stamp = 0;
    for (int tick = 0; tick < 40; ++tick) {
      stamp += tick == 30 ? 47'000'000 : 1'000'000;
      const double t = static_cast<double>(stamp) * 1.0e-9;
      const TwistEstimate e = estimator.update(sample_at(stamp, {0.3 * t, 0.0, 0.0}, 0.0));
      if (tick == 0) continue;
      CHECK(component(e.twist_w.linear_w, 0) == doctest::Approx(0.3).epsilon(1e-4));
      if (tick == 30) {
        CHECK(static_cast<double>(e.linear_window_s) == doctest::Approx(47.0e-3));
        CHECK(static_cast<double>(e.linear_delay_s) == doctest::Approx(23.5e-3));
      } else {
        CHECK(static_cast<double>(e.linear_window_s) <= 20.001e-3);
      }
    }
  }

  TEST_CASE("the device's own twist: passed through, the history going on beneath") {
    TwistEstimator estimator(window_of(1.0e-5));
    for (int tick = 0; tick < 30; ++tick) {
      TwistSample sample = sample_at(tick * 1'000'000, {1.0e-4 * tick, 0.0, 0.0}, 0.0);
      sample.sensed = tick < 20;
      sample.sensed_w = {Vec3(1, 2, 3), Vec3(4, 5, 6)};
      if (tick == 7) sample.sensed_w.angular_w.y() = std::numeric_limits<Real>::quiet_NaN();
      const TwistEstimate e = estimator.update(sample);
      REQUIRE(e.valid);
      CHECK(e.sensed == (tick < 20 && tick != 7));
      if (e.sensed) {
        CHECK(e.twist_w.linear_w == Vec3(1, 2, 3));
        CHECK(e.twist_w.angular_w == Vec3(4, 5, 6));
        CHECK(e.linear_delay_s == 0.0_r);
        CHECK(e.linear_noise_m_per_s == 0.0_r);
      } else {
        CHECK(component(e.twist_w.linear_w, 0) == doctest::Approx(0.1).epsilon(1e-4));
        CHECK(static_cast<double>(e.linear_window_s) > (tick == 7 ? 6.0e-3 : 18.0e-3));
      }
    }
  }

  TEST_CASE("equal and backward stamps, poses that are no poses: the last twist, flagged") {
    TwistEstimator estimator(window_of(1.0e-5));
    TwistEstimate before;
    for (int tick = 1; tick <= 10; ++tick) {
      before = estimator.update(sample_at(tick * 1'000'000, {1.0e-4 * tick, 0.0, 0.0}, 0.0));
    }
    REQUIRE(before.valid);
    CHECK_FALSE(before.kept);
    const Real bad = std::numeric_limits<Real>::quiet_NaN();
    for (int kind = 0; kind < 5; ++kind) {
      TwistSample sample = sample_at(10'000'000, {0.5, 0.0, 0.0}, 0.0);
      if (kind == 1) sample.stamp_ns = 9'500'000;
      if (kind == 2) sample.stamp_ns = std::numeric_limits<std::int64_t>::min();
      if (kind >= 3) sample.stamp_ns = 11'000'000;
      if (kind == 3) sample.grip_w.x() = bad;
      if (kind == 4) sample.q_wa = Quat(0, 0, 0, 0);
      const TwistEstimate e = estimator.update(sample);
      CAPTURE(kind);
      CHECK(e.kept);
      CHECK(e.valid);
      CHECK(e.twist_w.linear_w == before.twist_w.linear_w);
      CHECK(e.linear_window_s == before.linear_window_s);
    }
    const TwistEstimate after = estimator.update(sample_at(11'000'000, {1.1e-3, 0, 0}, 0.0));
    CHECK_FALSE(after.kept);
    CHECK(component(after.twist_w.linear_w, 0) == doctest::Approx(0.1).epsilon(1e-4));
    CHECK(static_cast<double>(after.linear_window_s) == doctest::Approx(10.0e-3));
  }

  TEST_CASE("a stamp that stands still for ever does not leave a velocity standing") {
    for (const bool finite : {true, false}) {
      TwistEstimator estimator(window_of(1.0e-5));
      (void)estimator.update(sample_at(1'000'000'000, {0.0, 0.0, 0.0}, 0.0));
      (void)estimator.update(sample_at(1'001'000'000, {1.0e-3, 0.0, 0.0}, 0.0));
      TwistSample repeated = sample_at(1'001'000'000, {1.0e-3, 0.0, 0.0}, 0.0);
      if (!finite) repeated.grip_w.y() = std::numeric_limits<Real>::infinity();
      for (std::uint32_t i = 0; i < kMaxKeptTwists; ++i) {
        const TwistEstimate e = estimator.update(repeated);
        REQUIRE(e.kept);
        REQUIRE(component(e.twist_w.linear_w, 0) == doctest::Approx(1.0).epsilon(1e-3));
      }
      for (int i = 0; i < 100; ++i) {
        const TwistEstimate e = estimator.update(repeated);
        REQUIRE_FALSE(e.valid);
        REQUIRE(e.twist_w.linear_w == Vec3::Zero());
      }
    }
    // A clock set back: a new history.
    TwistEstimator estimator(window_of(1.0e-5));
    bool valid = false;
    for (int tick = 0; tick < 100; ++tick) {
      const std::int64_t stamp = (tick < 40 ? 1'000'000'000 : 0) + tick * 1'000'000;
      const TwistEstimate e = estimator.update(sample_at(stamp, {1.0e-4 * tick, 0.0, 0.0}, 0.0));
      valid = e.valid && !e.kept;
      if (tick > 75) CHECK(component(e.twist_w.linear_w, 0) == doctest::Approx(0.1).epsilon(1e-3));
    }
    CHECK(valid);
  }

  TEST_CASE("reset and hostile settings: defined") {
    TwistEstimator estimator(window_of(1.0e-5));
    (void)estimator.update(sample_at(0, {0.0, 0.0, 0.0}, 0.0));
    (void)estimator.update(sample_at(1'000'000, {1.0, 0.0, 0.0}, 0.0));
    estimator.reset();
    CHECK_FALSE(estimator.update(sample_at(500'000, {0.0, 0.0, 0.0}, 0.0)).valid);
    CHECK(estimator.update(sample_at(1'500'000, {0.0, 0.0, 0.0}, 0.0)).twist_w.linear_w ==
          Vec3::Zero());

    const Real bad[] = {std::numeric_limits<Real>::quiet_NaN(),
                        std::numeric_limits<Real>::infinity(), -1.0_r,
                        std::numeric_limits<Real>::max()};
    for (const Real value : bad) {
      TwistEstimator odd(TwistWindow{value, value, value, value});
      for (int tick = 0; tick < 100; ++tick) {
        const TwistEstimate e =
            odd.update(sample_at(tick * 1'000, {1.0e9 * (tick % 2), 0.0, 0.0}, 0.0));
        REQUIRE(is_finite(e.twist_w));
        REQUIRE(std::isfinite(e.linear_noise_m_per_s) == (value != bad[3] || !e.valid));
      }
    }
    // Both ends of the clock in one interval.
    TwistEstimator wide;
    (void)wide.update(sample_at(std::numeric_limits<std::int64_t>::min(), {0.0, 0.0, 0.0}, 0.0));
    const TwistEstimate e =
        wide.update(sample_at(std::numeric_limits<std::int64_t>::max(), {1.0, 0.0, 0.0}, 0.0));
    CHECK(e.valid);
    CHECK(static_cast<double>(e.linear_window_s) == doctest::Approx(1.8446744e10));
  }
}
