// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The largest gains that a device can hold, by contact state, with nobody's hand on it and without
/// its Coulomb friction (either only helps). Linear model, sampled, delayed and held, solved
/// exactly, then divided by a margin: gains at the budget are stable, 1.5 times the budget is not.

#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/graph_compiler/coupling/sampled_axis.hpp"

namespace haptic::tools {

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
  SampledAxis translation, rotation;
  /// The scene has no data of the device's rotation: mass and damping are taken to act at this
  /// radius, kDeviceLengthShare r_A.
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
