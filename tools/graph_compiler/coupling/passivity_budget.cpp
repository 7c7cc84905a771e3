// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/coupling/passivity_budget.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::tools {
namespace {

/// Ticks of the shortest window over which the twist estimator takes a velocity.
std::uint32_t window_ticks(const SceneParameters& p) {
  const double ticks = std::ceil(p.coupling.min_window_s * p.rate_hz - 1e-9);
  return static_cast<std::uint32_t>(std::clamp(ticks, 1.0, 1e6));
}

SampledAxis translation_axis(const SceneParameters& p) {
  SampledAxis axis;
  axis.mass_kg = p.device.mass_kg;
  axis.damping_ns_per_m = p.device.damping_ns_per_m;
  axis.period_s = 1.0 / p.rate_hz;
  axis.delay_s = p.device.delay_s;
  axis.window_ticks = window_ticks(p);
  return axis;
}

/// Largest stiffness and damping of an axis within the margin.
struct AxisLimits {
  double stiffness = 0.0, damping = 0.0;
};

AxisLimits limits(const SampledAxis& axis, double stiffness, double virtual_damping) {
  return {stiffness_boundary(axis, virtual_damping) / kBudgetMargin,
          damping_boundary(axis, stiffness) / kBudgetMargin};
}

}  // namespace

bool PassivityBudget::holds() const {
  return damping_holds() &&
         std::all_of(states.begin(), states.end(), [](const auto& s) { return s.holds(); });
}

double PassivityBudget::limit_of(const char* gain) const {
  double least = 0.0;
  bool found = false;
  for (const ContactStateBudget& s : states) {
    if (std::strcmp(s.gain, gain) != 0) continue;
    least = found ? std::min(least, s.stiffness) : s.stiffness;
    found = true;
  }
  return least;
}

PassivityBudget passivity_budget(const SceneParameters& p, double radius_m) {
  PassivityBudget budget;
  const DeviceParameters& d = p.device;
  if (d.given == 0) {
    budget.unchecked = "no [device]";
    return budget;
  }
  if (!(d.mass_kg > 0.0)) {
    budget.unchecked = "[device] gives no mass_kg";
    return budget;
  }
  const bool proxy = p.law == LawId::kProxy;
  const SampledAxis axis = translation_axis(p);
  budget.translation = budget.rotation = axis;
  const double r = kDeviceLengthShare * radius_m;
  budget.rotation_radius_m = r;
  budget.rotation.mass_kg *= r * r;
  budget.rotation.damping_ns_per_m *= r * r;
  const double b = proxy ? p.coupling.damping_ns_per_m : 0.0;
  budget.virtual_damping_ns_per_m = b;
  budget.damping_limit_ns_per_m = damping_boundary(axis, 0.0) / kBudgetMargin;
  budget.first_order_n_per_m = first_order_stiffness(axis);
  budget.passive_n_per_m = std::max(0.0, 2.0 * (d.damping_ns_per_m - b) / axis.period_s);
  if (d.encoder_step_m > 0) {
    budget.encoder_n_per_m = 2.0 * d.coulomb_friction_n / d.encoder_step_m;
  }
  const double gain = proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  const AxisLimits one = limits(axis, gain, b);
  const auto add = [&](const char* state, double factor) {
    const AxisLimits here = factor == 1.0 ? one : limits(axis, factor * gain, b);
    budget.states.push_back({state, proxy ? "k_t_n_per_m" : "k_f_n_per_m", factor,
                             here.stiffness / factor, here.damping, gain});
  };
  add("one plane", 1.0);
  add("two opposite planes (slot)", proxy ? 1.0 : 2.0);
  add("edge of two perpendicular planes", 1.0);
  add("corner of three perpendicular planes", 1.0);
  if (proxy) {
    const double k_r = p.coupling.k_r_nm_per_rad;
    // The coupling damps rotation with B L^2 = (B / k_t) k_r, which follows k_r.
    const double damping_per_stiffness_s = b / p.coupling.k_t_n_per_m;
    const AxisLimits turn{
        stiffness_boundary(budget.rotation, 0.0, damping_per_stiffness_s) / kBudgetMargin,
        damping_boundary(budget.rotation, k_r) / kBudgetMargin};
    budget.states.push_back({"rotation", "k_r_nm_per_rad", 1.0, turn.stiffness, turn.damping, k_r});
  } else {
    // k_F at the largest lever: k_F r_A^2 against inertia m r^2.
    add("rotation, contact at the largest lever", radius_m * radius_m / (r * r));
  }
  return budget;
}

}  // namespace haptic::tools
