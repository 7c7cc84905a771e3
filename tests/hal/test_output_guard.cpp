// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "hal/usb/output_guard.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kGuardPeriod_ns = 1'000'000;

SafetyLimits test_limits() {
  SafetyLimits limits;
  limits.max_force_n = 4.0_r;
  limits.max_torque_nm = 0.1_r;
  limits.max_axis_force_n = Vec3(2.0_r, 0.0_r, 3.0_r);
  limits.slew_n_per_s = 500.0_r;
  limits.slew_nm_per_s = 8.0_r;
  return limits;
}

DeviceCommand command_of(std::uint64_t tick, std::int64_t stamp_ns, const Vec3& force_d,
                         std::uint32_t arming) {
  DeviceCommand command;
  command.tick = tick;
  command.stamp_ns = stamp_ns;
  command.wrench_d = record_of(Wrench{force_d, Vec3(0.0_r, 0.0_r, 0.02_r)});
  command.arming = arming;
  return command;
}

// A guard with a servo thread behind it that is on time.
struct Session {
  OutputGuard guard{test_limits()};
  std::int64_t now_ns = 5'000'000'000;
  std::uint64_t tick = 0;
  DeviceCommand command;

  GuardedOutput on_time(const Vec3& force_d, std::uint32_t arming) {
    now_ns += kGuardPeriod_ns;
    command = command_of(++tick, now_ns, force_d, arming);
    return guard.update(now_ns, command);
  }
  GuardedOutput without_command() {
    now_ns += kGuardPeriod_ns;
    return guard.update(now_ns, command);
  }
  GuardedOutput run(int ticks, const Vec3& force_d, std::uint32_t arming) {
    GuardedOutput last;
    for (int k = 0; k < ticks; ++k) last = on_time(force_d, arming);
    return last;
  }
};

bool is_zero(const Wrench& w) { return w.force_w == Vec3::Zero() && w.torque_w == Vec3::Zero(); }

const Vec3 kForce_d(1.0_r, 0.5_r, -1.0_r);

}  // namespace

