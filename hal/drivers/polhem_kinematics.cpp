// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/polhem_kinematics.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace haptic::hal {
namespace {

using Turn = Eigen::Quaternion<double, Eigen::DontAlign>;

bool is_positive(double x) noexcept { return std::isfinite(x) && x > 0.0; }
bool is_sign(double x) noexcept { return x == 1.0 || x == -1.0; }

Turn turn_about(int axis, double angle_rad) noexcept {
  Turn q(std::cos(0.5 * angle_rad), 0.0, 0.0, 0.0);
  q.vec()[axis] = std::sin(0.5 * angle_rad);
  return q;
}

/// Turn of a body per turn of its motor.
double ratio(const PolhemGeometry& g, std::size_t i) noexcept {
  return g.motor_sign[i] * g.capstan_m[i] / g.pulley_m[i];
}

}  // namespace

bool is_usable(const PolhemGeometry& g) noexcept {
  bool good = is_positive(g.column_m) && is_positive(g.upper_arm_m) && is_positive(g.forearm_m);
  unsigned channels = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    good = good && is_positive(g.capstan_m[i]) && is_positive(g.pulley_m[i]) &&
           is_sign(g.motor_sign[i]) && is_positive(g.motor_counts_per_turn[i]) &&
           is_positive(g.torque_constant_nm_per_a[i]) && is_positive(g.wrist_counts_per_turn[i]) &&
           is_sign(g.wrist_sign[i]) && std::isfinite(g.origin_p_m[i]) && g.wrist_channel[i] < 6;
    if (good) channels |= 1u << g.wrist_channel[i];
  }
  return good && channels == (1u << 3 | 1u << 4 | 1u << 5);
}

PolhemAngles PolhemKinematics::angles_of(const std::array<std::int16_t, 6>& counts) const noexcept {
  const PolhemGeometry& g = geometry_;
  PolhemAngles angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    angles[i] = 2.0 * std::numbers::pi * counts[i] / g.motor_counts_per_turn[i] * ratio(g, i);
    const double wrist = counts[g.wrist_channel[i]];
    angles[i + 3] = 2.0 * std::numbers::pi * wrist / g.wrist_counts_per_turn[i] * g.wrist_sign[i];
  }
  return angles;
}

Column3 PolhemKinematics::position_at(const PolhemAngles& angles) const noexcept {
  const PolhemGeometry& g = geometry_;
  const double out = g.upper_arm_m * std::sin(angles[1]) + g.forearm_m * std::sin(angles[2]);
  return {std::cos(angles[0]) * out, std::sin(angles[0]) * out,
          g.column_m + g.upper_arm_m * std::cos(angles[1]) - g.forearm_m * std::cos(angles[2])};
}

Turn PolhemKinematics::orientation_at(const PolhemAngles& angles) const noexcept {
  Turn q = turn_about(2, angles[0]) * turn_about(1, 0.5 * std::numbers::pi - angles[2]) *
           turn_about(0, angles[3]) * turn_about(1, angles[4]) * turn_about(0, angles[5]);
  q.normalize();
  return q;
}

Square3 PolhemKinematics::jacobian_at(const PolhemAngles& angles) const noexcept {
  const PolhemGeometry& g = geometry_;
  const double ca = std::cos(angles[0]), sa = std::sin(angles[0]);
  const double cb = g.upper_arm_m * std::cos(angles[1]), sb = g.upper_arm_m * std::sin(angles[1]);
  const double cc = g.forearm_m * std::cos(angles[2]), sc = g.forearm_m * std::sin(angles[2]);
  Square3 jacobian;
  jacobian.col(0) = Column3(-sa * (sb + sc), ca * (sb + sc), 0.0);
  jacobian.col(1) = Column3(ca * cb, sa * cb, -sb);
  jacobian.col(2) = Column3(ca * cc, sa * cc, sc);
  return jacobian;
}

Column3 PolhemKinematics::currents_for(const Square3& jacobian,
                                       const Column3& force_p) const noexcept {
  Column3 currents = jacobian.transpose() * force_p;
  for (std::size_t i = 0; i < 3; ++i) {
    currents[static_cast<Eigen::Index>(i)] *=
        ratio(geometry_, i) / geometry_.torque_constant_nm_per_a[i];
  }
  return currents;
}

Column3 PolhemKinematics::force_of(const Square3& jacobian,
                                   const Column3& currents_a) const noexcept {
  Column3 torques = currents_a;
  for (std::size_t i = 0; i < 3; ++i) {
    torques[static_cast<Eigen::Index>(i)] *=
        geometry_.torque_constant_nm_per_a[i] / ratio(geometry_, i);
  }
  // J^T F = tau in least squares, with so little damping (1 um) that a regular posture does not see
  // it: a ten-millionth of the force where the arm has a lever of 3 mm.
  constexpr double kDamping_m = 1.0e-6;
  const Square3 normal =
      jacobian * jacobian.transpose() + kDamping_m * kDamping_m * Square3::Identity();
  Column3 force = Column3::Zero();
  static_cast<void>(solve3(normal, jacobian * torques, 1.0e-14, force));
  return force;
}

}  // namespace haptic::hal
