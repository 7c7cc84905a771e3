// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/arm/joint_torques.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/split_mix.hpp"

namespace haptic::tools {
namespace {

constexpr int kWeighedPoses = 1000;
constexpr double kWeightMargin = 1.1;
constexpr double kLeastLever_m = 1e-6;

double wall_torque(const ArmJoint& joint, double angle_rad, double limit_nm) noexcept {
  if (!joint.limited) return 0;
  const double inside = std::clamp(angle_rad, joint.lower_rad, joint.upper_rad);
  const double most = limit_nm / 2;
  return std::clamp((inside - angle_rad) * most / kWallWay_rad, -most, most);
}

JointNumbers largest_weights(const ArmModel& model) noexcept {
  JointNumbers largest{};
  SplitMix64 words(1);
  for (int pose = 0; pose < kWeighedPoses; ++pose) {
    JointNumbers angles{};
    for (std::size_t k = 0; k < model.joint_count; ++k) {
      const ArmJoint& joint = model.joints[k];
      const double lower = joint.limited ? joint.lower_rad : -M_PI;
      const double upper = joint.limited ? joint.upper_rad : M_PI;
      angles[k] = lower + (upper - lower) * words.uniform();
    }
    const JointNumbers weights = weight_torques(place_of(model, angles));
    for (std::size_t k = 0; k < model.joint_count; ++k) {
      largest[k] = std::max(largest[k], kWeightMargin * std::abs(weights[k]));
    }
  }
  return largest;
}

}  // namespace

JointNumbers support_torques(const ArmModel& model, const ArmPlace& place,
                             const JointNumbers& angles_rad, const JointNumbers& limits_nm,
                             double weight_share) noexcept {
  const JointNumbers weights = weight_torques(place);
  JointNumbers torques{};
  for (std::size_t k = 0; k < model.joint_count; ++k) {
    const double wall = wall_torque(model.joints[k], angles_rad[k], limits_nm[k]);
    torques[k] = std::clamp(weight_share * weights[k] + wall, -limits_nm[k], limits_nm[k]);
  }
  return torques;
}

JointNumbers limited_torques(const ArmPlace& place, const JointNumbers& support,
                             const Wrench& felt_d, const JointNumbers& limits_nm,
                             double& share_felt) noexcept {
  JointNumbers torques{}, felt{};
  share_felt = is_finite(felt_d) ? 1 : 0;
  if (share_felt > 0) {
    felt = torques_of(place, felt_d.force_w.cast<double>(), felt_d.torque_w.cast<double>());
  }
  for (std::size_t k = 0; k < place.joint_count; ++k) {
    const double limit = limits_nm[k];
    torques[k] = std::isfinite(support[k]) ? std::clamp(support[k], -limit, limit) : 0;
    if (!std::isfinite(felt[k])) share_felt = 0;
    const double room = felt[k] > 0 ? limit - torques[k] : limit + torques[k];
    if (std::abs(felt[k]) > room) share_felt = std::min(share_felt, room / std::abs(felt[k]));
  }
  for (std::size_t k = 0; k < place.joint_count && share_felt > 0; ++k) {
    torques[k] = std::clamp(torques[k] + share_felt * felt[k], -limits_nm[k], limits_nm[k]);
  }
  return torques;
}

StatedForce stated_force(const ArmModel& model, const JointNumbers& limits_nm,
                         double weight_share) noexcept {
  const JointNumbers levers = lever_bounds(model), weights = largest_weights(model);
  const double share = model.joint_count >= 6 ? 0.5 : 1;
  StatedForce stated;
  double least_room = -1;
  bool any = false;
  for (std::size_t k = 0; k < model.joint_count; ++k) {
    const double weight = weight_share * weights[k];
    const double room = std::max(limits_nm[k] - weight, 0.0);
    least_room = k == 0 ? room : std::min(least_room, room);
    const double lever = std::max(levers[k], kLeastLever_m);
    if (any && share * room / lever >= stated.force_n) continue;
    stated.force_n = share * room / lever;
    stated.weakest = k;
    stated.lever_m = levers[k];
    stated.weight_nm = weight;
    any = true;
  }
  if (model.joint_count >= 6) stated.torque_nm = share * std::max(least_room, 0.0);
  return stated;
}

}  // namespace haptic::tools
