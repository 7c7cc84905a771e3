// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "rt_core/safety/output_limiter.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using haptic::test::norm;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kSeed = 0x51E;
constexpr double kRounding = 32.0 * static_cast<double>(kRealEpsilon);
constexpr std::int64_t kMs = 1'000'000;

/// A limiter at work: on time, the handle at rest, a tick every millisecond.
struct Running {
  explicit Running(const SafetyLimits& l) : limiter(l) {}
  LimitedOutput tick(const Wrench& spring, const Wrench& damping = {}, bool wants = true,
                     std::uint32_t late = 0) {
    LimiterInput in;
    in.stamp_ns = stamp += kMs;
    in.spring_d = spring;
    in.damping_d = damping;
    in.twist_d = twist;
    in.wants_force = wants;
    in.late_periods = late;
    return limiter.update(in);
  }
  LimitedOutput settled(const Wrench& spring, const Wrench& damping = {}) {
    LimitedOutput out;
    for (int k = 0; k < 400; ++k) out = tick(spring, damping);
    return out;
  }
  OutputLimiter limiter;
  std::int64_t stamp = 0;
  Twist twist;
};

Wrench push(Real x, Real y, Real z) { return {Vec3(x, y, z), Vec3::Zero()}; }

bool allowed(const Vec3& v, double limit, const Vec3& axes) {
  for (int k = 0; k < 3; ++k) {
    const double axis = static_cast<double>(axes[k]);
    if (axis > 0 && std::abs(static_cast<double>(v[k])) > axis * (1 + kRounding)) return false;
  }
  return norm(v) <= limit * (1 + kRounding);
}

/// Any number at all.
Real hostile(Random& random, double size) {
  const double kind = random.uniform(0, 1);
  const Real sign = random.uniform(0, 1) < 0.5 ? -1.0_r : 1.0_r;
  if (kind < 0.90) return static_cast<Real>(random.uniform(-size, size));
  if (kind < 0.92) return std::numeric_limits<Real>::quiet_NaN();
  if (kind < 0.94) return sign * std::numeric_limits<Real>::infinity();
  if (kind < 0.96) return sign * std::numeric_limits<Real>::max();
  if (kind < 0.97) return sign * std::numeric_limits<Real>::denorm_min();
  if (kind < 0.98) return 0.0_r;
  return sign * static_cast<Real>(std::exp2(random.uniform(-100.0, 100.0)));
}
Vec3 hostile_vector(Random& random, double size) {
  return {hostile(random, size), hostile(random, size), hostile(random, size)};
}

std::int64_t hostile_stamp(Random& random, std::int64_t stamp) {
  const double kind = random.uniform(0, 1);
  const auto by = [&](double ns) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(stamp) +
                                     static_cast<std::uint64_t>(static_cast<std::int64_t>(ns)));
  };
  if (kind < 0.90) return by(random.uniform(0.5e6, 1.5e6));
  if (kind < 0.92) return stamp;
  if (kind < 0.94) return by(-random.uniform(0, 1e9));
  if (kind < 0.96) return by(random.uniform(0, 5e6));
  if (kind < 0.98) return by(random.uniform(0, 1e13));
  if (kind < 0.99) return std::numeric_limits<std::int64_t>::max();
  return random.uniform(0, 1) < 0.5 ? std::numeric_limits<std::int64_t>::min() : 0;
}

