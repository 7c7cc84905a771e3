// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A haptic device of six driven degrees of freedom, simulated: rigid body with viscous and Coulomb
/// friction, encoders, amplifier and transport delay, with a hand on it. Equal inputs give equal
/// bits; there is no clock but the count of periods.
///
/// Between two samples the wrench is held (zero-order hold) and the linear motion is integrated
/// exactly. The inertia is isotropic, so momentum in W axes obeys I w' = tau - c w with no
/// gyroscopic term; the turn within one period is a rotation vector in W axes, exact for a fixed
/// axis and otherwise off by the square of the turn per period.

#include <deque>

#include "host_sim/device/axis_motion.hpp"
#include "host_sim/device/simulated_hand.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic::sim {

struct DeviceModel {
  double mass_kg = 0.1, damping_ns_per_m = 1.0;
  double rotor_kg_m2 = 1.0e-4, rotor_damping_nms_per_rad = 1.0e-3;
  double coulomb_force_n = 0, coulomb_torque_nm = 0;  ///< per axis
  double encoder_step_m = 0, encoder_step_rad = 0;    ///< 0: exact
  double max_force_n = 0, max_torque_nm = 0;          ///< of the amplifier, 0: none
  unsigned delay_samples = 0;  ///< whole periods between a sample and the begin of its wrench
};
inline constexpr unsigned kMaxDelaySamples = 16;

/// The device of a scene's [device] table at a loop rate: delay rounded to whole samples; what the
/// table leaves out is as in DeviceModel. @throws tools::InputError when the delay is more than
/// kMaxDelaySamples periods.
[[nodiscard]] DeviceModel device_of(const SceneParameters& parameters, double rate_hz);

/// A wrench in double, W axes, torque about the grip point.
struct Load {
  Vector force_w = Vector::Zero(), torque_w = Vector::Zero();
};

struct DeviceState {
  Vector x0_w = Vector::Zero();  ///< grip point
  Rotation q_wa = Rotation::Identity();
  Vector velocity_w = Vector::Zero(), angular_velocity_w = Vector::Zero();
};

class SimulatedDevice {
 public:
  /// @throws tools::InputError when a value of the model is out of range.
  SimulatedDevice(const DeviceModel& model, const HandModel& hand, double period_s);

  /// Puts the device there; no wrench is under way. Encoders count from this pose.
  void place(const DeviceState& state);

  /// What the encoders say now.
  [[nodiscard]] HandTarget sensed() const;
  [[nodiscard]] const DeviceState& state() const { return state_; }

  /// One period: `command` is the answer to the present sample; the one of `delay_samples` periods
  /// ago acts, cut to the amplifier's limits with its direction kept, which is returned.
  Load advance(const Load& command, const HandStroke& stroke);

  /// Drives off: wrenches under way never act.
  void drop_wrenches();

  /// Work that the acting wrench has done on the device since `place` [J]: what the rendering has
  /// given out, exactly, as the force is held over each period.
  [[nodiscard]] double delivered_j() const { return delivered_j_; }

 private:
  DeviceModel model_;
  HandModel hand_;
  double period_s_;
  AxisMotion translation_, rotation_;
  DeviceState state_;
  HandTarget home_;
  std::deque<Load> under_way_;
  double delivered_j_ = 0;
};

/// Rotation vector of `q`, W axes [rad].
[[nodiscard]] Vector rotation_vector(const Rotation& q);
/// The rotation of a rotation vector.
[[nodiscard]] Rotation rotation_of(const Vector& rotation_rad);

}  // namespace haptic::sim
