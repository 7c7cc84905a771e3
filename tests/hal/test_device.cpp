// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>

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
