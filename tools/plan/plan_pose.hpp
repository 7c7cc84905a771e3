// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A pose of a plan: place of the grip point x_0^A in W [m], and the orientation of A.

#include <array>

namespace haptic::tools {

struct PlanPose {
  std::array<double, 3> x0_m{};
  std::array<double, 4> q_wxyz{1, 0, 0, 0};  ///< unit within 1e-12

  friend bool operator==(const PlanPose&, const PlanPose&) = default;
};

}  // namespace haptic::tools
