// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The WoodenHaptics arm: three bodies driven through capstans (base yaw A, shoulder B, elbow C)
/// and three sensed wrist turns (D, E, F).
///
/// Frame P, the base: z up along the column, x forward where A is zero [m]. B and C are both
/// measured against body A, whose motors drive them: B from upright, C from straight down.
///   x = cos A (lB sin B + lC sin C), y = sin A (the same), z = lA + lB cos B - lC cos C
///   R = Rz(A) Ry(90 deg - C) Rx(D) Ry(E) Rx(F)
/// Structure and numbers: haptikfabrikenapi, kinematics.cpp and the configuration polhem_v1 of
/// haptikfabrikenapi.h (GPL-3; facts only). Every number differs from one built device to the next.

#include <array>
#include <cstdint>

#include "hal/drivers/linear_solve3.hpp"

namespace haptic::hal {

/// All defaults to be confirmed on the device.
struct PolhemGeometry {
  double column_m = 0.058;                               ///< lA
  double upper_arm_m = 0.174;                            ///< lB
  double forearm_m = 0.133;                              ///< lC
  std::array<double, 3> capstan_m{0.010, 0.010, 0.010};  ///< diameters at the motors
  std::array<double, 3> pulley_m{0.180, 0.100, 0.100};   ///< diameters at the bodies
  std::array<double, 3> motor_sign{-1.0, -1.0, -1.0};    ///< +1 or -1
  std::array<double, 3> motor_counts_per_turn{2000, 2000, 2000};
  std::array<double, 3> torque_constant_nm_per_a{0.0538, 0.0538, 0.0538};
  std::array<double, 3> wrist_counts_per_turn{1024, 1024, 1024};  ///< of D, E, F
  std::array<double, 3> wrist_sign{-1.0, 1.0, -1.0};
  /// Encoder channel of D, E, F: the board's order is the reverse.
  std::array<std::uint8_t, 3> wrist_channel{5, 4, 3};
  std::array<double, 3> origin_p_m{0.140, 0.0, 0.100};  ///< of D, in P
  /// Counts of the six channels in the pose in which the switch is pressed.
  std::array<std::int16_t, 6> calibration_counts{0, 0, -5000, 0, 0, 0};
};

/// Finite; lengths, diameters, counts per turn and torque constants above zero; signs +1 or -1;
/// the channels 3, 4 and 5 in any order.
[[nodiscard]] bool is_usable(const PolhemGeometry& geometry) noexcept;

/// A, B, C, D, E, F [rad].
using PolhemAngles = std::array<double, 6>;

class PolhemKinematics {
 public:
  /// `geometry` must be usable.
  explicit PolhemKinematics(const PolhemGeometry& geometry = {}) noexcept : geometry_(geometry) {}

  [[nodiscard]] PolhemAngles angles_of(const std::array<std::int16_t, 6>& counts) const noexcept;
  /// Position of the wrist centre, which is the point that is driven, in P.
  [[nodiscard]] Column3 position_at(const PolhemAngles& angles) const noexcept;
  /// Orientation of the handle in P, unit.
  [[nodiscard]] Eigen::Quaternion<double, Eigen::DontAlign> orientation_at(
      const PolhemAngles& angles) const noexcept;
  /// d position / d (A, B, C) [m/rad].
  [[nodiscard]] Square3 jacobian_at(const PolhemAngles& angles) const noexcept;

  /// Motor currents [A] for a force at the wrist [N]: tau = J^T F through capstans and torque
  /// constants. Not limited.
  [[nodiscard]] Column3 currents_for(const Square3& jacobian,
                                     const Column3& force_p) const noexcept;
  /// The force that currents exert, of least size where the arm is singular and the direction is
  /// carried by its structure. Zero where it cannot be known.
  [[nodiscard]] Column3 force_of(const Square3& jacobian, const Column3& currents_a) const noexcept;

 private:
  PolhemGeometry geometry_;
};

}  // namespace haptic::hal
