// SPDX-License-Identifier: Apache-2.0
// The proxy: coupling, contact and release, recovery, anchor, clutch, reset and the cut of its
// passes. Parts of 2 to 6 cm, k_t = 1000 N/m.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "rt_core/base/rotation.hpp"
#include "rt_core/law/coupling.hpp"
#include "tests/support/proxy_bench.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr bool kSingle = HAPTIC_REAL_IS_FLOAT;
using Wxyz = std::array<double, 4>;

double length_of(const Vec3& v) { return static_cast<double>(std::sqrt(v.squaredNorm())); }

Wxyz turn(double x, double y, double z) {
  const double angle = std::sqrt(x * x + y * y + z * z);
  const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), s * x, s * y, s * z};
}

Vec3 vector_of(Random& random, double length) {
  for (;;) {
    const Vec3 v(static_cast<Real>(random.uniform(-1, 1)), static_cast<Real>(random.uniform(-1, 1)),
                 static_cast<Real>(random.uniform(-1, 1)));
    const Real n = std::sqrt(v.squaredNorm());
    if (n < 1 && n > 0.1_r) return v * (static_cast<Real>(length) / n);
  }
}

tools::Body part() { return box({-0.02, -0.015, -0.01}, {0.02, 0.015, 0.01}); }
tools::Body block() { return box({-0.06, -0.05, -0.04}, {0.06, 0.05, 0.04}); }
tools::Body pin() {  // apex down, 30 mm below the grip point
  return tetrahedron({0.02, 0, 0.03}, {-0.01, 0.017, 0.03}, {-0.01, -0.017, 0.03}, {0, 0, -0.03});
}

/// Depth that counts as free in these scenes, with its rounding [m].
double depth_of(const ProxyBench& bench) {
  return (kSingle ? 4.0 : 1.01) * static_cast<double>(bench.parameters.scale.tolerance_m);
}

StepResult step(HapticCore& core, const Point& p, const Wxyz& q, bool clutched = false) {
  StepInput input;
  const GripPose grip = grip_pose(p, q);
  input.pose_wa = {grip.x0_w, grip.q_wa};
  input.clutched = clutched;
  return core.step(input);
}

}  // namespace

