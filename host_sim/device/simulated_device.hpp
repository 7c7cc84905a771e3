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

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic::sim {

// One axis of the simulated device with the hand on it, over one period of a held force: exact.
//
//     m x'' = u - b x' - F_c sign(x') + k_h (x_t - x) + b_h (x_t' - x')
//
// with the hand's target x_t moving at a constant speed through the period. The linear part is one
// matrix exponential; Coulomb friction is followed from event to event (the axis comes to rest,
// turns round, or is pulled loose), whose times are found by bisection. Translation in m and N, or
// rotation in rad and N m.

struct AxisParameters {
  double inertia = 0.1;       ///< kg or kg m^2, > 0
  double damping = 1.0;       ///< of the device, N s/m or N m s/rad, >= 0
  double coulomb = 0.0;       ///< F_c, N or N m, >= 0; as large at rest as in motion
  double hand_stiffness = 0;  ///< N/m or N m/rad, >= 0
  double hand_damping = 0;    ///< N s/m or N m s/rad, >= 0
};

struct AxisState {
  double position = 0, velocity = 0;
};

/// Forces that act through one period.
struct AxisDrive {
  double force = 0;            ///< u, held
  double target = 0;           ///< x_t at the beginning
  double target_velocity = 0;  ///< x_t'
};

class AxisMotion {
 public:
  /// Events within one period that are followed; after the last the axis stays at rest to the end
  /// of the period. A period of a servo loop has two at most.
  static constexpr int kMaxEvents = 16;

  AxisMotion(const AxisParameters& parameters, double period_s);

  /// The state one period later. Cost without friction: one 4x4 product.
  [[nodiscard]] AxisState advance(const AxisState& state, const AxisDrive& drive) const;

  [[nodiscard]] const AxisParameters& parameters() const { return parameters_; }

 private:
  /// Position, velocity, sum of the forces that do not depend on the state, and its rate.
  using Extended = Eigen::Vector4d;

  [[nodiscard]] Extended after(const Extended& from, double time_s) const;
  [[nodiscard]] double acceleration(const Extended& z) const;
  [[nodiscard]] double time_to_rest(const Extended& from, double direction, double limit_s) const;
  [[nodiscard]] double rest_within(const Extended& from, double direction, double span_s) const;

  AxisParameters parameters_;
  double period_s_, substep_s_;
  Eigen::Matrix4d rate_, step_;
};

// The hand on the simulated device: a spring and a damper, in translation and in rotation, to a
// target that moves, and a constant push. Its passive part is integrated together with the device
// (AxisMotion); here are its values and its target.

/// Lever at which the springs of a hand act in rotation: the fingers hold a handle of about this
/// radius, so the tissue that gives k and b in translation gives k L^2 and b L^2 in rotation [m].
inline constexpr double kGripRadius_m = 0.015;

struct HandModel {
  std::string name = "none";
  double stiffness_n_per_m = 0, damping_ns_per_m = 0;        ///< >= 0
  double stiffness_nm_per_rad = 0, damping_nms_per_rad = 0;  ///< >= 0
  Vector push_w = Vector::Zero();  ///< constant force in addition to the springs [N]
};

/// A hand of these values in translation, and k L^2, b L^2 in rotation.
[[nodiscard]] HandModel hand_of(const std::string& name, double stiffness_n_per_m,
                                double damping_ns_per_m);

/// "none" (nobody holds the device), "loose" 100 N/m, 0.2 N s/m; "light" 300, 3; "firm" 800, 10.
/// Nothing for any other name.
[[nodiscard]] std::optional<HandModel> hand_named(const std::string& name);
[[nodiscard]] const std::vector<std::string>& hand_names();

/// Where the hand wants the grip point and the part's orientation, at one instant.
struct HandTarget {
  Vector x0_w = Vector::Zero();
  Rotation q_wa = Rotation::Identity();
};

/// Targets at both ends of a period; between them it moves at constant speed.
struct HandStroke {
  HandTarget from, to;
};

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

  /// The pose by the encoders now.
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

// A device model from a TOML file: a `[device]` table with the keys of a scene's (README of the
// graph compiler) and, for rotation, rotor_kg_m2, rotor_damping_nms_per_rad, coulomb_torque_nm,
// encoder_step_rad, and delay_samples instead of delay_s. Keys left out keep the values of
// DeviceModel.

/// `rate_hz`: of the loop, for delay_s. Limits of rate, stiffness and damping are read and not
/// used: the core and the compiler act on them, the device does not.
/// @throws tools::InputError with file and line: unreadable file, TOML syntax, unknown key, value
///         out of range.
[[nodiscard]] DeviceModel read_device_file(const std::string& path, double rate_hz);

}  // namespace haptic::sim
