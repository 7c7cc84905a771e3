// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>

#include "hal/drivers/displacement_pose.hpp"

using namespace haptic;
using namespace haptic::hal;

TEST_SUITE("hal.displacement_pose") {
  TEST_CASE("take, advance: a velocity lasts for its time, or until the next one") {
    DisplacementSettings settings;
    settings.full_speed_m_per_s = 1;
    settings.longest_step_ns = 50'000'000;
    DisplacementPose pose(settings);
    pose.take(Vec3(1, 0, 0), Vec3::Zero(), 1'000'000'000);
    pose.advance(1'010'000'000);
    CHECK(pose.pose_dh().p_wa.x() == doctest::Approx(0.01));
    pose.take(Vec3(0, -1, 0), Vec3::Zero(), 1'020'000'000);
    pose.advance(2'000'000'000);
    CHECK(pose.pose_dh().p_wa.x() == doctest::Approx(0.02));
    CHECK(pose.pose_dh().p_wa.y() == doctest::Approx(-0.05));
    CHECK(pose.velocity_d().linear_w.isZero(0));
    pose.advance(0);
    CHECK(pose.pose_dh().p_wa.y() == doctest::Approx(-0.05));
    pose.reset();
    CHECK(pose.pose_dh().p_wa.isZero(0));
  }

  TEST_CASE("usable: a value out of its range or no number gives way to the default") {
    constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
    const DisplacementSettings standard;
    const DisplacementSettings s = usable({-1, kNan, 0.95_r, 1e9_r, 0});
    CHECK(s.full_speed_m_per_s == standard.full_speed_m_per_s);
    CHECK(s.full_turn_rad_per_s == standard.full_turn_rad_per_s);
    CHECK(s.dead_zone == standard.dead_zone);
    CHECK(s.reach_m == standard.reach_m);
    CHECK(s.longest_step_ns == standard.longest_step_ns);
    CHECK(usable({2, 3, 0.1_r, 1, 7}).longest_step_ns == 7);
  }
}
