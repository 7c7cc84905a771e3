// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rt_core/safety/wrench_ramp.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kRampSeed = 0x4A3F;
constexpr double kRampRounding = 8.0 * static_cast<double>(kRealEpsilon);

const Wrench kPush = {Vec3(3, 0, -4), Vec3(0, 0.12_r, 0.05_r)};  // 5 N, 0.13 N m

double force_of(const RampedWrench& r) { return static_cast<double>(r.wrench_w.force_w.norm()); }
double torque_of(const RampedWrench& r) { return static_cast<double>(r.wrench_w.torque_w.norm()); }

double force_step(const RampedWrench& l, const RampedWrench& r) {
  return static_cast<double>((l.wrench_w.force_w - r.wrench_w.force_w).norm());
}
double torque_step(const RampedWrench& l, const RampedWrench& r) {
  return static_cast<double>((l.wrench_w.torque_w - r.wrench_w.torque_w).norm());
}

WrenchRampLimits slew_limits(double n_per_s, double nm_per_s) {
  WrenchRampLimits limits;
  limits.slew_n_per_s = static_cast<Real>(n_per_s);
  limits.slew_nm_per_s = static_cast<Real>(nm_per_s);
  return limits;
}

}  // namespace

TEST_SUITE("rt_core.wrench_ramp") {
  TEST_CASE("in: the wrench unchanged, bit for bit") {
    WrenchRamp ramp;
    for (int tick = 0; tick < 20; ++tick) {
      const Wrench wrench = {Vec3(0.1_r * static_cast<Real>(tick), 2, 3), Vec3(0.3_r, 0.01_r, 5)};
      const RampedWrench r = ramp.update(tick * 1'000'000, wrench);
      CHECK(r.wrench_w.force_w == wrench.force_w);
      CHECK(r.wrench_w.torque_w == wrench.torque_w);
      CHECK(r.gain == 1.0_r);
      CHECK(r.state == RampState::kIn);
    }
  }

  TEST_CASE("ramp out: the held wrench at the slew limit that binds, then exactly zero") {
    struct Case {
      double n_per_s, nm_per_s, out_s;
    };
    // 5 N and 0.13 N m: force binds, torque binds, neither limit given, one given and the other
    // part by time.
    for (const Case& c : {Case{50, 10, 0.100}, Case{5000, 2.6, 0.050}, Case{0, 0, 0.050},
                          Case{50, 0, 0.100}, Case{1000, 0, 0.050}}) {
      CAPTURE(c.n_per_s);
      CAPTURE(c.nm_per_s);
      WrenchRamp ramp(slew_limits(c.n_per_s, c.nm_per_s));
      RampedWrench last = ramp.update(0, kPush);
      ramp.ramp_out();
      double out_s = 0;
      for (int tick = 1; tick <= 150; ++tick) {
        // What comes from behind no longer counts.
        const Wrench other = {Vec3(100.0_r * static_cast<Real>(tick), 7, 7), Vec3(9, 9, 9)};
        const RampedWrench r = ramp.update(tick * 1'000'000, other);
        REQUIRE(force_of(r) <= force_of(last));
        REQUIRE(torque_of(r) <= torque_of(last));
        REQUIRE(static_cast<double>((r.wrench_w.force_w - r.gain * kPush.force_w).norm()) <=
                kRampRounding * 5.0);
        if (c.n_per_s > 0) REQUIRE(force_step(r, last) <= c.n_per_s * 1.0e-3 + kRampRounding * 5.0);
        if (c.nm_per_s > 0) REQUIRE(torque_step(r, last) <= c.nm_per_s * 1.0e-3 + kRampRounding);
        if (r.state == RampState::kOut && out_s == 0) out_s = 1.0e-3 * tick;
        CHECK(ramp.state() == r.state);
        last = r;
      }
      CHECK(out_s == doctest::Approx(c.out_s).epsilon(0.021));  // to a tick
      CHECK(last.wrench_w.force_w == Vec3::Zero());
      CHECK(last.wrench_w.torque_w == Vec3::Zero());
      CHECK(last.gain == 0.0_r);
    }
  }

  TEST_CASE("ramp in: at least 50 ms of real time for any command, following the wrench") {
    for (const double asked_s : {0.0, 0.001, 0.050, 0.200}) {
      for (const std::int64_t period_ns : {250'000, 1'000'000, 4'000'000, 40'000'000}) {
        WrenchRampLimits limits;
        limits.ramp_in_s = static_cast<Real>(asked_s);
        WrenchRamp ramp(limits);
        ramp.reset(false);
        CHECK(ramp.update(0, kPush).wrench_w.force_w == Vec3::Zero());
        ramp.ramp_in();
        double last_gain = 0, in_s = 0;
        int ticks = 0;
        for (std::int64_t tick = 1; tick <= 1000 && in_s == 0; ++tick) {
          const Wrench wrench = {Vec3(static_cast<Real>(tick), 0, 0), kPush.torque_w};
          const RampedWrench r = ramp.update(tick * period_ns, wrench);
          const double gain = static_cast<double>(r.gain);
          REQUIRE(gain > last_gain);
          REQUIRE(r.wrench_w.force_w.x() == r.gain * wrench.force_w.x());
          if (r.state == RampState::kIn) in_s = static_cast<double>(tick * period_ns) * 1.0e-9;
          last_gain = gain;
          ++ticks;
        }
        CAPTURE(asked_s);
        CAPTURE(period_ns);
        const double wanted_s = std::max(asked_s, 0.050);
        CHECK(in_s >= wanted_s - 1.0e-4 * wanted_s);
        // A slow loop does not take larger steps: no fewer ticks than 5 ms each would need.
        CHECK(ticks >= static_cast<int>(wanted_s / 5.0e-3));
        if (period_ns <= 1'000'000) CHECK(in_s <= wanted_s + 1.1e-3);
      }
    }
  }

  TEST_CASE("ramp in: the slew limits hold there too") {
    WrenchRamp ramp(slew_limits(10, 100));  // 5 N at 10 N/s: half a second
    ramp.reset(false);
    RampedWrench last = ramp.update(0, kPush);
    ramp.ramp_in();
    int tick = 0;
    while (ramp.state() != RampState::kIn && tick < 2000) {
      const RampedWrench r = ramp.update(++tick * 1'000'000, kPush);
      REQUIRE(force_step(r, last) <= 10.0e-3 + kRampRounding * 5.0);
      last = r;
    }
    CHECK(tick >= 499);
    CHECK(tick <= 502);
  }

  TEST_CASE("turning round: out while ramping in at the gain reached, in only when out") {
    WrenchRamp ramp(slew_limits(50, 50));
    ramp.reset(false);
    (void)ramp.update(0, kPush);
    ramp.ramp_in();
    RampedWrench last;
    std::int64_t tick = 0;
    for (; tick <= 40; ++tick) last = ramp.update(tick * 1'000'000, kPush);
    CHECK(last.state == RampState::kRampingIn);
    const double reached = static_cast<double>(last.gain);
    CHECK(reached == doctest::Approx(0.4).epsilon(0.01));
    ramp.ramp_out();
    last = ramp.update(tick++ * 1'000'000, kPush);
    CHECK(last.state == RampState::kRampingOut);
    CHECK(static_cast<double>(last.gain) == doctest::Approx(reached - 0.01).epsilon(1e-4));
    ramp.ramp_in();
    const Wrench other = {-10.0_r * kPush.force_w, kPush.torque_w};
    bool was_out = false;
    for (; tick <= 400; ++tick) {
      const RampedWrench r = ramp.update(tick * 1'000'000, other);
      REQUIRE(force_step(r, last) <= 50.0e-3 + kRampRounding * 50.0);
      if (r.state == RampState::kOut) was_out = true;
      if (!was_out) REQUIRE(r.state == RampState::kRampingOut);
      last = r;
    }
    CHECK(was_out);
    CHECK(last.state == RampState::kRampingIn);  // 50 N at 50 N/s
    CHECK(last.wrench_w.force_w.x() < 0.0_r);
  }

  TEST_CASE("random requests, wrenches and stamps: no step beyond slew, time and change given") {
    CAPTURE(kRampSeed);
    Random random(kRampSeed);
    std::array<int, 4> seen{};
    for (int run = 0; run < 200; ++run) {
      const double n_per_s = std::exp2(random.uniform(0.0, 12.0));
      const double nm_per_s = std::exp2(random.uniform(-5.0, 6.0));
      WrenchRamp ramp(slew_limits(n_per_s, nm_per_s));
      std::int64_t stamp = 0;
      Wrench given = kPush;
      RampedWrench last = ramp.update(stamp, given);
      for (int tick = 0; tick < 500; ++tick) {
        if (random.uniform(0, 1) < 0.01) ramp.ramp_out();
        if (random.uniform(0, 1) < 0.01) ramp.ramp_in();
        const double kind = random.uniform(0, 1);
        std::int64_t span_ns = 1'000'000 + static_cast<std::int64_t>(random.uniform(-9e5, 9e5));
        if (kind < 0.05) span_ns = 0;
        if (kind > 0.95) span_ns = static_cast<std::int64_t>(random.uniform(-1e8, 3e9));
        stamp += span_ns;
        Wrench now = given;
        for (int axis = 0; axis < 3; ++axis) {
          now.force_w[axis] += static_cast<Real>(random.uniform(-0.1, 0.1));
          now.torque_w[axis] += static_cast<Real>(random.uniform(-0.01, 0.01));
        }
        const RampedWrench r = ramp.update(stamp, now);
        const double elapsed_s = std::clamp(static_cast<double>(span_ns) * 1.0e-9, 0.0,
                                            static_cast<double>(kLongestRampTick_s));
        const double change = static_cast<double>((now.force_w - given.force_w).norm());
        const double turn = static_cast<double>((now.torque_w - given.torque_w).norm());
        REQUIRE(force_step(r, last) <= n_per_s * elapsed_s + change + kRampRounding * 50.0);
        REQUIRE(torque_step(r, last) <= nm_per_s * elapsed_s + turn + kRampRounding * 5.0);
        REQUIRE(r.gain >= 0.0_r);
        REQUIRE(r.gain <= 1.0_r);
        // Monotone in every state.
        if (r.state == RampState::kRampingOut) REQUIRE(r.gain <= last.gain);
        if (r.state == RampState::kRampingIn) REQUIRE(r.gain >= last.gain);
        if (elapsed_s == 0.0) REQUIRE(r.gain == last.gain);
        ++seen[static_cast<std::size_t>(r.state)];
        given = now;
        last = r;
      }
    }
    for (const int count : seen) CHECK(count > 1000);
  }

  TEST_CASE("nothing to let go of: out with the next stamp") {
    WrenchRamp ramp(slew_limits(1, 1));
    (void)ramp.update(0, Wrench{});
    ramp.ramp_out();
    CHECK(ramp.update(0, Wrench{}).state == RampState::kRampingOut);
    CHECK(ramp.update(1'000, Wrench{}).state == RampState::kOut);
  }

  TEST_CASE("hostile numbers: the last finite wrench, finite output") {
    const Real bad[] = {std::numeric_limits<Real>::quiet_NaN(),
                        std::numeric_limits<Real>::infinity(), -1.0_r};
    for (const Real value : bad) {
      WrenchRamp ramp(WrenchRampLimits{value, value, value, value});
      (void)ramp.update(0, kPush);
      const Wrench broken = {Vec3(1, std::numeric_limits<Real>::quiet_NaN(), 2), Vec3::Zero()};
      CHECK(ramp.update(1'000'000, broken).wrench_w.force_w == kPush.force_w);
      ramp.ramp_out();
      CHECK(ramp.update(2'000'000, broken).state == RampState::kOut);  // no limit, no time: at once
      ramp.ramp_in();
      for (int tick = 3; tick < 60; ++tick) {
        const RampedWrench r = ramp.update(tick * 1'000'000, broken);
        REQUIRE(is_finite(r.wrench_w));
      }
      CHECK(ramp.gain() == 1.0_r);
    }
    // A force whose square overflows is still let go of.
    const Real huge = std::sqrt(std::numeric_limits<Real>::max());
    WrenchRamp ramp(slew_limits(static_cast<double>(huge), 1.0));
    (void)ramp.update(0, Wrench{Vec3(4.0_r * huge, 0, 0), Vec3::Zero()});
    ramp.ramp_out();
    CHECK(static_cast<double>(ramp.update(4'000'000, Wrench{}).gain) == doctest::Approx(0.999));
    CHECK(static_cast<double>(ramp.update(8'000'000, Wrench{}).gain) == doctest::Approx(0.998));
  }
}
