// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What HapticCore keeps between device and goal, and between law and device. Not for inclusion
/// outside rt_core.

#include <cstdint>
#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/law/coupling.hpp"
#include "rt_core/safety/passivity.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic {

/// Where the goal lies off the device: what the clutch and the anchor have added.
struct GoalOffset {
  Vec3 translation_m = Vec3::Zero();
  Quat rotation = Quat::Identity();
  bool is_zero = true;  ///< then the goal is the device's pose, bit by bit
  bool clutched = false;
};

/// What stands between the law and the device.
struct OutputState {
  std::int64_t period_ns = 0;
  std::int64_t stamp_ns = 0;  ///< of the last report
  bool has_stamp = false;
  Real damping_ns_per_m = 0, damping_share = 0;  ///< of the coupling
  PoseError error, rate;                         ///< of the coupling: last, and filtered rate
  bool has_error = false;
  bool observes = false;  ///< the passivity layer acts
  Passivity passivity;
  WrenchRamp ramp;
  std::span<TwistEstimator> twist;  ///< one where the scene names a device, else none
};

}  // namespace haptic