SafetyLimits random_limits(Random& random) {
  SafetyLimits l;
  l.max_force_n = static_cast<Real>(std::exp2(random.uniform(-3.0, 5.0)));
  l.max_torque_nm = static_cast<Real>(std::exp2(random.uniform(-8.0, 0.0)));
  if (random.uniform(0, 1) < 0.5) {
    for (int k = 0; k < 3; ++k) {
      l.max_axis_force_n[k] = l.max_force_n * static_cast<Real>(random.uniform(0, 1.5));
      l.max_axis_torque_nm[k] = l.max_torque_nm * static_cast<Real>(random.uniform(0, 1.5));
    }
  }
  l.slew_n_per_s = static_cast<Real>(std::exp2(random.uniform(3.0, 12.0)));
  l.slew_nm_per_s = static_cast<Real>(std::exp2(random.uniform(-3.0, 6.0)));
  l.ramp_in_s = static_cast<Real>(random.uniform(0.05, 0.2));
  if (random.uniform(0, 1) < 0.3) l.driven_dof = static_cast<std::uint32_t>(random.next() & 0x3fu);
  if (random.uniform(0, 1) < 0.1) l.slew_n_per_s = hostile(random, 500);
  if (random.uniform(0, 1) < 0.1) l.max_force_n = hostile(random, 10);
  if (random.uniform(0, 1) < 0.1) l.zero_speed_m_per_s = hostile(random, 10);
  if (random.uniform(0, 1) < 0.1) l.ramp_in_s = hostile(random, 0.2);
  if (random.uniform(0, 1) < 0.1) l.decay_per_period = hostile(random, 1);
  return l;
}

/// What of the time between two stamps counts for the slew.
double counted_between(std::int64_t from_ns, std::int64_t to_ns, const SafetyLimits& l) {
  if (to_ns <= from_ns) return 0.0;
  const std::uint64_t span_ns =
      static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  return std::min(static_cast<double>(span_ns) * 1.0e-9,
                  static_cast<double>(longest_step_s(l.period_ns)));
}

/// Which promise a step of the output breaks; "" is none.
const char* broken_promise(const Wrench& last, const Wrench& now, const SafetyLimits& l,
                           double counted_s) {
  const double max_n = static_cast<double>(l.max_force_n);
  const double max_nm = static_cast<double>(l.max_torque_nm);
  if (!is_finite(now)) return "finite";
  if (norm(now.force_w - last.force_w) >
      static_cast<double>(l.slew_n_per_s) * counted_s + kRounding * max_n) {
    return "slew of force";
  }
  if (norm(now.torque_w - last.torque_w) >
      static_cast<double>(l.slew_nm_per_s) * counted_s + kRounding * max_nm) {
    return "slew of torque";
  }
  if (norm(now.force_w) > max_n || norm(now.torque_w) > max_nm) return "norm";
  for (int k = 0; k < 3; ++k) {
    const Real force = std::abs(now.force_w[k]), torque = std::abs(now.torque_w[k]);
    if (l.max_axis_force_n[k] > 0 && force > l.max_axis_force_n[k]) return "axis of force";
    if (l.max_axis_torque_nm[k] > 0 && torque > l.max_axis_torque_nm[k]) return "axis of torque";
    if ((l.driven_dof >> k & 1u) == 0 && force != 0.0_r) return "driven axes of force";
    if ((l.driven_dof >> (k + 3) & 1u) == 0 && torque != 0.0_r) return "driven axes of torque";
  }
  return "";
}

}  // namespace