TEST_SUITE("rt_core.coupling") {
  TEST_CASE("the wrench is the energy's slope in the goal, in translation and rotation") {
    if (kSingle) return;  // differences of squares need the digits
    Random random(1);
    const Spring spring{1000, 0.7_r, std::sqrt(0.7_r / 1000)};
    for (int k = 0; k < 2000; ++k) {
      GripPose proxy = moved(GripPose{}, vector_of(random, 0.1), vector_of(random, 2));
      const GripPose goal = moved(proxy, vector_of(random, random.uniform(0, 0.05)),
                                  vector_of(random, random.uniform(0.001, 3.0)));
      const Wrench wrench = spring_wrench(spring, pose_error(goal, proxy));
      const auto slope = [&](const Vec3& dx, const Vec3& dtheta) {
        const auto at = [&](Real s) {
          return potential_j(spring, pose_error(moved(goal, s * dx, s * dtheta), proxy));
        };
        constexpr Real h = 1.0e-5_r;
        return static_cast<double>((at(h) - at(-h)) / (2 * h));
      };
      for (int i = 0; i < 3; ++i) {
        const Vec3 e = Vec3::Unit(i);
        CHECK(slope(e, Vec3::Zero()) ==
              doctest::Approx(-static_cast<double>(wrench.force_w[i])).epsilon(1e-6));
        CHECK(std::abs(slope(Vec3::Zero(), e) + static_cast<double>(wrench.torque_w[i])) < 1e-7);
      }
    }
  }

  TEST_CASE("the error of a rotation is its vector from 1e-12 rad to a hair below pi") {
    Random random(2);
    for (const double angle :
         {1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.0, 3.14, 3.14159, std::numbers::pi - 1e-6}) {
      for (int k = 0; k < 200; ++k) {
        const GripPose proxy = moved(GripPose{}, Vec3::Zero(), vector_of(random, 1.5));
        const Vec3 way = vector_of(random, angle);
        const PoseError error = pose_error(moved(proxy, Vec3::Zero(), way), proxy);
        CHECK(length_of(error.rotation_rad - way) < (kSingle ? 4e-6 : 4e-15));
        CHECK(length_of(error.translation_m) == 0);
      }
    }
    const GripPose half = moved(GripPose{}, Vec3::Zero(), Vec3(0, std::numbers::pi_v<Real>, 0));
    CHECK(length_of(pose_error(half, GripPose{}).rotation_rad) ==
          doctest::Approx(std::numbers::pi).epsilon(1e-6));
  }

  TEST_CASE("limited: the wrench stops growing and is the energy's slope all the same") {
    Random random(3);
    Spring spring{1000, 0.7_r, std::sqrt(0.7_r / 1000)};
    spring.soft_translation_m = 0.012_r;
    spring.soft_rotation_rad = 0.4_r;
    for (int k = 0; k < 2000; ++k) {
      const GripPose proxy = moved(GripPose{}, vector_of(random, 0.1), vector_of(random, 2));
      const double far = random.uniform(0, 0.05), angle = random.uniform(0.001, 2.8);
      const GripPose goal = moved(proxy, vector_of(random, far), vector_of(random, angle));
      const PoseError error = pose_error(goal, proxy);
      const Wrench wrench = spring_wrench(spring, error);
      const double close = kSingle ? 2e-5 : 1e-12;
      CHECK(length_of(wrench.force_w) ==
            doctest::Approx(1000 * std::min(far, 0.012)).epsilon(close));
      CHECK(length_of(wrench.torque_w) ==
            doctest::Approx(0.7 * std::min(angle, 0.4)).epsilon(close));
      CHECK(length_of(wrench.force_w.cross(error.translation_m)) < 1e-6);
      CHECK(is_saturated(spring, error) == (far > 0.012 || angle > 0.4));
      if (kSingle) continue;  // differences of squares need the digits
      const auto slope = [&](const Vec3& dx, const Vec3& dtheta) {
        const auto at = [&](Real s) {
          return potential_j(spring, pose_error(moved(goal, s * dx, s * dtheta), proxy));
        };
        constexpr Real h = 1.0e-6_r;
        return static_cast<double>((at(h) - at(-h)) / (2 * h));
      };
      for (int i = 0; i < 3; ++i) {
        const Vec3 e = Vec3::Unit(i);
        CHECK(std::abs(slope(e, Vec3::Zero()) + static_cast<double>(wrench.force_w[i])) < 1e-3);
        CHECK(std::abs(slope(Vec3::Zero(), e) + static_cast<double>(wrench.torque_w[i])) < 1e-6);
      }
    }
  }

  TEST_CASE("secant: the same wrench, and to no error does V rise more than its energy") {
    Random random(4);
    Spring spring{800, 0.5_r, std::sqrt(0.5_r / 800)};
    spring.soft_translation_m = 0.01_r;
    spring.soft_rotation_rad = 0.3_r;
    int softened = 0;
    for (int k = 0; k < 4000; ++k) {
      const PoseError here{vector_of(random, random.uniform(0, 0.05)),
                           vector_of(random, random.uniform(0, 2.8))};
      const PoseError there{vector_of(random, random.uniform(0, 0.05)),
                            vector_of(random, random.uniform(0, 2.8))};
      const Spring secant = secant_spring(spring, here);
      softened += secant.k_t_n_per_m < spring.k_t_n_per_m ? 1 : 0;
      const Wrench a = spring_wrench(spring, here), b = spring_wrench(secant, here);
      CHECK(length_of(a.force_w - b.force_w) < (kSingle ? 1e-4 : 1e-12));
      CHECK(length_of(a.torque_w - b.torque_w) < (kSingle ? 1e-5 : 1e-13));
      CHECK(static_cast<double>(secant.length_m) ==
            doctest::Approx(std::sqrt(static_cast<double>(secant.k_r_nm_per_rad) /
                                      static_cast<double>(secant.k_t_n_per_m)))
                .epsilon(1e-6));
      CHECK(potential_j(spring, there) - potential_j(spring, here) <=
            potential_j(secant, there) - potential_j(secant, here) + (kSingle ? 1e-5_r : 1e-14_r));
    }
    CHECK(softened > 1000);
  }

  TEST_CASE("limit_turn: back to the limit about the same axis, and nothing within it") {
    Random random(5);
    for (int k = 0; k < 2000; ++k) {
      const GripPose proxy = moved(GripPose{}, vector_of(random, 0.2), vector_of(random, 2));
      const double angle = random.uniform(0.01, 3.0);
      const Vec3 dx = vector_of(random, 0.05), dtheta = vector_of(random, angle);
      const GripPose asked = moved(proxy, dx, dtheta);
      GripPose goal = asked;
      CHECK(limit_turn(0.8_r, proxy, goal) == (angle > 0.8));
      CHECK(goal.x0_w == asked.x0_w);
      if (angle <= 0.8) CHECK(goal.q_wa.coeffs() == asked.q_wa.coeffs());
      const Vec3 turned = pose_error(goal, proxy).rotation_rad;
      CHECK(length_of(turned - dtheta * static_cast<Real>(std::min(1.0, 0.8 / angle))) <
            (kSingle ? 2e-5 : 1e-13));
    }
  }
}

