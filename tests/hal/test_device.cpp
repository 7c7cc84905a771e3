// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>
#include <string>

#include "hal/device.hpp"

using namespace haptic;
using namespace haptic::hal;

TEST_SUITE("hal.device") {
  TEST_CASE("check_capabilities: refuses numbers that no limit can have and axes driven blindly") {
    DeviceCapabilities c;
    c.sensed_dof = kDofAll;
    c.driven_dof = kDofTranslation;
    c.max_force_n = 8;
    CHECK(check_capabilities(c) == HalStatus::kOk);
    c.max_torque_nm = std::numeric_limits<Real>::quiet_NaN();
    CHECK(check_capabilities(c) == HalStatus::kBadCapabilities);
    c.max_torque_nm = -1;
    CHECK(check_capabilities(c) == HalStatus::kBadCapabilities);
    c.max_torque_nm = 0;
    c.sensed_dof = kDofRotation;
    CHECK(check_capabilities(c) == HalStatus::kBadCapabilities);
    c.sensed_dof = kDofAll | 1u << 6;
    CHECK(check_capabilities(c) == HalStatus::kBadCapabilities);
  }

  TEST_CASE("check_capabilities: refuses axis limits, steps and frames that mean nothing") {
    constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
    const auto refused = [](auto change) {
      DeviceCapabilities c;
      change(c);
      return check_capabilities(c) == HalStatus::kBadCapabilities;
    };
    CHECK_FALSE(refused([](auto&) {}));
    CHECK(refused([](auto& c) { c.max_axis_force_n[1] = -1; }));
    CHECK(refused([&](auto& c) { c.max_axis_torque_nm[2] = kNan; }));
    CHECK(refused([&](auto& c) { c.encoder_step_rad = kNan; }));
    CHECK(refused([](auto& c) { c.workspace_radius_m = -0.1_r; }));
    CHECK(refused([](auto& c) { c.max_force_n = std::numeric_limits<Real>::infinity(); }));
    CHECK(refused([](auto& c) { c.q_wd.w() = 1.1_r; }));
    CHECK(refused([&](auto& c) { c.q_wd.x() = kNan; }));
    CHECK(refused([&](auto& c) { c.handle_offset_h[0] = kNan; }));
    CHECK(refused([](auto& c) { c.watchdog_ns = -1; }));
    CHECK(refused([](auto& c) { c.report_period_ns = -1; }));
  }

  TEST_CASE("to_text: every status has its own text") {
    for (int i = 0; i <= static_cast<int>(HalStatus::kCount); ++i) {
      const std::string text = to_text(static_cast<HalStatus>(i));
      CHECK_FALSE(text.empty());
      for (int k = 0; k < i; ++k) CHECK(text != to_text(static_cast<HalStatus>(k)));
    }
    CHECK(std::string(to_text(HalStatus::kCount)) == "invalid status");
  }

  TEST_CASE("project_wrench: keeps exactly the driven components") {
    Wrench w;
    w.force_w = Vec3(1, 2, 3);
    w.torque_w = Vec3(4, 5, 6);
    const Wrench p = project_wrench(w, kDofX | kDofZ | kDofRotY);
    CHECK(p.force_w == Vec3(1, 0, 3));
    CHECK(p.torque_w == Vec3(0, 5, 0));
    CHECK(project_wrench(w, kDofAll).torque_w == w.torque_w);
  }
}
