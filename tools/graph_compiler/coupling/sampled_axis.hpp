// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One axis of a haptic device, nobody's hand on it, under a virtual spring and damper that are
/// sampled, late and held: when is the loop stable? Exact for the linear loop, no small-gain or
/// first-order argument. Units are those of a translation; an axis of rotation takes inertia
/// [kg m^2], [N m s/rad] and [N m/rad] in their places.

#include <cstdint>

namespace haptic::tools {

/// m x'' + b x' = F; F(t) = -K x_n - B (x_n - x_{n-w}) / (w T) from nT + delay to (n + 1) T +
/// delay, with x_n = x(nT).
struct SampledAxis {
  double mass_kg = 0.0;            ///< m > 0
  double damping_ns_per_m = 0.0;   ///< b >= 0, physical
  double period_s = 0.0;           ///< T > 0
  double delay_s = 0.0;            ///< from sample to output, at least 0; need not be whole samples
  std::uint32_t window_ticks = 1;  ///< w, over which the velocity is a difference
};

/// Longest delay and window in ticks that are computed; a longer one counts as unstable.
inline constexpr std::uint32_t kMaxDelayTicks = 64;
inline constexpr std::uint32_t kMaxWindowTicks = 64;

/// True when every root of the closed loop's characteristic polynomial lies inside the unit circle
/// (Schur and Cohn's recursion; degree 3 + delay + window). Cost: O(degree^2).
bool is_stable(const SampledAxis& axis, double stiffness_n_per_m, double virtual_damping_ns_per_m);

/// Largest K such that the loop is stable with it and every smaller one that the search meets (60
/// per decade), to a relative 1e-9; 0 when none is. Cost: some 600 tests of stability at most.
/// `damping_per_stiffness_s`: seconds times K that the virtual damping grows by, 0 where it is
/// fixed.
double stiffness_boundary(const SampledAxis& axis, double virtual_damping_ns_per_m,
                          double damping_per_stiffness_s = 0.0);

/// The same for B at a given K. When B = 0 is unstable but a larger one is not, the first stable
/// stretch counts.
double damping_boundary(const SampledAxis& axis, double stiffness_n_per_m);

/// Closed forms of rt_core/METHOD.md section 9, first order in b T / m: K = b / (T / 2 + delay),
/// and at K = 0, b = 0: B = 2 (m / T) tan(pi / (4 (d + 1))), d = delay / T.
double first_order_stiffness(const SampledAxis& axis);
double first_order_damping(const SampledAxis& axis);

}  // namespace haptic::tools
