// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Joint torques of an arm that carries its own weight, stays within its limits and pushes the
/// hand, each joint within a torque limit.

#include "tools/bridges/arm/arm_model.hpp"

namespace haptic::tools {

/// Beyond a joint's limit its torque rises to half its torque limit over this way [rad].
inline constexpr double kWallWay_rad = 0.15;

/// Torques that the arm exerts for itself: its weight, and a soft wall at the limits of each joint.
/// `weight_share` scales the weight alone. Each torque is within half above what the limit leaves.
[[nodiscard]] JointNumbers support_torques(const ArmModel& model, const ArmPlace& place,
                                           const JointNumbers& angles_rad,
                                           const JointNumbers& limits_nm,
                                           double weight_share) noexcept;

/// `support` and the torques of the wrench. The wrench is shortened as a whole where a joint's
/// limit would be passed, so the direction of its torques stays. Never beyond `limits_nm`; a wrench
/// or a support that is not finite counts as none.
/// @param share_felt  becomes the share of the wrench that is exerted, 0 to 1.
[[nodiscard]] JointNumbers limited_torques(const ArmPlace& place, const JointNumbers& support,
                                           const Wrench& felt_d, const JointNumbers& limits_nm,
                                           double& share_felt) noexcept;

/// The force that an arm can promise in any pose within its joint limits.
struct StatedForce {
  double force_n = 0, torque_nm = 0;  ///< both at once where torque_nm is above 0
  std::size_t weakest = 0;            ///< joint that bounds the force
  double lever_m = 0;                 ///< of that joint
  double weight_nm = 0;               ///< torque that its own weight takes there, at most
};

/// Force from each joint's limit less its weight, over the farthest lever there is. With six or
/// more joints half of the room is the force's and half the torque's; with fewer there is none.
/// The largest weight is that of 1000 poses and a tenth more.
[[nodiscard]] StatedForce stated_force(const ArmModel& model, const JointNumbers& limits_nm,
                                       double weight_share) noexcept;

}  // namespace haptic::tools
