// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The Falcon's arm: three legs of the delta type after Stamper, lengths and angles from
/// libnifalcon (BSD), FalconGeometry.h, to be confirmed on the device.
///
/// Frame F, the device's own: x right, y up, z from the motors towards the operator [m]. Leg i
/// stands at the angle phi_i about z; in its frame, with u outward,
///   u = x cos phi + y sin phi - r,  v = -x sin phi + y cos phi - s,  w = z.
/// The thigh, of length a, turns by t1 in the plane u w. The shin is a parallelogram of length b
/// between two links d and e; the links stay in that plane, b swings out of it by the angle t3:
///   v + f = b cos t3,  (u + c - a cos t1, w - a sin t1) has length L = d + e + b sin t3.
/// Because L depends on v, this is not an intersection of spheres: position from angles is found
/// by Newton's iteration, angles from position in closed form.

#include <array>
#include <cstdint>

#include "hal/drivers/linear_solve3.hpp"

namespace haptic::hal {

struct FalconGeometry {
  double a_m = 0.060;
  double b_m = 0.1025;
  double c_m = 0.01443;
  double d_m = 0.01125;
  double e_m = 0.01125;
  double f_m = -0.025;
  double r_m = 0.040;
  double s_m = -0.02309;
  std::array<double, 3> phi_deg{105.0, -15.0, -135.0};
  double motor_shaft_m = 0.01425, pulley_m = 0.110;  ///< diameters: the cable's ratio
  double counts_per_turn = 1280.0;                   ///< of the motor: 320 slots, four edges each
  double zero_angle_deg = 35.0;                      ///< t1 at count 0
};

/// Middle of the workspace in F, where the frame D of the driver has its origin. With the lengths
/// above the legs are stretched 35 mm in front of it: of the ball of 40 mm round it they reach all
/// but a twentieth, and the whole of a ball of 30 mm.
inline constexpr double kFalconCentre_m = 0.150;
/// No point farther from the middle than this is one of the arm's [m].
inline constexpr double kFalconReach_m = 0.100;

using FalconAngles = std::array<double, 3>;  ///< t1 of the three legs [rad]

class FalconKinematics {
 public:
  explicit FalconKinematics(const FalconGeometry& geometry = {}) noexcept;

  [[nodiscard]] FalconAngles angles_of(const std::array<std::int16_t, 3>& counts) const noexcept;
  /// Nearest counts to the angles; cut at the range of the encoder's number.
  [[nodiscard]] std::array<std::int16_t, 3> counts_of(const FalconAngles& angles) const noexcept;

  /// Inverse kinematics: false, `angles` unchanged, where a leg does not reach `position_f`.
  /// Cost: constant.
  [[nodiscard]] bool angles_at(const Column3& position_f, FalconAngles& angles) const noexcept;

  /// d t1 / d position [rad/m], one row per leg, at a position that the legs reach. False,
  /// `jacobian` unchanged, where they do not or where a leg is stretched: its angle then does not
  /// move smoothly with the position.
  [[nodiscard]] bool jacobian_at(const Column3& position_f, Square3& jacobian) const noexcept;

  /// Forward kinematics: Newton's iteration from `position_f`, at most kMaxSteps steps of at most
  /// 20 mm, halved up to eight times where a leg would not reach. True when every angle is met to
  /// kResidual_rad and the point lies within kFalconReach_m of the middle; else `position_f` is
  /// unchanged.
  [[nodiscard]] bool position_at(const FalconAngles& angles, Column3& position_f) const noexcept;

  /// Torques of the thighs [N m] for a force on the handle [N], by virtual work: tau . dt1 = F .
  /// dp. False, unchanged, in a singular posture.
  [[nodiscard]] static bool torques_for(const Square3& jacobian, const Column3& force_f,
                                        Column3& torques_nm) noexcept;
  /// The reverse.
  [[nodiscard]] static Column3 force_of(const Square3& jacobian,
                                        const Column3& torques_nm) noexcept;

  static constexpr int kMaxSteps = 40;
  static constexpr double kResidual_rad = 1.0e-9;

 private:
  struct Leg;
  [[nodiscard]] bool leg_at(std::size_t i, const Column3& position_f, Leg& leg) const noexcept;

  FalconGeometry geometry_;
  std::array<double, 3> cos_phi_{}, sin_phi_{};
};

}  // namespace haptic::hal