TEST_SUITE("rt_core.proxy_law") {
  TEST_CASE("pressed flat on a block: the proxy stays on it and the force is k_t times the depth") {
    ProxyBench bench(proxy_scene_of(part(), {block()}));
    for (int k = 0; k <= 130; ++k) static_cast<void>(bench.tick({0.01, 0, 0.06 - k * 1e-4}));
    const ProxyTick last = bench.tick({0.01, 0, 0.047});
    const Wrench wrench = spring_wrench(bench.parameters.spring, last.error);
    CHECK(length_of(wrench.force_w - Vec3(0, 0, 3)) < (kSingle ? 1e-2 : 1e-4));
    CHECK(length_of(wrench.torque_w) < (kSingle ? 1e-3 : 1e-9));
    CHECK(static_cast<double>(last.gap_m) >= -depth_of(bench));
  }

  TEST_CASE("slid off a block, by a face, an edge or a corner: nothing holds beyond the rim") {
    struct Case {
      tools::Body body;
      Wxyz q;
      double height_m, reach_m;  // of the grip point over the block, and past the rim
    };
    const double down = std::sqrt(0.02 * 0.02 + 0.01 * 0.01);
    const std::vector<Case> cases = {{part(), {1, 0, 0, 0}, 0.01, 0.02},
                                     {part(), turn(0, std::atan2(0.02, 0.01), 0), down, down},
                                     {part(), turn(0.3, 0.4, 0.2), 0.02, 0.03},
                                     {pin(), {1, 0, 0, 0}, 0.03, 0.02}};
    for (const Case& c : cases) {
      for (const double stride : {2e-4, 1e-3}) {
        ProxyBench bench(proxy_scene_of(c.body, {block()}));
        double z = 0.04 + c.height_m + 0.01;
        for (; z > 0.04 + c.height_m - 0.003; z -= 1e-4) {
          static_cast<void>(bench.tick({0.01, 0, z}, c.q));
        }
        bool pressed = false;
        for (double x = 0.01; x < 0.06 + c.reach_m + 0.02; x += stride) {
          const ProxyTick tick = bench.tick({x, 0, z}, c.q);
          if (x < 0.05) pressed = pressed || tick.end_potential_j > 1.0e-5_r;
          const Real distance = bench.distance_m(bench.proxy.pose());
          CHECK(static_cast<double>(distance) >= -depth_of(bench));
          if (x > 0.06 + c.reach_m + 0.01) {
            CHECK(static_cast<double>(tick.end_potential_j) < 1e-8);
          }
        }
        CHECK(pressed);
      }
    }
  }

  TEST_CASE("after each of one, two or three passes the proxy is free, under any goal") {
    constexpr std::uint64_t kSeed = 21;
    INFO("seed " << kSeed);
    for (std::uint32_t passes = 1; passes <= kDefaultProxyPasses; ++passes) {
      for (const double friction : {0.0, 0.3}) {
        ProxyBench bench(proxy_scene_of(part(), {block()}, friction), passes);
        Random random(kSeed);
        Point p{0, 0, 0.06};
        Wxyz q{1, 0, 0, 0};
        double worst = 0;
        int held = 0;
        for (int k = 0; k < 1500; ++k) {
          if (k % 50 == 0) {
            p = {random.uniform(-0.08, 0.08), random.uniform(-0.07, 0.07),
                 random.uniform(-0.06, 0.07)};
            q = random.rotation();
            if (k == 0) p = {0, 0, 0.09};
          }
          const ProxyTick tick = bench.tick(p, q);
          CHECK(tick.work.passes <= passes);
          CHECK_FALSE(tick.recovering);
          CHECK(tick.end_potential_j <= tick.start_potential_j);
          held += tick.end_potential_j > 1.0e-6_r ? 1 : 0;
          worst = std::min(worst, static_cast<double>(bench.distance_m(bench.proxy.pose())));
        }
        CHECK(held > 300);
        CHECK(worst >= -depth_of(bench));
      }
    }
  }

  TEST_CASE("passes cut one by one lead to the same bits as a tick of three") {
    ProxyBench whole(proxy_scene_of(part(), {block()})), cut(proxy_scene_of(part(), {block()}), 1);
    Random random(22);
    static_cast<void>(whole.tick({0, 0, 0.07}));
    static_cast<void>(cut.tick({0, 0, 0.07}));
    for (int k = 0; k < 4000; ++k) {
      const GripPose goal =
          grip_pose({0.03 * std::sin(0.002 * k), 0.01, 0.055 - 0.02 * std::sin(0.001 * k)},
                    turn(0.3 * std::sin(0.003 * k), 0.2 * std::cos(0.002 * k) - 0.2, 0));
      const ProxyTick tick = whole.tick(goal);
      for (std::uint32_t pass = 0; pass < tick.work.passes; ++pass)
        static_cast<void>(cut.tick(goal));
      const GripPose &one = whole.proxy.pose(), &other = cut.proxy.pose();
      if (kSingle) {
        // Rounding of places leaves gaps a share of the tolerance deep, which a pass closes by what
        // those before it in its tick have gained: a pass that is a tick closes none.
        const double tolerance_m = static_cast<double>(whole.parameters.scale.tolerance_m);
        REQUIRE(length_of(one.x0_w - other.x0_w) <= tolerance_m);
        REQUIRE(static_cast<double>(one.q_wa.angularDistance(other.q_wa)) <=
                tolerance_m / static_cast<double>(whole.parameters.radius_m));
        continue;
      }
      REQUIRE(one.x0_w == other.x0_w);
      REQUIRE(one.q_wa.coeffs() == other.q_wa.coeffs());
    }
  }

  TEST_CASE("started inside: no wrench until it is out, out within few ticks, then ramped in") {
    for (const double depth : {0.0005, 0.0027, 0.0037}) {
      LoadedScene scene(proxy_scene_of(part(), {block()}));
      const Point p{0.005, 0.004, 0.05 - depth};
      StepResult result = step(*scene.core, p, turn(0.05, 0.02, 0));
      CHECK((result.flags & kFlagRecovery) != 0);
      CHECK(result.wrench_w.force_w == Vec3::Zero());
      int ticks = 1;
      double force = 0, largest_step = 0;
      while ((result.flags & kFlagRecovery) != 0 && ticks < 200) {
        result = step(*scene.core, p, turn(0.05, 0.02, 0));
        ++ticks;
        CHECK(length_of(result.wrench_w.force_w) < 0.5);
      }
      CHECK(ticks <= 40);
      for (int k = 0; k < 400; ++k) {
        result = step(*scene.core, p, turn(0.05, 0.02, 0));
        CHECK((result.flags & kFlagRecovery) == 0);
        const double now = length_of(result.wrench_w.force_w);
        largest_step = std::max(largest_step, std::abs(now - force));
        force = now;
      }
      CHECK(result.proxy_gap_m >= -2.0e-7_r * (kSingle ? 100 : 1));
      CHECK(force > 1000 * depth * 0.2);
      CHECK(largest_step < 0.2 * force);  // it came in over many ticks
      MESSAGE(depth << " m deep: free after " << ticks << " ticks, then " << force << " N");
    }
  }

  TEST_CASE("limits: a press of 12 N over 40 mm forgives; back at the start the part is in hand") {
    tools::SceneDescription description = proxy_scene_of(part(), {block()});
    description.parameters.coupling.max_translation_error_m = 0.012;
    LoadedScene scene(description);
    StepResult result;
    double most = 0;
    int limited = 0;
    const auto at = [&](int k) {
      result = step(*scene.core, {0, 0, 0.06 - k * 1e-4}, {1, 0, 0, 0});
      most = std::max(most, length_of(result.wrench_w.force_w));
      limited += (result.flags & kFlagSaturated) != 0 ? 1 : 0;
      CHECK(length_of(result.goal_pose_wa.p_wa - Vec3(0, 0, Real(0.06 - k * 1e-4))) < 1e-6);
    };
    double in_n = 0;
    for (int k = 0; k <= 500; ++k) {  // 40 mm into the face
      at(k);
      if (k == 160) in_n = length_of(result.wrench_w.force_w);
    }
    CHECK(limited > 250);
    CHECK(most == doctest::Approx(12.0).epsilon(1e-5));
    for (int k = 500; k >= 0; --k) {
      at(k);
      if (k == 160)
        CHECK(length_of(result.wrench_w.force_w) == doctest::Approx(in_n).epsilon(1e-5));
    }
    CHECK(length_of(result.wrench_w.force_w) < 1e-9);
    CHECK(length_of(result.proxy_pose_wa.p_wa - Vec3(0, 0, 0.06_r)) < 1e-6);
  }

  TEST_CASE("limits: a torque stays at its own, and turned back it is the same on the way") {
    tools::SceneDescription description = proxy_scene_of(part(), {block()});
    description.parameters.coupling.max_rotation_error_rad = 0.3;
    description.parameters.coupling.k_r_nm_per_rad = 1.6;
    LoadedScene scene(description);
    static_cast<void>(step(*scene.core, {0, 0, 0.0501}, {1, 0, 0, 0}));
    const double k_r = scene.view.parameters().coupling.k_r_nm_per_rad;
    double torque = 0;
    StepResult result;
    for (int k = 0; k <= 1500; ++k) {  // rolls on, pressed on the face
      result = step(*scene.core, {0, 0, 0.045}, turn(0, k * 2e-3, 0));
      torque = std::max(torque, length_of(result.wrench_w.torque_w));
    }
    CHECK(torque <= k_r * 0.3 * 1.0001);
    CHECK(torque > k_r * 0.08);
  }

  TEST_CASE("anchor: a held part follows no full turn; in free space it turns back, unfelt") {
    // Between two blocks 0.2 mm wider than the part, so that it cannot turn about x or y.
    tools::SceneDescription description =
        proxy_scene_of(part(), {box({-0.06, -0.05, -0.04}, {0.06, 0.05, -0.0101}),
                                box({-0.06, -0.05, 0.0101}, {0.06, 0.05, 0.04})});
    description.parameters.coupling.max_rotation_error_rad = 0.3;
    LoadedScene scene(description);
    const double k_r = scene.view.parameters().coupling.k_r_nm_per_rad;
    StepResult result;
    const double all = 2 * std::numbers::pi;
    double torque = 0;
    bool stayed = true;
    for (int k = 0; k <= 3000; ++k) {
      result = step(*scene.core, {0, 0, 0}, turn(0, all * k / 3000, 0));
      torque = std::max(torque, length_of(result.wrench_w.torque_w));
      stayed = stayed && std::abs(result.proxy_pose_wa.q_wa.w()) > 0.99_r;
    }
    CHECK(stayed);
    CHECK(torque == doctest::Approx(k_r * 0.3).epsilon(1e-4));
    CHECK(length_of(result.wrench_w.torque_w) > 0.2 * k_r);  // still wound up
    for (int k = 0; k <= 4000; ++k) {                        // out along x, turning nothing
      result = step(*scene.core, {k * 2e-4, 0, 0}, {1, 0, 0, 0});
    }
    double felt = 0;
    for (int k = 0; k <= 9000; ++k) {
      result = step(*scene.core, {0.8, 0, 0}, {1, 0, 0, 0});
      if (k > 20) felt = std::max(felt, length_of(result.wrench_w.torque_w) / k_r);
    }
    CHECK(felt < (kSingle ? 1e-4 : 1e-9));
    // In single precision within a few roundings of the largest w there is.
    CHECK(std::abs(result.proxy_pose_wa.q_wa.w()) > 1 - (kSingle ? 4 * kRealEpsilon : 1e-9_r));
    CHECK(length_of(result.goal_pose_wa.p_wa - Vec3(0.8_r, 0, 0)) < 1e-6);
  }

  TEST_CASE("clutch: the goal is frozen, and goes on from where it was") {
    LoadedScene scene(proxy_scene_of(part(), {block()}));
    StepResult before;
    for (int k = 0; k <= 120; ++k) {
      before = step(*scene.core, {0, 0, 0.06 - k * 1e-4}, turn(0, 0.05, 0.1));
    }
    CHECK(length_of(before.wrench_w.force_w) > 0.5);
    StepResult held = step(*scene.core, {0, 0, 0.048}, turn(0, 0.05, 0.1), true);
    const Pose frozen = held.goal_pose_wa;
    for (int k = 0; k <= 300; ++k) {
      held = step(*scene.core, {k * 3e-4, k * -2e-4, 0.048 + k * 1e-4}, turn(0.002 * k, 0.05, 0.1),
                  true);
      REQUIRE((held.flags & kFlagClutched) != 0);
      REQUIRE(held.goal_pose_wa.p_wa == frozen.p_wa);
      REQUIRE(held.goal_pose_wa.q_wa.coeffs() == frozen.q_wa.coeffs());
    }
    CHECK(length_of(held.wrench_w.force_w) < 1e-6);  // ramped out
    const Point where{0.09, -0.06, 0.078};
    const Wxyz turned = turn(0.6, 0.05, 0.1);
    const StepResult released = step(*scene.core, where, turned);
    const double close = kSingle ? 1e-6 : 1e-12;
    CHECK(length_of(released.goal_pose_wa.p_wa - frozen.p_wa) < close);
    CHECK(length_of(released.proxy_pose_wa.p_wa - held.proxy_pose_wa.p_wa) <
          (kSingle ? 1e-5 : 1e-8));
    CHECK(length_of(released.wrench_w.force_w) < 0.2 * length_of(before.wrench_w.force_w));
    StepResult later = released;
    for (int k = 0; k < 500; ++k) later = step(*scene.core, where, turned);
    CHECK(length_of(later.wrench_w.force_w - before.wrench_w.force_w) <
          0.01 * length_of(before.wrench_w.force_w) + (kSingle ? 1e-2 : 0));
    // From here a move of the device is a move of the goal.
    const StepResult moved_on = step(*scene.core, {0.0901, -0.06, 0.078}, turned);
    CHECK(length_of(moved_on.goal_pose_wa.p_wa - frozen.p_wa - Vec3(1.0e-4_r, 0, 0)) < 10 * close);
  }

  TEST_CASE("same input, same bits: twice, in other memory, and after a reset") {
    LoadedScene one(proxy_scene_of(part(), {block()}, 0.3)),
        two(proxy_scene_of(part(), {block()}, 0.3));
    const auto pose_at_tick = [](int k) {
      return std::pair<Point, Wxyz>{{0.03 * std::sin(0.011 * k), 0.02 * std::sin(0.007 * k),
                                     0.056 + 0.012 * std::cos(0.013 * k)},
                                    turn(0.4 * std::sin(0.01 * k), 0.3 * std::sin(0.017 * k), 0)};
    };
    std::vector<StepResult> first;
    for (int k = 0; k < 600; ++k) {
      const auto [p, q] = pose_at_tick(k);
      first.push_back(step(*one.core, p, q));
      const StepResult other = step(*two.core, p, q);
      REQUIRE(other.state_hash == first.back().state_hash);
      REQUIRE(other.proxy_pose_wa.p_wa == first.back().proxy_pose_wa.p_wa);
    }
    one.core->reset();
    for (int k = 0; k < 600; ++k) {
      const auto [p, q] = pose_at_tick(k);
      const StepResult again = step(*one.core, p, q);
      const StepResult& then = first[static_cast<std::size_t>(k)];
      REQUIRE(again.proxy_pose_wa.p_wa == then.proxy_pose_wa.p_wa);
      REQUIRE(again.proxy_pose_wa.q_wa.coeffs() == then.proxy_pose_wa.q_wa.coeffs());
      REQUIRE(again.wrench_w.force_w == then.wrench_w.force_w);
      REQUIRE(again.wrench_w.torque_w == then.wrench_w.torque_w);
    }
  }

  TEST_CASE("contact is that of the felt part: on the block, not as deep as the goal") {
    LoadedScene scene(proxy_scene_of(part(), {block()}));
    std::vector<Vec3> corners(64);
    std::vector<ContactId> ids(64);
    ContactGeometry contact;
    contact.polygon_w = BoundedList<Vec3>(corners);
    contact.ids = BoundedList<ContactId>(ids);
    StepResult r;
    for (int k = 0; k < 40; ++k) r = step(*scene.core, {0, 0, 0.055 - 0.0002 * k}, {1, 0, 0, 0});
    CHECK_FALSE(r.has_goal_contact);
    CHECK(std::isnan(r.d_near_m));
    CHECK((r.flags & kGoalContactFlags) == 0);
    CHECK_FALSE(scene.core->pair_report(0).searched);
    CHECK(r.situation == ContactSituation::kFaceFace);
    CHECK(r.near_count == 4);
    const FeltContact& felt = scene.core->felt_contact();
    REQUIRE(felt.plane_count == 1);
    CHECK(felt.planes[0].pair == 0);
    CHECK(length_of(felt.planes[0].normal_w - Vec3(0, 0, 1)) < (kSingle ? 1e-6 : 1e-12));
    CHECK(std::abs(felt.planes[0].gap_m) < 1e-5_r);
    scene.core->contact_geometry(0, contact);
    CHECK(contact.situation == ContactSituation::kFaceFace);
    CHECK(contact.ids.size() == 4);
    REQUIRE(contact.polygon_w.size() == 4);
    for (const Vec3& corner : contact.polygon_w) {
      const Vec3 at = contact.x0_w + corner;
      CHECK(std::abs(at[2] - 0.04_r) < 1e-5_r);
      CHECK(std::abs(std::abs(at[0]) - 0.02_r) < 1e-5_r);
      CHECK(std::abs(std::abs(at[1]) - 0.015_r) < 1e-5_r);
    }
    r = step(*scene.core, {0, 0, 0.08}, {1, 0, 0, 0});
    for (int k = 0; k < 20; ++k) r = step(*scene.core, {0, 0, 0.08}, {1, 0, 0, 0});
    CHECK(r.situation == ContactSituation::kNone);
    CHECK(r.near_count == 0);
    CHECK(scene.core->felt_contact().plane_count == 0);
    scene.core->contact_geometry(0, contact);
    CHECK(contact.polygon_w.size() == 0);
  }

  TEST_CASE("held from two sides: several planes, and the geometry of each pair") {
    const tools::Body wall = box({0.06, -0.05, -0.04}, {0.08, 0.05, 0.12});
    LoadedScene scene(proxy_scene_of(part(), {block(), wall}));
    StepResult r;
    for (int k = 0; k < 60; ++k)
      r = step(*scene.core, {0.03 + 0.0003 * k, 0, 0.055 - 0.0002 * k}, {1, 0, 0, 0});
    CHECK(r.situation == ContactSituation::kSeveralPlanes);
    const FeltContact& felt = scene.core->felt_contact();
    REQUIRE(felt.plane_count == 2);
    CHECK(felt.planes[0].pair + felt.planes[1].pair == 1);
    CHECK(std::abs(felt.planes[0].normal_w.dot(felt.planes[1].normal_w)) < 1e-6_r);
    CHECK(felt.point_count == 8);
  }

  TEST_CASE("asking for the contact at the goal changes neither wrench, proxy nor hash") {
    LoadedScene one(proxy_scene_of(part(), {block()}, 0.3)),
        two(proxy_scene_of(part(), {block()}, 0.3));
    Random random(75);
    int asked = 0;
    for (int k = 0; k < 800; ++k) {
      const Point p = {0.03 * std::sin(0.011 * k), 0.02 * std::sin(0.007 * k),
                       0.056 + 0.012 * std::cos(0.013 * k)};
      const Wxyz q = turn(0.4 * std::sin(0.01 * k), 0.3 * std::sin(0.017 * k), 0);
      const StepResult plain = step(*one.core, p, q);
      StepInput input;
      const GripPose grip = grip_pose(p, q);
      input.pose_wa = {grip.x0_w, grip.q_wa};
      input.report_goal_contact = random.uniform(0, 1) < 0.4;  // now and then, or always
      const StepResult other = two.core->step(input);
      asked += input.report_goal_contact ? 1 : 0;
      REQUIRE(other.has_goal_contact == input.report_goal_contact);
      REQUIRE(other.wrench_w.force_w == plain.wrench_w.force_w);
      REQUIRE(other.wrench_w.torque_w == plain.wrench_w.torque_w);
      REQUIRE(other.proxy_pose_wa.p_wa == plain.proxy_pose_wa.p_wa);
      REQUIRE(other.situation == plain.situation);
      REQUIRE(other.state_hash == plain.state_hash);
      if (!input.report_goal_contact) continue;
      // What was asked now and then is what a core that is always asked finds.
      LoadedScene fresh(proxy_scene_of(part(), {block()}, 0.3));
      const StepResult found = fresh.core->step(input);
      REQUIRE(std::abs(found.d_near_m - other.d_near_m) < (kSingle ? 1e-6_r : 1e-12_r));
    }
    CHECK(asked > 100);
  }

  TEST_CASE("a floor of 144 pieces is one floor: more pairs than valid sets have room") {
    std::vector<tools::Body> tiles;
    constexpr int kSide = 12;
    constexpr double kTile_m = 0.0078125;  // a power of two: neighbours share their planes
    for (int i = 0; i < kSide; ++i) {
      for (int j = 0; j < kSide; ++j) {
        tiles.push_back(box({(i - 6) * kTile_m, (j - 6) * kTile_m, -0.01},
                            {(i - 5) * kTile_m, (j - 5) * kTile_m, 0}));
      }
    }
    const double half = 6 * kTile_m;
    const tools::Body plate = box({-0.04, -0.04, -0.005}, {0.04, 0.04, 0.005});
    ProxyBench tiled(proxy_scene_of(plate, {join(tiles)}));
    ProxyBench whole(proxy_scene_of(plate, {box({-half, -half, -0.01}, {half, half, 0})}));
    CHECK(tiled.scene.view.pair_count() == 144);
    double ripple = 0;
    for (int k = 0; k < 600; ++k) {
      const double s = 1e-3 * k;
      const Point p{0.004 * std::sin(7 * s), 0.003 * std::sin(11 * s),
                    0.005 + (k < 100 ? 0.003 - 6e-5 * k : -0.003)};
      const Wxyz q = turn(0.02 * std::sin(9 * s), 0.02 * std::sin(5 * s), 0.1 * std::sin(3 * s));
      const ProxyTick one = tiled.tick(p, q), other = whole.tick(p, q);
      const Wrench l = spring_wrench(tiled.parameters.spring, one.error);
      const Wrench r = spring_wrench(whole.parameters.spring, other.error);
      if (k > 110) ripple = std::max(ripple, length_of(l.force_w - r.force_w));
    }
    CHECK(tiled.distance_m(tiled.proxy.pose()) >= -depth_of(tiled));
    MESSAGE("largest difference of the force: " << ripple << " N");
    CHECK(ripple <=
          (kSingle ? 0.05 : 1000 * static_cast<double>(tiled.parameters.scale.tolerance_m)));
  }
}
