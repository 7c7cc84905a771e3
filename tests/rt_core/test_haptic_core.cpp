// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "tests/support/counter_bounds.hpp"
#include "tests/support/proxy_bench.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

tools::SceneDescription peg_scene() {
  return scene_of(box({-0.01, -0.01, -0.03}, {0.01, 0.01, 0.03}),
                  {join({box({-0.03, -0.03, -0.04}, {-0.0105, 0.03, 0}),
                         box({0.0105, -0.03, -0.04}, {0.03, 0.03, 0}),
                         box({-0.0105, -0.03, -0.04}, {0.0105, -0.0105, 0}),
                         box({-0.0105, 0.0105, -0.04}, {0.0105, 0.03, 0})})});
}

}  // namespace

TEST_SUITE("rt_core.haptic_core") {
  TEST_CASE("step: a pose that is no pose gives zero wrench and leaves the state alone") {
    LoadedScene scene(peg_scene()), twin(peg_scene());
    scene.step({0, 0, 0.029});
    twin.step({0, 0, 0.029});
    StepInput bad;
    bad.pose_wa.p_wa = Vec3(0, std::numeric_limits<Real>::quiet_NaN(), 0);
    StepResult r = scene.core->step(bad);
    CHECK(r.status == RtStatus::kPoseNotFinite);
    CHECK(r.flags == kFlagBadPose);
    CHECK(r.wrench_w.force_w == Vec3::Zero());
    bad = StepInput{};
    bad.pose_wa.q_wa = Quat(2, 0, 0, 0);
    CHECK(scene.core->step(bad).status == RtStatus::kPoseNotUnit);
    bad.pose_wa.q_wa = Quat(0, 0, 0, 0);
    CHECK(scene.core->step(bad).status == RtStatus::kPoseNotUnit);
    bad = StepInput{};
    bad.pose_wa.p_wa = Vec3(std::numeric_limits<Real>::infinity(), 0, 0);
    CHECK(scene.core->step(bad).status == RtStatus::kPoseNotFinite);
    bad = StepInput{};  // finite, but its square is not
    bad.pose_wa.p_wa = Vec3(0, 0, HAPTIC_REAL_IS_FLOAT ? 1.0e30_r : 1.0e200_r);
    CHECK(scene.core->step(bad).status == RtStatus::kPoseNotFinite);
    CHECK(scene.step({0, 0, 0.0295}).state_hash == twin.step({0, 0, 0.0295}).state_hash);
  }

  TEST_CASE("step: same input, same bits; a second core in other memory agrees") {
    LoadedScene scene(peg_scene()), twin(peg_scene());
    Random random(3);
    for (int t = 0; t < 500; ++t) {
      const Point p = {random.uniform(-0.002, 0.002), random.uniform(-0.002, 0.002),
                       random.uniform(-0.01, 0.04)};
      const std::array<double, 4> q = {1, random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02),
                                       0};
      std::array<double, 4> unit = q;
      const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
      for (double& x : unit) x /= n;
      CHECK(scene.step(p, unit).state_hash == twin.step(p, unit).state_hash);
    }
  }

  TEST_CASE("step: no heap call, and the guard would see one") {
    LoadedScene scene(peg_scene());
    [[maybe_unused]] std::uint64_t seen = 0;  // with sanitizers
    std::uint64_t in_steps = 0;
    {
      RtGuard guard;
      for (int t = 0; t < 200; ++t) scene.step({0.0002 * t, 0, 0.03 - 0.0001 * t});
      in_steps = guard.heap_calls();
    }
    {
      RtGuard guard;
      std::vector<int> probe(100);
      probe[0] = 1;
      seen = guard.heap_calls() + static_cast<std::uint64_t>(probe[1]);
    }
    CHECK(in_steps == 0);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    CHECK(seen > 0);
#endif
  }

  TEST_CASE("step: counters stay within the header's bounds") {
    LoadedScene scene(peg_scene());
    const SceneCapacity& bound = scene.view.header().capacity;
    Random random(9);
    for (int t = 0; t < 2000; ++t) {
      const StepResult r = scene.step(
          {random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05)},
          random.rotation());
      CHECK(over_bound(r.counters, bound) == "");
      CHECK(scene.core->peaks().edge_pairs >= r.counters.edge_pairs);
    }
  }

  TEST_CASE(
      "a far pair is not looked at: the bound is below the distance and says that it is one") {
    tools::SceneDescription d = scene_of(box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}),
                                         {box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05})});
    d.parameters.exact_band_m = 0.005;
    LoadedScene scene(d);
    static_cast<void>(scene.step({0, 0, 0.062}));  // 2 mm above: looked at
    CHECK(scene.core->pair_report(0).exact);
    int far = 0;
    for (int t = 0; t < 3000; ++t) {
      const double height = 0.062 + 0.03 * (1 - std::cos(t * 2e-3));
      const StepResult r = scene.step({0.01 * std::sin(t * 1e-3), 0, height});
      const double distance = height - 0.06;
      const PairReport report = scene.core->pair_report(0);
      CHECK(static_cast<double>(r.d_near_m) <= distance + 1e-7);
      if ((r.flags & kFlagFarBand) != 0) {
        ++far;
        CHECK(distance > 0.005);
        CHECK(!report.visited);
        CHECK(report.verdict == Verdict::kSeparated);
        CHECK(r.counters.pair_visits == 0);
      } else {
        CHECK(std::abs(static_cast<double>(r.d_near_m) - distance) < 1e-7);
      }
    }
    CHECK(far > 2000);
  }

  TEST_CASE("a budget of pairs goes to the nearest; the others keep their last plane, flagged") {
    std::vector<tools::Body> posts;
    for (int k = 0; k < 6; ++k) {
      const double x = 0.02 * k;
      posts.push_back(box({x, -0.01, -0.02}, {x + 0.01, 0.01, -0.0004 * k}));
    }
    const tools::Body bar = box({-0.01, -0.005, -0.005}, {0.13, 0.005, 0.005});
    tools::SceneDescription d = scene_of(bar, {join(posts)});
    d.parameters.exact_band_m = 0.005;
    LoadedScene free(d);
    d.max_pair_visits = 2;
    LoadedScene tight(d);
    CHECK(tight.view.header().capacity.unproven == kUnprovenPairVisits);
    CHECK(free.view.header().capacity.unproven == 0);
    double last = 0;
    int used_up = 0;
    for (int t = 0; t < 400; ++t) {
      const Point p = {0, 0, 0.006 - 0.0015 * (t < 200 ? t : 400 - t) / 200.0};
      const StepResult all = free.step(p), some = tight.step(p);
      CHECK(some.counters.pair_visits <= 2);
      CHECK(all.counters.pair_visits <= 6);
      used_up += (some.flags & kFlagBudgetUsedUp) != 0 ? 1 : 0;
      CHECK((all.flags & kFlagBudgetUsedUp) == 0);
      // The nearest pair is among the visited: the depth is exact, and the force follows it.
      if (t > 10) CHECK(std::abs(static_cast<double>(some.d_near_m - all.d_near_m)) < 1e-6);
      const double force = static_cast<double>(some.wrench_w.force_w.norm());
      if (t > 10) CHECK(std::abs(force - last) < 0.05);
      last = force;
    }
    CHECK(used_up > 300);
  }

  TEST_CASE("motion beyond the speed certificate is flagged, within it is not") {
    tools::SceneDescription d = peg_scene();
    d.parameters.motion_limits_given = 1;
    d.parameters.max_linear_speed_m_per_s = 0.5;
    d.parameters.max_angular_speed_rad_per_s = 4;
    LoadedScene scene(d);
    const auto flagged = [&](const Point& p, double angle) {
      const StepResult r = scene.step(p, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)});
      return (r.flags & kFlagMotionExceeded) != 0;
    };
    CHECK_FALSE(flagged({0, 0, 0.1}, 0));
    CHECK_FALSE(flagged({0.00049, 0, 0.1}, 0.0039));
    CHECK(flagged({0.00101, 0, 0.1}, 0.0039));
    CHECK(flagged({0.00101, 0, 0.1}, 0.0085));
    CHECK_FALSE(flagged({0.00101, 0, 0.1}, 0.0085));
  }

  TEST_CASE("a jump is answered exactly and named") {
    LoadedScene scene(peg_scene()), fresh(peg_scene());
    Random random(10);
    int named = 0;
    for (int t = 0; t < 300; ++t) {
      const Point p = {random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02),
                       random.uniform(-0.02, 0.02)};
      const std::array<double, 4> q = random.rotation();
      fresh.core->reset();
      const StepResult r = scene.step(p, q), truth = fresh.step(p, q);
      CHECK(std::abs(static_cast<double>(r.d_near_m - truth.d_near_m)) <
            (HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-15));
      CHECK((r.wrench_w.force_w - truth.wrench_w.force_w).norm() < 1e-4_r);
      named += (r.flags & kFlagRelocalised) != 0 ? 1 : 0;
      CHECK((r.flags & kFlagFirstTick) == (t == 0 ? kFlagFirstTick : 0u));
    }
    CHECK(named > 0);
  }

  TEST_CASE("the label does not chatter under tremor, the depth follows it") {
    LoadedScene scene(scene_of(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                               {box({-0.02, -0.2, -0.2}, {0.2, 0.01, 0})}));
    Random random(11);
    int changes = 0;
    ContactSituation last = ContactSituation::kNone;
    double least = 0, most = -1;
    // The tilt that raises one side by epsilon, where the label's own tolerance ends, and tremor of
    // a tenth of it.
    for (int t = 0; t < 2000; ++t) {
      const double tilt = 1e-4 / 0.07 * (1 + random.uniform(-0.1, 0.1));
      const StepResult r =
          scene.step({0, 0, 0.048}, {std::cos(tilt / 2), 0, std::sin(tilt / 2), 0});
      changes += t > 0 && r.situation != last ? 1 : 0;
      last = r.situation;
      least = std::min(least, static_cast<double>(r.d_near_m));
      most = std::max(most, static_cast<double>(r.d_near_m));
    }
    CHECK(changes <= 1);
    CHECK(most - least > 1e-6);
  }

  TEST_CASE("create: memory that does not fit is refused") {
    LoadedScene scene(peg_scene());
    const std::size_t needed = HapticCore::state_bytes(scene.view);
    CHECK(needed == scene.view.header().capacity.state_bytes);
    std::vector<std::byte> memory(needed + 128);
    const std::size_t shift = 64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64;
    HapticCore* core = nullptr;
    CHECK(HapticCore::create({memory.data() + shift, needed - 1}, scene.view, core) ==
          RtStatus::kMemoryTooSmall);
    CHECK(HapticCore::create({memory.data() + shift + 8, needed}, scene.view, core) ==
          RtStatus::kMemoryMisaligned);
    CHECK(core == nullptr);
    CHECK(HapticCore::create({memory.data() + shift, needed}, scene.view, core) == RtStatus::kOk);
  }

  TEST_CASE("coplanar contacts of one body count once, those of two bodies twice") {
    const tools::Body part = box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05});
    const tools::Body left = box({-0.2, -0.2, -0.2}, {0.01, 0.2, 0}),
                      right = box({0.01, -0.2, -0.2}, {0.2, 0.2, 0});
    LoadedScene one(scene_of(part, {join({left, right})})), two(scene_of(part, {left, right}));
    const StepResult once = one.step({0, 0, 0.049});
    const StepResult twice = two.step({0, 0, 0.049});
    CHECK(std::abs(static_cast<double>(once.wrench_w.force_w[2]) - 1.0) < 1e-3);
    CHECK(std::abs(static_cast<double>(twice.wrench_w.force_w[2]) - 2.0) < 1e-3);
    CHECK(once.wrench_w.torque_w.norm() < 1e-6_r);  // pi lies in the united region
  }

  TEST_CASE("the grip point is the torque reference") {
    tools::SceneDescription d = scene_of(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                                         {box({0.03, -0.2, -0.2}, {0.2, 0.2, 0})});
    d.grip_m = {0.04, 0, 0};
    LoadedScene scene(d);
    const StepResult r = scene.step({0, 0, 0.049});  // pi(x0) = (0.04, 0) lies in H
    CHECK(r.wrench_w.torque_w.norm() < 1e-6_r);
    CHECK(std::abs(static_cast<double>(r.wrench_w.force_w[2]) - 1.0) < 1e-3);
  }

  TEST_CASE("spring_w: the proxy's pull without its damping, and the whole wrench of other laws") {
    tools::SceneDescription d = proxy_scene_of(box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}),
                                               {box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0})});
    d.parameters.coupling.damping_ns_per_m = 2;
    LoadedScene proxy(d);
    const auto norm = [](const Vec3& v) { return static_cast<double>(v.norm()); };
    StepInput input;
    double damped_n = 0;
    for (int t = 0; t < 400; ++t) {  // presses, holds with the clutch, lets go
      input.stamp_ns = 1'000'000 * (t + 1);
      input.clutched = t > 200 && t < 300;
      input.pose_wa.p_wa.z() = static_cast<Real>(0.0095 + 0.001 * std::cos(0.05 * t));
      const StepResult r = proxy.core->step(input);
      CAPTURE(t);
      if ((r.flags & kFlagRamping) == 0) {
        const Vec3 pull = -1000.0_r * (r.goal_pose_wa.p_wa - r.proxy_pose_wa.p_wa);
        CHECK(norm(r.spring_w.force_w - pull) <= (HAPTIC_REAL_IS_FLOAT ? 1.0e-4 : 1.0e-9));
        damped_n = std::max(damped_n, norm(r.wrench_w.force_w - r.spring_w.force_w));
      } else if (input.clutched) {  // held: nothing in it answers to a velocity
        CHECK(r.spring_w.force_w == r.wrench_w.force_w);
        CHECK(r.spring_w.torque_w == r.wrench_w.torque_w);
      } else {
        CHECK(norm(r.spring_w.force_w) <= norm(r.wrench_w.force_w) * 2.001 + 1.0e-6);
      }
    }
    CHECK(damped_n > 0.02);  // 2 N s/m at up to 0.05 m/s
    d.parameters.law = LawId::kPaper;
    d.parameters.coupling.damping_ns_per_m = 0;
    LoadedScene other(d);
    for (int t = 0; t < 20; ++t) {
      const StepResult r = other.step({0, 0, 0.0105 - 0.0001 * t});
      CHECK(r.spring_w.force_w == r.wrench_w.force_w);
      CHECK(r.spring_w.torque_w == r.wrench_w.torque_w);
      if (t > 8) CHECK(norm(r.spring_w.force_w) > 0.01);
    }
  }
}
