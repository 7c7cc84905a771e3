// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/coupling/simulated_gains.hpp"

#include <algorithm>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::tools {
namespace {

std::string digits_of(double value) { return short_number(value, 5); }

/// The scene's parameters on the device.
SceneParameters on_device(const SceneParameters& scene, const SimulatedLoop& loop) {
  SceneParameters p = scene;
  p.rate_hz = loop.rate_hz;
  p.device = loop.device;
  p.device.given = 1;
  return p;
}

/// The part of `given` that the loop holds; all of it without a limit: then a smaller gain is no
/// better.
double held(double given, double limit) { return limit > 0.0 ? std::min(given, limit) : given; }

SimulatedGains proxy_gains(SceneParameters p, double radius_m, bool turns) {
  CouplingParameters& c = p.coupling;
  PassivityBudget budget = passivity_budget(p, radius_m);
  if (!budget.damping_holds()) {
    c.damping_ns_per_m = kDerivedDampingShare * budget.damping_limit_ns_per_m;
    budget = passivity_budget(p, radius_m);
  }
  c.k_t_n_per_m = std::min(held(c.k_t_n_per_m, budget.limit_of("k_t_n_per_m")),
                           calm_stiffness(budget.translation));
  if (turns) {
    budget = passivity_budget(p, radius_m);  // rotation is damped in proportion to k_r / k_t
    c.k_r_nm_per_rad = std::min(held(c.k_r_nm_per_rad, budget.limit_of("k_r_nm_per_rad")),
                                calm_stiffness(budget.rotation));
  }
  return {c.k_t_n_per_m, c.k_r_nm_per_rad, c.damping_ns_per_m, p.k_f_n_per_m, {}};
}

/// Every gain at or below the scene's, and one of them below by more than a budget's rounding.
bool is_lower(const SimulatedGains& g, const SceneParameters& scene) {
  const auto below = [](double one, double other) { return one < other * (1 - kBudgetRounding); };
  const CouplingParameters& c = scene.coupling;
  return below(g.k_t_n_per_m, c.k_t_n_per_m) || below(g.k_r_nm_per_rad, c.k_r_nm_per_rad) ||
         below(g.damping_ns_per_m, c.damping_ns_per_m) || below(g.k_f_n_per_m, scene.k_f_n_per_m);
}

std::string device_text(const SimulatedLoop& loop) {
  const DeviceParameters& d = loop.device;
  std::string text =
      digits_of(d.mass_kg) + " kg damped with " + digits_of(d.damping_ns_per_m) + " N s/m";
  if (loop.turns && has_rotor(d)) {
    text += ", " + digits_of(d.rotor_inertia_kg_m2[0]) + " kg m2 with " +
            digits_of(d.rotor_damping_nms_per_rad[0]) + " N m s/rad";
  }
  return text + ", " + short_number(loop.rate_hz, 6) + " Hz, " + digits_of(1e3 * d.delay_s) +
         " ms late";
}

std::string text_of(const SimulatedGains& g, const SceneParameters& scene,
                    const SimulatedLoop& loop) {
  const CouplingParameters& c = scene.coupling;
  const bool proxy = scene.law == LawId::kProxy;
  const auto gains = [&](double k_t, double k_r) {
    return digits_of(k_t) + " N/m" +
           (proxy && loop.turns ? " and " + digits_of(k_r) + " N m/rad" : std::string());
  };
  return "the stiffness of the scene, " +
         (proxy ? gains(c.k_t_n_per_m, c.k_r_nm_per_rad) : gains(scene.k_f_n_per_m, 0)) +
         ", is more than the simulated device holds (" + device_text(loop) +
         "): " + (proxy ? gains(g.k_t_n_per_m, g.k_r_nm_per_rad) : gains(g.k_f_n_per_m, 0)) +
         " are rendered; a [device] table in the scene with the numbers of another states that "
         "one, "
         "[coupling] "
         "allow_active = true renders the scene as it is";
}

}  // namespace

void SimulatedGains::put(SceneParameters& parameters) const {
  parameters.k_f_n_per_m = k_f_n_per_m;
  parameters.coupling.k_t_n_per_m = k_t_n_per_m;
  parameters.coupling.k_r_nm_per_rad = k_r_nm_per_rad;
  parameters.coupling.damping_ns_per_m = damping_ns_per_m;
}

std::optional<SimulatedGains> simulated_gains(const SceneParameters& scene, double radius_m,
                                              const SimulatedLoop& loop) {
  if (scene.device.mass_kg > 0 || scene.coupling.allow_active != 0) return std::nullopt;
  const SceneParameters p = on_device(scene, loop);
  SimulatedGains gains;
  if (scene.law == LawId::kProxy) {
    gains = proxy_gains(p, radius_m, loop.turns);
  } else {
    const CouplingParameters& c = scene.coupling;
    gains = {c.k_t_n_per_m, c.k_r_nm_per_rad, c.damping_ns_per_m, scene.k_f_n_per_m, {}};
    gains.k_f_n_per_m =
        held(scene.k_f_n_per_m, passivity_budget(p, radius_m).limit_of("k_f_n_per_m"));
  }
  if (!is_lower(gains, scene)) return std::nullopt;
  gains.text = text_of(gains, scene, loop);
  return gains;
}

}  // namespace haptic::tools
