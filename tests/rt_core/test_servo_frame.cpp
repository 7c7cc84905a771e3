// SPDX-License-Identifier: Apache-2.0
// The servo tick where the fixed parts move: what the hand feels of it, and of its owner's faults.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "rt_core/base/rotation.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/servo_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

double height(const ServoResult& r) { return static_cast<double>(force_of(r).z()); }

/// Pose number k of the frame, 10 ms after the one before: `z_m` up.
void give(ServoBench& b, double z_m) {
  FrameRecord& f = b.input.frame;
  f.number += 1;
  f.stamp_ns = b.input.now_ns;
  f.p_m[2] = z_m;
  f.fastest_m_per_s = 0.1;
  f.fastest_rad_per_s = 1.0;
  f.late_ns = 50 * kMs;
}

/// Ten ticks after each pose, from `from_m` on in steps of `step_m`.
ServoResult lift(ServoBench& b, double from_m, double step_m, int poses) {
  ServoResult r;
  for (int k = 1; k <= poses; ++k) {
    give(b, from_m + step_m * k);
    r = b.ticks(10);
  }
  return r;
}

}  // namespace

TEST_SUITE("rt_core.servo_frame") {
  TEST_CASE("the floor rises by a millimetre under a hand at rest: 1 N becomes 2 N, evenly") {
    PressingBench b;
    give(b, 0);
    CHECK(height(b.ticks(10)) == doctest::Approx(1.0).epsilon(0.01));
    double last_n = 1.0, largest_step_n = 0;
    for (int pose = 1; pose <= 50; ++pose) {
      give(b, 2e-5 * pose);
      for (int k = 0; k < 10; ++k) {
        const double now_n = height(b.tick());
        largest_step_n = std::max(largest_step_n, std::abs(now_n - last_n));
        last_n = now_n;
      }
    }
    const ServoResult r = b.ticks(5);
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(r.faults == 0);
    CHECK(height(r) == doctest::Approx(2.0).epsilon(0.01));
    CHECK(largest_step_n < 0.004);  // 2 um a tick at 1 N/mm, with a margin of two
    CHECK(static_cast<double>(r.frame_wf.p_wa.z()) == doctest::Approx(0.001));
    // As if the floor stood and the hand had moved: the proxy lives in the frame.
    PressingBench still;
    for (int k = 1; k <= 500; ++k) {
      still.place(0, 0, 0.009 - 2e-6 * k);
      still.tick();
    }
    CHECK(height(still.ticks(5)) == doctest::Approx(height(r)).epsilon(1e-4));
  }

  TEST_CASE("the floor turns to a wall: the force turns with it") {
    ServoBench b;
    give(b, 0);
    const double half = std::sqrt(0.5);
    b.input.frame.q_xyzw[1] = half;  // a quarter about y: the floor's normal is x
    b.input.frame.q_xyzw[3] = half;
    b.input.frame.stands = 1;
    b.place(0.012, 0, 0);
    b.tick();
    for (int k = 0; k <= 30; ++k) {
      b.place(0.012 - 1e-4 * k, 0, 0);
      b.tick();
    }
    const ServoResult r = b.arm();
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(static_cast<double>((force_of(r) - Vec3(1, 0, 0)).norm()) < 0.01);
    CHECK(b.kept);
  }

  TEST_CASE("its owner is blocked for a second: the force ramps to zero and no stale one comes") {
    PressingBench b;
    give(b, 0);
    b.ticks(10);
    CHECK(height(lift(b, 0, 2e-5, 25)) > 1.4);
    std::vector<double> profile;
    ServoResult r;
    for (int k = 0; k < 1000; ++k) {
      r = b.tick();
      profile.push_back(height(r));
    }
    CHECK(r.faults == kFaultFrame);
    CHECK(r.arming == ArmingState::kFaulted);
    CHECK(profile[38] > 1.4);  // 50 ms after the last pose it is late
    std::size_t zero = 0;
    while (zero < profile.size() && profile[zero] > 0) ++zero;
    CHECK(zero > 40);
    CHECK(zero < 50);
    for (std::size_t k = zero; k < profile.size(); ++k) CHECK(profile[k] == 0);
    for (std::size_t k = 1; k < zero; ++k) CHECK(profile[k] <= profile[k - 1] + 1e-3);
    // It goes on somewhere else. No force by itself; after a new press it ramps in.
    r = lift(b, 0.0002, 2e-5, 20);
    CHECK(height(r) == 0);
    CHECK(r.faults == kFaultFrame);
    b.press(false);
    lift(b, 0.0006, 0, 2);
    b.press(true);
    r = lift(b, 0.0006, 0, 15);
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(r.faults == 0);
    CHECK(height(r) > 1.0);
    CHECK(b.kept);  // no step over the slew limit in all of it
  }

  TEST_CASE("too fast, not finite, back in time: ramps to zero, never a jump") {
    struct Fault {
      const char* what;
      std::function<void(FrameRecord&)> make;
    };
    const std::vector<Fault> faults = {
        {"20 mm up at once", [](FrameRecord& f) { f.p_m[2] += 0.02; }},
        {"20 mm down at once", [](FrameRecord& f) { f.p_m[2] -= 0.02; }},
        {"a turn by 0.5 rad",
         [](FrameRecord& f) {
           f.q_xyzw[0] = std::sin(0.25);
           f.q_xyzw[3] = std::cos(0.25);
         }},
        {"NaN", [](FrameRecord& f) { f.p_m[1] = std::numeric_limits<double>::quiet_NaN(); }},
        {"no unit quaternion", [](FrameRecord& f) { f.q_xyzw[3] = 2; }},
        {"an older stamp", [](FrameRecord& f) { f.stamp_ns -= 500 * kMs; }}};
    for (const Fault& fault : faults) {
      CAPTURE(fault.what);
      PressingBench b;
      give(b, 0);
      b.ticks(10);
      REQUIRE(height(lift(b, 0, 2e-5, 10)) > 1.1);
      give(b, 2.2e-4);
      fault.make(b.input.frame);
      ServoResult r = b.tick();
      CHECK((r.faults & kFaultFrame) != 0);
      r = b.ticks(20);
      CHECK(height(r) == 0);
      CHECK(torque_of(r) == Vec3::Zero());
      CHECK(b.kept);
      // Good poses again: armed by the next press, and the frame is there.
      b.input.frame = {};
      b.input.frame.number = 1000;
      give(b, 0);
      b.ticks(10);
      lift(b, 0, 0, 2);
      b.press(false);
      lift(b, 0, 0, 2);
      b.press(true);
      r = lift(b, 0, 0, 15);
      CHECK(r.arming == ArmingState::kArmed);
      CHECK(height(r) == doctest::Approx(1.0).epsilon(0.02));
      CHECK(b.kept);
    }
  }

  TEST_CASE("a moving frame costs no heap") {
    PressingBench b;
    give(b, 0);
    std::uint64_t calls = 1;
    {
      const RtGuard guard;
      lift(b, 0, 2e-5, 10);
      calls = guard.heap_calls();
    }
    CHECK(calls == 0);
    CHECK(b.servo.step(b.input).frame_wf.p_wa.z() > 0);
  }
}