TEST_SUITE("rt_core.output_limiter") {
  TEST_CASE("starts out at zero, ramps in over the time asked for, lets go by the slew limit") {
    SafetyLimits l;
    l.ramp_in_s = 0.080_r;
    Running r(l);
    const Wrench spring = {Vec3(0, 0, 1), Vec3(0, 0.02_r, 0)};
    for (int k = 0; k < 10; ++k) {
      const LimitedOutput out = r.tick(spring, {}, false);
      CHECK(out.wrench_d.force_w == Vec3::Zero());
      CHECK(out.flags == kLimiterRamping);
      CHECK(out.gain == 0.0_r);
    }
    for (int k = 0; k <= 80; ++k) {
      const LimitedOutput out = r.tick(spring);
      CHECK(static_cast<double>(out.wrench_d.force_w.z()) == doctest::Approx(k / 80.0));
      CHECK(static_cast<double>(out.wrench_d.torque_w.y()) == doctest::Approx(k * 0.02 / 80.0));
    }
    const LimitedOutput in = r.tick(spring);
    CHECK(in.gain == 1.0_r);
    CHECK(in.flags == 0);
    CHECK(in.wrench_d.force_w == spring.force_w);
    CHECK(in.wrench_d.torque_w == spring.torque_w);
    // 1 N at 600 N/s: 0.4 N, then nothing; 0.02 N m at 10 N m/s: gone in two ticks, too.
    const Wrench other = {Vec3(5, 5, 5), Vec3(1, 1, 1)};  // what comes from behind does not count
    const LimitedOutput first = r.tick(other, {}, false);
    CHECK(norm(first.wrench_d.force_w - Vec3(0, 0, 0.4_r)) <= 1.0e-5);
    CHECK((first.flags & kLimiterSlewed) != 0);
    CHECK(r.tick(other, {}, false).wrench_d.force_w == Vec3::Zero());
    CHECK(r.tick(other, {}, false).wrench_d.torque_w == Vec3::Zero());  // less a rounding margin
    CHECK(longest_ramp_s(l) >= 0.005_r);
    // Taken up again, it ramps in again.
    for (int k = 0; k <= 40; ++k) {
      CHECK(static_cast<double>(r.tick(spring).wrench_d.force_w.z()) == doctest::Approx(k / 80.0));
    }
  }

  TEST_CASE("a limiter of the default is as careful as one of the default limits") {
    OutputLimiter plain, given(SafetyLimits{});
    for (int k = 0; k < 300; ++k) {
      LimiterInput in;
      in.stamp_ns = k * kMs;
      in.spring_d = {Vec3(9, 9, 9), Vec3(1, 0, 0)};
      in.wants_force = true;
      const LimitedOutput out = plain.update(in);
      CHECK(out.wrench_d.force_w == given.update(in).wrench_d.force_w);
      if (k < 50) CHECK(norm(out.wrench_d.force_w) <= 3.0 * k / 50.0 + 1.0e-5);
    }
  }

  TEST_CASE("clamp: the spring is taken back first, the damping only where that is not enough") {
    const SafetyLimits l;  // 3 N
    const LimitedOutput across = Running(l).settled(push(10, 0, 0), push(0, 1, 0));
    CHECK(norm(across.wrench_d.force_w - Vec3(std::sqrt(8.0_r), 1, 0)) <= 1.0e-5);
    CHECK(across.flags == kLimiterClamped);
    const LimitedOutput against = Running(l).settled(push(10, 0, 0), push(-4, 0, 0));
    CHECK(norm(against.wrench_d.force_w - Vec3(3, 0, 0)) <= 1.0e-5);
    CHECK(against.flags == kLimiterClamped);
    const LimitedOutput hard = Running(l).settled(push(1, 0, 0), push(0, 6, 0));
    CHECK(norm(hard.wrench_d.force_w - Vec3(0, 3, 0)) <= 1.0e-5);
    CHECK(hard.flags == (kLimiterClamped | kLimiterDampingCut));
    // The spring brings a damping within the limit that is not within it alone.
    const LimitedOutput helped = Running(l).settled(push(-5, 0, 0), push(7, 0, 0));
    CHECK(norm(helped.wrench_d.force_w - Vec3(2, 0, 0)) <= 1.0e-5);
    CHECK(helped.flags == 0);
    // It would, were it stronger: a damping that has to be cut is cut alone.
    const LimitedOutput weak = Running(l).settled(push(-1, 0, 0), push(7, 1, 0));
    CHECK(norm(weak.wrench_d.force_w - 3.0_r * Vec3(7, 1, 0).normalized()) <= 1.0e-5);
    CHECK(weak.flags == (kLimiterClamped | kLimiterDampingCut));
    // Force and torque have limits of their own.
    const LimitedOutput both =
        Running(l).settled({Vec3(1, 0, 0), Vec3(0, 5, 0)}, {Vec3(0, 0.5_r, 0), Vec3::Zero()});
    CHECK(norm(both.wrench_d.force_w - Vec3(1, 0.5_r, 0)) <= 1.0e-5);
    CHECK(norm(both.wrench_d.torque_w - Vec3(0, 0.05_r, 0)) <= 1.0e-6);
  }

  TEST_CASE("clamp: the share of the spring is the largest there is, random parts and limits") {
    CAPTURE(kSeed);
    Random random(kSeed);
    int clamped = 0, cut = 0;
    for (int k = 0; k < 300; ++k) {
      SafetyLimits l;
      l.slew_n_per_s = 1.0e6_r;
      l.max_axis_force_n = Vec3(k % 3 == 0 ? 2.0_r : 0.0_r, 0, k % 5 == 0 ? 1.0_r : 0.0_r);
      const Vec3 spring(static_cast<Real>(random.uniform(-8, 8)),
                        static_cast<Real>(random.uniform(-8, 8)),
                        static_cast<Real>(random.uniform(-8, 8)));
      const Vec3 damping(static_cast<Real>(random.uniform(-3, 3)),
                         static_cast<Real>(random.uniform(-3, 3)),
                         static_cast<Real>(random.uniform(-3, 3)));
      const LimitedOutput out = Running(l).settled({spring, Vec3::Zero()}, {damping, Vec3::Zero()});
      double best = -1;
      constexpr int kSteps = 20'000;
      for (int s = kSteps; s >= 0 && best < 0; --s) {
        const Vec3 sum = static_cast<Real>(s) / static_cast<Real>(kSteps) * spring + damping;
        if (allowed(sum, 3.0, l.max_axis_force_n)) best = static_cast<double>(s) / kSteps;
      }
      REQUIRE(((out.flags & kLimiterDampingCut) != 0) == (best < 0));
      REQUIRE(allowed(out.wrench_d.force_w, 3.0, l.max_axis_force_n));
      clamped += (out.flags & kLimiterClamped) != 0;
      if (best < 0) {
        ++cut;
        const Vec3 direction = damping.normalized();
        REQUIRE(norm(out.wrench_d.force_w - out.wrench_d.force_w.dot(direction) * direction) <=
                1.0e-5);
        continue;
      }
      const Vec3 expected = static_cast<Real>(best) * spring + damping;
      REQUIRE(norm(out.wrench_d.force_w - expected) <= norm(spring) / kSteps + 1.0e-4);
    }
    CHECK(clamped > 100);
    CHECK(cut > 20);
  }

  TEST_CASE("driven degrees of freedom: the rest of a wrench is dropped before it is clamped") {
    SafetyLimits l;
    l.driven_dof = 0x5;  // x, z
    const LimitedOutput out = Running(l).settled({Vec3(2, 100, 1), Vec3(1, 1, 1)}, push(0, 50, 0));
    CHECK(out.wrench_d.force_w == Vec3(2, 0, 1));
    CHECK(out.wrench_d.torque_w == Vec3::Zero());
    CHECK(out.flags == 0);
  }

  TEST_CASE("speed: full below the first, none above the second, linear between; NaN is fast") {
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    struct Case {
      Twist twist;
      double share;
    };
    for (const Case& c :
         {Case{{Vec3(0.9_r, 0, 0), Vec3(0, 14, 0)}, 1.0},
          Case{{Vec3(0, 1.25_r, 0), Vec3::Zero()}, 0.75}, Case{{Vec3::Zero(), Vec3(0, 27, 0)}, 0.2},
          Case{{Vec3(0, 1.25_r, 0), Vec3(0, 27, 0)}, 0.2}, Case{{Vec3(5, 0, 0), Vec3::Zero()}, 0.0},
          Case{{Vec3(std::numeric_limits<Real>::max(), 0, 0), Vec3::Zero()}, 0.0},
          Case{{Vec3(0, nan, 0), Vec3::Zero()}, 0.0}}) {
      Running r{SafetyLimits{}};
      r.twist = c.twist;
      const LimitedOutput out = r.settled(push(0, 0, 2), push(0.5_r, 0, 0));
      CHECK(static_cast<double>(out.wrench_d.force_w.z()) == doctest::Approx(2 * c.share));
      CHECK(static_cast<double>(out.wrench_d.force_w.x()) == doctest::Approx(0.5 * c.share));
      CHECK(((out.flags & kLimiterSpeed) != 0) == (c.share < 1));
    }
  }

  TEST_CASE("late: noted, then held and fading, then taken up again by the slew limit") {
    Running r{SafetyLimits{}};
    r.settled(push(0, 0, 2));
    const LimitedOutput noted = r.tick(push(0, 0, 2), {}, true, 1);
    CHECK(noted.wrench_d.force_w == Vec3(0, 0, 2));
    CHECK(noted.flags == kLimiterLate);
    double held = 2;
    for (std::uint32_t late = 2; late <= 5; ++late) {
      const LimitedOutput out = r.tick(push(0, 0, -9), {}, true, late);
      held = std::max(0.7 * held, held - 0.6);
      CHECK(static_cast<double>(out.wrench_d.force_w.z()) == doctest::Approx(held));
      CHECK((out.flags & kLimiterDecaying) != 0);
    }
    // The caller's fault: it goes on down from where it is, never back up.
    Running faulted = r;
    double last = held;
    for (int k = 0; k < 6; ++k) {
      const double now = norm(faulted.tick(push(0, 0, 2), {}, false, 6).wrench_d.force_w);
      CHECK(now <= last);
      last = now;
    }
    CHECK(last == 0);
    const LimitedOutput back = r.tick(push(0, 0, 2));
    CHECK(static_cast<double>(back.wrench_d.force_w.z()) == doctest::Approx(held + 0.6));
  }

  TEST_CASE("after a stall: a tick takes back what two periods allow, not what was missed") {
    for (const std::int64_t period_ns : {kMs / 4, kMs, 4 * kMs}) {
      SafetyLimits l;
      l.period_ns = period_ns;
      const double allowed_n = 600.0 * std::min(2e-9 * static_cast<double>(period_ns), 5e-3);
      for (const std::int64_t stall_ns : {5 * kMs, 100 * kMs, 60'000 * kMs}) {
        Running r(l);
        r.settled(push(0, 0, 2.9_r));
        r.stamp += stall_ns;
        const LimitedOutput out = r.tick(push(0, 0, -2.9_r));
        CHECK(2.9 - static_cast<double>(out.wrench_d.force_w.z()) ==
              doctest::Approx(allowed_n).epsilon(1e-5));
      }
    }
  }

  TEST_CASE("the largest numbers there are: finite, within the limits, not turned, let go of") {
    constexpr Real kMax = std::numeric_limits<Real>::max();
    constexpr Real kLeast = std::numeric_limits<Real>::denorm_min();
    const Real extremes[] = {-kMax, kMax, -kMax / 2, kLeast, -kLeast, 0, 1};
    const SafetyLimits l;
    for (const Real x : extremes) {
      for (const Real y : extremes) {
        for (const Real z : extremes) {
          CAPTURE(x);
          CAPTURE(y);
          CAPTURE(z);
          Running r(l);
          r.settled(push(0, 0, 2));
          const Vec3 asked(x, y, z);
          const Real largest = asked.cwiseAbs().maxCoeff();
          const Vec3 v = r.settled({asked, asked}).wrench_d.force_w;
          REQUIRE(is_finite(v));
          CHECK(norm(v) <= static_cast<double>(l.max_force_n));
          // Of numbers whose squares underflow next to the limit nothing is left: zero is safe.
          const Vec3 shape = largest > 0 ? Vec3(asked / largest) : Vec3(Vec3::Zero());
          CHECK(norm(v - norm(v) * shape.normalized()) <= 1e-4);
          if (largest == 1) CHECK(norm(v) >= 0.99);
          for (int k = 0; k < 6; ++k) r.tick({asked, -asked}, {}, false);
          CHECK(r.limiter.last().force_w == Vec3::Zero());
        }
      }
    }
  }

  TEST_CASE("not finite: the last finite wrench stays, flagged") {
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    Running r{SafetyLimits{}};
    r.settled(push(1, 0, 0), push(0, 0.5_r, 0));
    for (const Wrench& bad : {push(nan, 0, 0), Wrench{Vec3::Zero(), Vec3(0, 0, -nan)},
                              push(0, std::numeric_limits<Real>::infinity(), 0)}) {
      CHECK(r.tick(bad).wrench_d.force_w == Vec3(1, 0.5_r, 0));
      CHECK(r.tick(push(1, 0, 0), bad).wrench_d.force_w == Vec3(1, 0.5_r, 0));
      CHECK((r.tick(bad, bad).flags & kLimiterNotFinite) != 0);
    }
    CHECK(r.tick(push(1, 0, 0)).flags == 0);
  }

  TEST_CASE("a million hostile ticks: finite, within the limits, never faster than the slew") {
    CAPTURE(kSeed);
    Random random(kSeed);
    std::uint32_t seen = 0;
    double largest_n = 0;
    int moved = 0, let_go = 0;
    for (int run = 0; run < 1000; ++run) {
      const SafetyLimits given = random_limits(random), l = usable(given);
      OutputLimiter limiter(given);
      const double size = std::exp2(random.uniform(-2.0, 8.0));
      const bool calm = run % 4 == 0;  // hostile numbers only now and then: force is reached
      std::int64_t stamp = static_cast<std::int64_t>(random.next() >> 2);
      bool wants = true, stamped = false;
      int quiet = 0;
      Wrench last;
      for (int tick = 0; tick < 1000; ++tick) {
        LimiterInput in;
        const std::int64_t before = stamp;
        const bool nasty = !calm || random.uniform(0, 1) < 0.01;
        stamp = nasty ? hostile_stamp(random, stamp) : stamp + 1'000'000 * (stamp < (1ll << 62));
        in.stamp_ns = stamp;
        in.spring_d = {Vec3::Constant(static_cast<Real>(size)), Vec3::Constant(0.1_r)};
        if (nasty) {
          in.spring_d = {hostile_vector(random, size), hostile_vector(random, 0.1 * size)};
          in.damping_d = {hostile_vector(random, size), hostile_vector(random, 0.1 * size)};
          in.twist_d = {hostile_vector(random, 0.8), hostile_vector(random, 12)};
        }
        if (random.uniform(0, 1) < 0.005) wants = !wants;
        in.wants_force = wants;
        if (random.uniform(0, 1) < 0.05) in.late_periods = 1u << (random.next() % 32);
        const LimitedOutput out = limiter.update(in);
        const double counted_s = stamped ? counted_between(before, stamp, l) : 0.0;
        stamped = true;
        REQUIRE(std::string(broken_promise(last, out.wrench_d, l, counted_s)) == "");
        REQUIRE(out.gain >= 0.0_r);
        REQUIRE(out.gain <= 1.0_r);
        REQUIRE(out.wrench_d.force_w == limiter.last().force_w);
        if (!wants) {  // never up
          REQUIRE(norm(out.wrench_d.force_w) <= norm(last.force_w) * (1 + kRounding));
          REQUIRE(out.gain == 0.0_r);
          quiet += counted_s > 0.9e-3;
          const double ramp_ms = 1.0e3 * static_cast<double>(longest_ramp_s(l));
          if (quiet > 1.2 * ramp_ms + 2.0) {
            REQUIRE(out.wrench_d.force_w == Vec3::Zero());
            REQUIRE(out.wrench_d.torque_w == Vec3::Zero());
            ++let_go;
          }
        } else {
          quiet = 0;
        }
        moved += out.wrench_d.force_w != last.force_w;
        const double most_n = std::max(static_cast<double>(l.max_force_n), 1.0e-9);
        largest_n = std::max(largest_n, norm(out.wrench_d.force_w) / most_n);
        seen |= out.flags;
        last = out.wrench_d;
      }
    }
    CHECK(seen == 0xffu);  // every flag
    CHECK(moved > 200'000);
    CHECK(let_go > 50'000);
    CHECK(largest_n > 0.99);
  }
}
