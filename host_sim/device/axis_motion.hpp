// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One axis of the simulated device with the hand on it, over one period of a held force: exact.
///
///     m x'' = u - b x' - F_c sign(x') + k_h (x_t - x) + b_h (x_t' - x')
///
/// with the hand's target x_t moving at a constant speed through the period. The linear part is one
/// matrix exponential; Coulomb friction is followed from event to event (the axis comes to rest,
/// turns round, or is pulled loose), whose times are found by bisection. Translation in m and N, or
/// rotation in rad and N m.

#include <Eigen/Core>

namespace haptic::sim {

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

/// What acts through one period.
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

}  // namespace haptic::sim
