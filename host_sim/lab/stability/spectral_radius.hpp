// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Linear theory of the haptic loop (rt_core/METHOD.md section 9): the device with the hand on a
/// virtual wall, exactly discretised, and the largest gains at which its state does not grow. One
/// axis, in translation or rotation.
///
/// At each sample the rendering gives f = -K x - B w, w the backward difference of x over one
/// period; d samples later it acts, held for one period.

#include <Eigen/Core>
#include <functional>

namespace haptic::sim {

struct LinearLoop {
  double mass_kg = 0.1;         ///< or rotor inertia, kg m^2
  double damping_ns_per_m = 1;  ///< of the device
  double hand_stiffness = 0;    ///< N/m; the hand's target rests
  double hand_damping = 0;      ///< N s/m
  double period_s = 1e-3;       ///< T
  unsigned delay_samples = 0;   ///< d
};

/// Largest modulus of an eigenvalue of a square matrix, by repeated squaring in long double. Cost:
/// 49 products.
[[nodiscard]] double spectral_radius(const Eigen::MatrixXd& matrix);

/// x(k+1) from x(k): position, velocity, position one sample ago, wrenches under way. K in N/m, B
/// in N s/m.
[[nodiscard]] Eigen::MatrixXd wall_matrix(const LinearLoop& loop, double stiffness_n_per_m,
                                          double damping_ns_per_m);

/// Spectral radii up to 1 + kNeutral count as stable: an eigenvalue 1, of a position that nothing
/// returns, is computed to about this.
inline constexpr double kNeutral = 1e-9;

/// Gains beyond this are not looked at.
inline constexpr double kNoLimit = 1e9;

/// First gain from `low` on at which `radius` exceeds 1: steps of 5 % until it does, then bisection
/// to the last digits. 0 when it does at `low`, kNoLimit when it never does.
[[nodiscard]] double first_unstable(double low, const std::function<double(double)>& radius);

/// Largest stable K at this B [N/m]; largest stable B at this K [N s/m].
[[nodiscard]] double stiffness_limit(const LinearLoop& loop, double damping_ns_per_m);
[[nodiscard]] double damping_limit(const LinearLoop& loop, double stiffness_n_per_m);

/// b / (T (1/2 + d)): the stiffness at the boundary to first order in bT/m, without virtual damping
/// and hand; for d = 0 also the passivity bound.
[[nodiscard]] double closed_form_stiffness(double damping_ns_per_m, double period_s,
                                           unsigned delay_samples);
/// 2 (m/T) tan(pi / (4 (d + 1))): the virtual damping at the boundary, without stiffness and
/// device damping.
[[nodiscard]] double closed_form_damping(double mass_kg, double period_s, unsigned delay_samples);

}  // namespace haptic::sim