TEST_SUITE("hal.output_guard") {
  TEST_CASE("update: exactly zero until the operator has armed, then the command ramps in") {
    Session s;
    for (int k = 0; k < 20; ++k) CHECK(is_zero(s.on_time(kForce_d, 0).wrench_d));
    const Real early = s.run(10, kForce_d, 1).wrench_d.force_w.norm();
    CHECK(early > 0.0_r);
    CHECK(early < 0.2_r * kForce_d.norm());  // a tenth of the ramp of 100 ms
    const GuardedOutput full = s.run(200, kForce_d, 1);
    CHECK(full.wrench_d.force_w == kForce_d);
    CHECK(full.tick == s.tick);
    CHECK_FALSE(full.held);
    CHECK(full.faults == 0u);
  }

  TEST_CASE("update: norms and axes are cut along the direction of the force") {
    Session s;
    const Wrench w = s.run(300, Vec3(100.0_r, 100.0_r, 0.0_r), 1).wrench_d;
    CHECK(w.force_w.x() == doctest::Approx(2.0));  // the axis limit, before the norm's
    CHECK(w.force_w.y() == doctest::Approx(2.0));
    const Wrench huge =
        s.run(300, Vec3(0.0_r, std::numeric_limits<Real>::max(), 0.0_r), 1).wrench_d;
    CHECK(huge.force_w.y() == doctest::Approx(4.0));
    CHECK(huge.torque_w.z() == doctest::Approx(0.02));
  }

  TEST_CASE("update: a late command is held and decays, a lost one ends at zero and is latched") {
    Session s;
    s.run(300, kForce_d, 1);
    for (int age = 1; age <= 2; ++age) CHECK_FALSE(s.without_command().held);  // on time
    Real last = s.guard.last().force_w.norm();
    for (int age = 3; age <= 6; ++age) {
      const GuardedOutput held = s.without_command();
      CHECK(held.held);
      CHECK(held.faults == 0u);
      CHECK(held.wrench_d.force_w.norm() < last);
      last = held.wrench_d.force_w.norm();
    }
    CHECK(last > 0.0_r);
    CHECK(s.without_command().faults == kLinkStaleCommand);
    for (int k = 0; k < 10; ++k) (void)s.without_command();
    CHECK(is_zero(s.guard.last()));

    // Commands come again: no cause any more, but zero until the arming count grows.
    GuardedOutput again = s.run(50, kForce_d, 1);
    CHECK(is_zero(again.wrench_d));
    CHECK(again.faults == kLinkStaleCommand);
    CHECK(again.present == 0u);
    again = s.run(300, kForce_d, 2);
    CHECK(again.wrench_d.force_w == kForce_d);
    CHECK(again.faults == 0u);
  }

  TEST_CASE("update: numbers that are not finite count as no command") {
    Session s;
    s.run(300, kForce_d, 1);
    const Vec3 nan = Vec3::Constant(std::numeric_limits<Real>::quiet_NaN());
    CHECK(s.on_time(nan, 1).wrench_d.force_w.norm() < kForce_d.norm());
    CHECK(s.guard.faults() == 0u);
    s.run(6, nan, 1);
    CHECK(s.guard.faults() == kLinkStaleCommand);
    s.run(10, nan, 1);
    CHECK(is_zero(s.guard.last()));
  }

  TEST_CASE("update: a stamp far in the future is no sign of life") {
    Session s;
    s.run(300, kForce_d, 1);
    s.command.stamp_ns = s.now_ns + 3'600'000'000'000;
    s.command.tick = ++s.tick;
    for (int k = 0; k < 20; ++k) (void)s.without_command();
    CHECK(s.guard.faults() == kLinkStaleCommand);
    CHECK(is_zero(s.guard.last()));
  }

  TEST_CASE("restart: zero at once, until the arming count grows beyond what it is then") {
    Session s;
    s.run(300, kForce_d, 7);
    s.guard.restart();
    CHECK(is_zero(s.guard.last()));
    for (int k = 0; k < 50; ++k) CHECK(is_zero(s.on_time(kForce_d, 7).wrench_d));
    s.run(300, kForce_d, 8);
    CHECK(s.guard.last().force_w == kForce_d);
  }

  TEST_CASE("delivered: what the driver withheld comes back by the slew limit alone") {
    Session s;
    s.run(300, kForce_d, 1);
    (void)s.on_time(kForce_d, 1);
    s.guard.delivered(Wrench{});
    const Real most_n = test_limits().slew_n_per_s * 1.0e-3_r;
    const Real first_n = s.on_time(kForce_d, 1).wrench_d.force_w.norm();
    CHECK(first_n > 0.0_r);
    CHECK(first_n <= most_n * (1.0_r + 1.0e-6_r));
    CHECK(s.run(10, kForce_d, 1).wrench_d.force_w == kForce_d);
    // What is no number is not taken over.
    Wrench broken;
    broken.force_w.x() = std::numeric_limits<Real>::quiet_NaN();
    s.guard.delivered(broken);
    CHECK(s.on_time(kForce_d, 1).wrench_d.force_w == kForce_d);
  }

  TEST_CASE("latch: ramps out by the slew limit, and stays out") {
    Session s;
    s.run(300, kForce_d, 1);
    s.guard.latch(kLinkServoLost);
    Real last = kForce_d.norm();
    for (int k = 0; k < 20; ++k) {
      const GuardedOutput out = s.on_time(kForce_d, 1);
      CHECK(out.faults == kLinkServoLost);
      CHECK(last - out.wrench_d.force_w.norm() <= 0.5_r * (1.0_r + 1.0e-6_r));
      last = out.wrench_d.force_w.norm();
    }
    CHECK(is_zero(s.guard.last()));
  }

  TEST_CASE("update: another servo process, whose counts start again, must arm by itself") {
    Session s;
    s.run(300, kForce_d, 9);
    s.tick = 0;
    s.run(50, kForce_d, 0);
    CHECK(is_zero(s.guard.last()));
    CHECK(s.guard.faults() == kLinkServoLost);
    s.run(300, kForce_d, 1);
    CHECK(s.guard.last().force_w == kForce_d);
    CHECK(s.guard.faults() == 0u);
  }

  TEST_CASE("not_delivered: the next output starts from what the device has") {
    Session s;
    s.run(300, kForce_d, 1);
    const Wrench delivered = s.guard.last();
    (void)s.on_time(-kForce_d, 1);
    CHECK(s.guard.last().force_w != delivered.force_w);
    s.guard.not_delivered();
    CHECK(s.guard.last().force_w == delivered.force_w);
    // Two periods since: twice the step of one, and no more.
    const Real step = (s.on_time(-kForce_d, 1).wrench_d.force_w - delivered.force_w).norm();
    CHECK(step == doctest::Approx(1.0));
  }

  TEST_CASE("update: letting go, no component of the wrench grows, no matter what is commanded") {
    struct Case {
      const char* name;
      int armed_periods;
    };
    // The command has just jumped, and the output is on its way there by the slew limit: a ramp
    // that took the command down instead of the output let it climb on.
    for (const Case& c :
         {Case{"early in the ramp in", 10}, {"half way", 50}, {"at full force", 300}}) {
      for (const char* cause : {"latched", "deadman up", "silent"}) {
        CAPTURE(c.name);
        CAPTURE(cause);
        Session s;
        s.run(c.armed_periods, Vec3(0.9_r, -0.4_r, 0.3_r), 1);
        const std::uint32_t faults = cause == std::string("latched") ? kLinkServoLost : 0u;
        const Vec3 asked_d(2.0_r, -2.0_r, 2.0_r);
        Wrench last = s.on_time(asked_d, 1).wrench_d;
        REQUIRE(last.force_w.norm() > 0.0_r);
        if (faults != 0) s.guard.latch(faults);
        for (int k = 0; k < 40; ++k) {
          if (cause == std::string("deadman up")) s.guard.hold_back(s.command);
          if (cause == std::string("silent")) s.guard.latch(kLinkSilent);
          const Real grown = 1.0_r + static_cast<Real>(k);
          const Wrench now = s.on_time(asked_d * grown, 1).wrench_d;
          for (int i = 0; i < 3; ++i) {
            CHECK(std::abs(now.force_w[i]) <= std::abs(last.force_w[i]));
            CHECK(now.force_w[i] * last.force_w[i] >= 0.0_r);
            CHECK(std::abs(now.torque_w[i]) <= std::abs(last.torque_w[i]));
            CHECK(now.torque_w[i] * last.torque_w[i] >= 0.0_r);
          }
          last = now;
        }
        CHECK(is_zero(last));
      }
    }
  }

  TEST_CASE("update: after a stall the step is that of two periods, not of the time missed") {
    for (const std::int64_t report_ns :
         {kGuardPeriod_ns, kGuardPeriod_ns / 4, 4 * kGuardPeriod_ns}) {
      for (const std::int64_t stall_ns :
           {5 * kGuardPeriod_ns, 100 * kGuardPeriod_ns, 60'000 * kGuardPeriod_ns}) {
        Session s;
        s.guard.follow_reports(report_ns);
        s.run(1200, kForce_d, 1);
        REQUIRE(s.guard.last().force_w == kForce_d);
        s.now_ns += stall_ns;
        const Vec3 now = s.on_time(-kForce_d, 1).wrench_d.force_w;
        const double least_ns = static_cast<double>(std::min(report_ns, kGuardPeriod_ns));
        CHECK((kForce_d - now).norm() == doctest::Approx(500.0 * 2e-9 * least_ns).epsilon(1e-5));
      }
    }
  }

  TEST_CASE("update: the largest numbers there are neither freeze nor turn the output") {
    constexpr Real kMax = std::numeric_limits<Real>::max();
    constexpr Real kLeast = std::numeric_limits<Real>::denorm_min();
    const Real extremes[] = {-kMax, kMax, -kMax / 2, kLeast, -kLeast, 0, 1};
    for (const Real x : extremes) {
      for (const Real y : extremes) {
        for (const Real z : extremes) {
          CAPTURE(x);
          CAPTURE(y);
          CAPTURE(z);
          Session s;
          s.run(300, kForce_d, 1);
          const Vec3 asked(x, y, z);
          const Vec3 v = s.run(60, asked, 1).wrench_d.force_w;
          REQUIRE(is_finite(v));
          CHECK(v.norm() <= 4.0_r * 1.0001_r);
          const Real largest = asked.cwiseAbs().maxCoeff();
          if (largest >= 1) {
            CHECK((v - v.norm() * (asked / largest).normalized()).norm() <= 1e-4);
            CHECK(v.norm() >= 0.99_r);
          } else {
            CHECK(v.norm() <= 1e-4);
          }
          s.guard.latch(kLinkServoLost);
          s.run(20, asked, 1);
          CHECK(is_zero(s.guard.last()));
        }
      }
    }
  }

  TEST_CASE("update: no sequence of commands makes the output jump or leave its limits") {
    const SafetyLimits limits = test_limits();
    const std::uint64_t seed = 20240611;
    INFO("seed ", seed);
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); };
    const auto below = [&](std::uint64_t n) { return random() % n; };
    const Real hostile[] = {
        std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity(),
        -std::numeric_limits<Real>::max(), std::numeric_limits<Real>::denorm_min(),
        std::numeric_limits<Real>::max()};
    OutputGuard guard(limits);
    DeviceCommand command;
    std::int64_t now_ns = 1'000'000'000;
    Wrench last;
    Real largest_n = 0.0_r;
    int moved = 0;
    int wrong = 0;
    for (int k = 0; k < 400'000 && wrong == 0; ++k) {
      std::int64_t step_ns = kGuardPeriod_ns + static_cast<std::int64_t>(200'000 * uniform());
      if (below(200) == 0) step_ns = static_cast<std::int64_t>(below(30'000'000'000));
      if (below(500) == 0) step_ns = -static_cast<std::int64_t>(below(3'000'000));
      now_ns += step_ns;
      if (below(10) != 0) {  // else the servo is late
        command.tick += below(2000) == 0 ? std::uint64_t{0} - below(command.tick + 1) : 1;
        command.stamp_ns = now_ns - static_cast<std::int64_t>(below(900'000));
        if (below(300) == 0) command.stamp_ns = static_cast<std::int64_t>(random());
        if (below(100) == 0) command.arming += 1;
        if (below(3000) == 0) command.arming = static_cast<std::uint32_t>(below(1000));
        for (int i = 0; i < 3; ++i) {
          if (below(20) == 0) command.wrench_d.force_n[i] = static_cast<Real>(8.0 * uniform());
          if (below(20) == 0) command.wrench_d.torque_nm[i] = static_cast<Real>(uniform());
          if (below(900) == 0) command.wrench_d.force_n[i] = hostile[below(5)];
          if (below(900) == 0) command.wrench_d.torque_nm[i] = hostile[below(5)];
        }
      }
      if (below(5000) == 0) guard.latch(kLinkSilent);
      const GuardedOutput out = guard.update(now_ns, command);
      if (below(200) == 0) {
        guard.not_delivered();
        now_ns -= step_ns;  // the next step is measured from the output that was delivered
        continue;
      }
      const Real dt_s = std::min(static_cast<Real>(std::max<std::int64_t>(step_ns, 0)) * 1.0e-9_r,
                                 longest_step_s(limits.period_ns));
      const Real slack = 64 * std::numeric_limits<Real>::epsilon() * limits.max_force_n;
      const Wrench& w = out.wrench_d;
      bool good = is_finite(w);
      good = good && (w.force_w - last.force_w).norm() <= limits.slew_n_per_s * dt_s + slack;
      good = good && (w.torque_w - last.torque_w).norm() <= limits.slew_nm_per_s * dt_s + slack;
      good = good && w.force_w.norm() <= limits.max_force_n + slack;
      good = good && w.torque_w.norm() <= limits.max_torque_nm + slack;
      for (int i = 0; i < 3; ++i) {
        const Real limit = limits.max_axis_force_n[i];
        good = good && (limit == 0.0_r || std::abs(w.force_w[i]) <= limit + slack);
      }
      if (!good) ++wrong;
      moved += w.force_w != last.force_w ? 1 : 0;
      largest_n = std::max(largest_n, w.force_w.norm());
      last = w;
    }
    CHECK(wrong == 0);
    CHECK(moved > 100'000);  // the sequence really drives it
    CHECK(largest_n > 0.9_r * limits.max_force_n);
  }
}
