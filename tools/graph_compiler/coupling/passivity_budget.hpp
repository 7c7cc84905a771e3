// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The largest gains that a device can hold, by contact state, with nobody's hand on it and without
/// its Coulomb friction (either only helps). Linear model, sampled, delayed and held, solved
/// exactly, then divided by a margin: gains at the budget are stable, 1.5 times the budget is not.

#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

// One axis of a haptic device, nobody's hand on it, under a virtual spring and damper that are
// sampled, late and held: when is the loop stable? Exact for the linear loop, no small-gain or
// first-order argument. Units are those of a translation; an axis of rotation takes inertia
// [kg m^2], [N m s/rad] and [N m/rad] in their places.

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

/// A device that states a mass and no rotor turns, under law proxy, as if mass and damping acted at
/// this radius. Safe side of what makers state: the largest rotary over the largest linear
/// stiffness of lambda.7, sigma.7 and Premium 1.5 6-DOF is the square of 11, 16 and 19 mm (presets
/// of CHAI3D).
inline constexpr double kAssumedRotorRadius_m = 0.01;
[[nodiscard]] constexpr bool has_rotor(const DeviceParameters& d) {
  return d.rotor_inertia_kg_m2[0] > 0;
}

/// Under the direct laws they are taken to act at this share of r_A.
inline constexpr double kDirectRotorShare = 0.75;

/// Boundary of stability over a derived stiffness: with a loose hand and an encoder, the loop
/// swings by more than its last digit above half of the boundary (`host_sim calm`).
inline constexpr double kCalmMargin = 2.0;
/// Stiffness that the axis' own damping holds at rest: there, within an encoder's last digits, the
/// coupling's damping knows no velocity, and a loop that relies on it swings by many counts. An
/// axis without damping of its own has none such: there the coupling's must do, and this is the
/// largest double.
double calm_stiffness(const SampledAxis& axis);

/// Boundary of stability over budget.
inline constexpr double kBudgetMargin = 1.25;
/// Gains derived from a radius meet the budget of that radius within its rounding to a scalar.
inline constexpr double kBudgetRounding = 1.0e-6;

/// A contact state and what it allows. Law proxy: the spring to a proxy that contact holds in any
/// way is never stiffer than k_t and k_r, regardless of the state, since the proxy's freedom only
/// lies in series. Other laws add the stiffness k_F of every plane in contact.
struct ContactStateBudget {
  const char* state = "";  ///< "one plane"
  const char* gain = "";   ///< key of the gain that it bounds: "k_t_n_per_m"
  double factor = 1.0;     ///< stiffness of the state along its stiffest direction over the gain
  double stiffness = 0.0;  ///< largest safe gain, with the scene's B [N/m or N m/rad]
  double damping = 0.0;    ///< largest safe damping at the scene's gain [N s/m or N m s/rad]
  double given = 0.0;      ///< the scene's gain
  [[nodiscard]] bool holds() const { return given <= stiffness * (1.0 + kBudgetRounding); }
};

struct PassivityBudget {
  std::string unchecked;  ///< why there is no budget; empty: there is one
  SampledAxis translation;
  SampledAxis rotation;        ///< about the axis that holds the least stiffness
  bool rotor_assumed = false;  ///< the device states none
  /// Radius of gyration: of the rotor's inertia over the mass, or the assumed one: for law proxy
  /// kAssumedRotorRadius_m, for the direct laws kDirectRotorShare r_A.
  double rotation_radius_m = 0.0;
  double virtual_damping_ns_per_m = 0.0;  ///< B; law proxy only
  double damping_limit_ns_per_m = 0.0;    ///< largest safe B where nothing is touched (K = 0)
  double first_order_n_per_m = 0.0;       ///< b / (T / 2 + delay), without virtual damping
  /// b > K T / 2 + B: stiffness up to which the loop is passive, hence stable in any hand, without
  /// delay.
  double passive_n_per_m = 0.0;
  /// 2 f_c / step: stiffness up to which Coulomb friction eats what the encoder's steps feed in; 0:
  /// not given.
  double encoder_n_per_m = 0.0;
  std::vector<ContactStateBudget> states;

  [[nodiscard]] bool damping_holds() const {
    return virtual_damping_ns_per_m <= damping_limit_ns_per_m * (1.0 + kBudgetRounding);
  }
  [[nodiscard]] bool holds() const;
  /// Least of the states' largest gains for this key; 0 when there is none.
  [[nodiscard]] double limit_of(const char* gain) const;
};

/// Budget of the parameters' own device, rate, law, gains and damping. `radius_m` is r_A, the
/// radius of the moving part about its grip. Cost: below a millisecond.
PassivityBudget passivity_budget(const SceneParameters& parameters, double radius_m);

}  // namespace haptic::tools
