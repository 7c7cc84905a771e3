// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/workspace_map.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using haptic::test::norm;
using haptic::test::Random;

namespace {

constexpr std::uint64_t kMapSeed = 0x3A9;
constexpr double kMapRounding = 64.0 * static_cast<double>(kRealEpsilon);

Vec3 random_vector(Random& random, double size) {
  return {static_cast<Real>(random.uniform(-size, size)),
          static_cast<Real>(random.uniform(-size, size)),
          static_cast<Real>(random.uniform(-size, size))};
}

Quat random_rotation(Random& random) {
  const std::array<double, 4> q = random.rotation();
  return Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
              static_cast<Real>(q[3]))
      .normalized();
}

WorkspaceMap random_map(Random& random) {
  WorkspaceMap map;
  map.scale = static_cast<Real>(std::exp2(random.uniform(-6.0, 6.0)));
  map.q_wd = random_rotation(random);
  map.q_ha = random_rotation(random);
  map.offset_w = random_vector(random, 0.5);
  map.grip_a = random_vector(random, 0.1);
  return map;
}

double dot(const Vec3& l, const Vec3& r) { return static_cast<double>(l.dot(r)); }

}  // namespace

TEST_SUITE("rt_core.workspace_map") {
  TEST_CASE("the map of the default leaves pose, twist and wrench as they are") {
    Random random(kMapSeed);
    const Pose pose = {random_vector(random, 0.1), random_rotation(random)};
    const Pose mapped = mesh_pose(WorkspaceMap{}, pose);
    CHECK(norm(mapped.p_wa - pose.p_wa) <= kMapRounding * 0.1);
    CHECK(static_cast<double>(mapped.q_wa.angularDistance(pose.q_wa)) <= 1.0e-3);
    const Wrench wrench = {random_vector(random, 3), random_vector(random, 0.1)};
    CHECK(device_wrench(WorkspaceMap{}, wrench).force_w == wrench.force_w);
    CHECK(scene_wrench(WorkspaceMap{}, wrench).torque_w == wrench.torque_w);
  }

  TEST_CASE("the handle point stands for the grip point: by hand") {
    WorkspaceMap map;
    map.scale = 2;
    map.q_wd = so3_exp(Vec3(0, 0, std::acos(0.0_r)));  // x_d to y_w
    map.offset_w = Vec3(1, 0, 0);
    map.grip_a = Vec3(0, 0, 0.5_r);
    const Pose pose = mesh_pose(map, {Vec3(0.1_r, 0, 0), Quat::Identity()});
    CHECK(norm(pose.p_wa - Vec3(1, 0.2_r, -0.5_r)) <= kMapRounding * 2);
    const Wrench felt = device_wrench(map, {Vec3(0, 3, 0), Vec3(0, 0.25_r, 0)});
    CHECK(norm(felt.force_w - Vec3(6, 0, 0)) <= kMapRounding * 6);
    CHECK(norm(felt.torque_w - Vec3(0.25_r, 0, 0)) <= kMapRounding);
    const Twist moved = scene_twist(map, {Vec3(0, 0.1_r, 0), Vec3(1, 0, 0)});
    CHECK(norm(moved.linear_w - Vec3(-0.2_r, 0, 0)) <= kMapRounding);
    CHECK(norm(moved.angular_w - Vec3(0, 1, 0)) <= kMapRounding);
  }

  TEST_CASE("round trips and power, random maps") {
    CAPTURE(kMapSeed);
    Random random(kMapSeed);
    for (int k = 0; k < 10'000; ++k) {
      const WorkspaceMap map = random_map(random);
      REQUIRE(is_usable(map));
      const Pose handle = {random_vector(random, 0.2), random_rotation(random)};
      const Pose mesh = mesh_pose(map, handle);
      const Pose back = handle_pose(map, mesh);
      // Scaled down again, the offset's rounding grows.
      const double reach_m = 0.6 / static_cast<double>(map.scale) + 0.2;
      REQUIRE(norm(back.p_wa - handle.p_wa) <= kMapRounding * reach_m);
      const double q_off =
          std::min(static_cast<double>((back.q_wa.coeffs() - handle.q_wa.coeffs()).norm()),
                   static_cast<double>((back.q_wa.coeffs() + handle.q_wa.coeffs()).norm()));
      REQUIRE(q_off <= kMapRounding);
      const Vec3 x0_w = mesh.p_wa + mesh.q_wa * map.grip_a;
      const Vec3 expected_w = map.offset_w + map.q_wd * Vec3(map.scale * handle.p_wa);
      REQUIRE(norm(x0_w - expected_w) <=
              kMapRounding * (1.0 + 0.4 * static_cast<double>(map.scale)));

      const Wrench wrench_w = {random_vector(random, 5), random_vector(random, 0.2)};
      const Twist twist_d = {random_vector(random, 1), random_vector(random, 5)};
      const Wrench wrench_d = device_wrench(map, wrench_w);
      const Twist twist_w = scene_twist(map, twist_d);
      const double force_w = dot(wrench_w.force_w, twist_w.linear_w);
      const double force_d = dot(wrench_d.force_w, twist_d.linear_w);
      const double size = 15.0 * static_cast<double>(map.scale);
      REQUIRE(std::abs(force_w - force_d) <= kMapRounding * size);
      REQUIRE(std::abs(dot(wrench_w.torque_w, twist_w.angular_w) -
                       dot(wrench_d.torque_w, twist_d.angular_w)) <= kMapRounding * 3);
      const Wrench again = scene_wrench(map, wrench_d);
      REQUIRE(norm(again.force_w - wrench_w.force_w) <= kMapRounding * 9);
      REQUIRE(norm(again.torque_w - wrench_w.torque_w) <= kMapRounding);
    }
  }

  TEST_CASE("the grip point's velocity is the one of the mapped poses") {
    Random random(kMapSeed + 1);
    for (int k = 0; k < 200; ++k) {
      const WorkspaceMap map = random_map(random);
      const Pose handle = {random_vector(random, 0.1), random_rotation(random)};
      const Twist twist_d = {random_vector(random, 0.5), random_vector(random, 2)};
      const Real dt = HAPTIC_REAL_IS_FLOAT ? 1.0e-2_r : 1.0e-4_r;
      const Pose later = {handle.p_wa + dt * twist_d.linear_w,
                          so3_exp(dt * twist_d.angular_w) * handle.q_wa};
      const Pose a = mesh_pose(map, handle), b = mesh_pose(map, later);
      const Vec3 way = (b.p_wa + b.q_wa * map.grip_a) - (a.p_wa + a.q_wa * map.grip_a);
      const Vec3 turn = so3_log(b.q_wa * a.q_wa.conjugate());
      const Twist twist_w = scene_twist(map, twist_d);
      const double slack = HAPTIC_REAL_IS_FLOAT ? 2.0e-3 : 1.0e-9;
      CHECK(norm(way / dt - twist_w.linear_w) <= slack * (1.0 + static_cast<double>(map.scale)));
      CHECK(norm(turn / dt - twist_w.angular_w) <= slack);
    }
  }

  TEST_CASE("a tool tip: pose and velocity are the tip's, power is the same about both points") {
    CAPTURE(kMapSeed);
    Random random(kMapSeed + 2);
    for (int k = 0; k < 2000; ++k) {
      WorkspaceMap map = random_map(random);
      map.handle_offset_h = random_vector(random, 0.2);
      const Pose sensed = {random_vector(random, 0.2), random_rotation(random)};
      const Vec3 arm_d = handle_arm(map, sensed.q_wa);
      REQUIRE(norm(arm_d - sensed.q_wa * map.handle_offset_h) <= kMapRounding);
      REQUIRE(norm(at_handle_point(sensed, arm_d).p_wa - (sensed.p_wa + arm_d)) == 0.0);
      const Wrench handle_d = {random_vector(random, 5), random_vector(random, 0.2)};
      const Twist twist = {random_vector(random, 1), random_vector(random, 5)};
      const Wrench sensed_d = about_sensed_point(handle_d, arm_d);
      const Twist tip = at_handle_point(twist, arm_d);
      const double about_tip =
          dot(handle_d.force_w, tip.linear_w) + dot(handle_d.torque_w, tip.angular_w);
      const double about_sensed =
          dot(sensed_d.force_w, twist.linear_w) + dot(sensed_d.torque_w, twist.angular_w);
      REQUIRE(std::abs(about_tip - about_sensed) <= kMapRounding * 60);
      REQUIRE(norm(about_handle_point(sensed_d, arm_d).torque_w - handle_d.torque_w) <=
              kMapRounding * 5);
      const Vec3 none = handle_arm(WorkspaceMap{}, sensed.q_wa);
      REQUIRE(about_sensed_point(handle_d, none).torque_w == handle_d.torque_w);
      REQUIRE(at_handle_point(sensed, none).p_wa == sensed.p_wa);
    }
  }

  TEST_CASE("is_usable: finite, scale in range, unit quaternions") {
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    CHECK(is_usable(WorkspaceMap{}));
    for (const Real scale : {0.0_r, -1.0_r, 0.9e-6_r, 1.1e6_r, nan}) {
      WorkspaceMap map;
      map.scale = scale;
      CHECK_FALSE(is_usable(map));
    }
    for (const auto quaternion : {&WorkspaceMap::q_wd, &WorkspaceMap::q_ha}) {
      for (const Quat& q : {Quat(1.0001_r, 0, 0, 0), Quat(0, 0, 0, 0), Quat(nan, 0, 0, 1)}) {
        WorkspaceMap map;
        map.*quaternion = q;
        CHECK_FALSE(is_usable(map));
      }
    }
    for (const auto vector : {&WorkspaceMap::offset_w, &WorkspaceMap::grip_a}) {
      WorkspaceMap map;
      map.*vector = Vec3(0, nan, 0);
      CHECK_FALSE(is_usable(map));
    }
  }
}
