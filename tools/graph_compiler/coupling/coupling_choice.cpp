// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/coupling/coupling_choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rt_core/scene/capacity.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::tools {
namespace {

/// Error at which a derived rotary spring may reach the device's largest torque, at least [rad]:
/// about a degree, far above a hand's tremor, so that the torque does not switch.
constexpr double kLeastFullTurn_rad = 0.02;

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

class Choice {
 public:
  Choice(const SceneParameters& parameters, const CouplingRequest& request, double radius_m,
         bool never_turns, const std::string& file)
      : request_(request),
        radius_m_(radius_m),
        never_turns_(never_turns),
        file_(file),
        parameters_(parameters) {}

  CouplingChoice make() {
    const DeviceParameters& device = parameters_.device;
    CouplingParameters& c = parameters_.coupling;
    c.allow_active = request_.allow_active ? 1 : 0;
    c.passes = request_.passes.value_or(kDefaultProxyPasses);
    c.tolerance_m = request_.tolerance_m.value_or(0.0);
    // The format has 0 for a height by the size, and below 0 for none.
    c.climb_m = !request_.climb_m ? 0.0 : *request_.climb_m > 0.0 ? *request_.climb_m : -1.0;
    c.passivity = request_.passivity.value_or(device.mass_kg > 0.0) ? 1 : 0;
    c.damping_share = request_.damping_share.value_or(kDefaultDampingShare);
    c.min_window_s = request_.min_window_s.value_or(kDefaultMinWindow_s);
    c.max_window_s = request_.max_window_s.value_or(std::max(kDefaultMaxWindow_s, c.min_window_s));
    c.damping_ns_per_m = 0.0;
    c.k_t_n_per_m = request_.k_t_n_per_m.value_or(parameters_.k_f_n_per_m);
    c.k_r_nm_per_rad = 0.0;
    complete_coupling(parameters_, radius_m_);
    choose_damping();
    choose_stiffness();
    c.max_rotation_error_rad = request_.max_rotation_error_rad.value_or(
        limited(kDefaultRotationError_rad, device.max_torque_nm, c.k_r_nm_per_rad));
    c.max_translation_error_m = request_.max_translation_error_m.value_or(
        device.max_force_n > 0.0 ? limited(kMaxSceneLength_m, device.max_force_n, c.k_t_n_per_m)
                                 : 0.0);
    c.max_pull_n = device.max_force_n;
    c.max_turn_nm = device.max_torque_nm;
    if (!request_.allow_active) refuse_beyond(passivity_budget(parameters_, radius_m_));
    return {c, std::move(notes_)};
  }

 private:
  /// Error at which the spring reaches the device's limit, where it has one; at most `most`.
  static double limited(double most, double limit, double stiffness) {
    return limit > 0.0 ? std::min(most, limit / stiffness) : most;
  }

  void choose_damping() {
    CouplingParameters& c = parameters_.coupling;
    const DeviceParameters& device = parameters_.device;
    if (request_.damping_ns_per_m) {
      c.damping_ns_per_m = *request_.damping_ns_per_m;
      return;
    }
    if (device.given == 0) return;
    double b = kDefaultDamping_ns_per_m;
    if (!request_.allow_active) {
      if (device.max_damping_ns_per_m > 0.0) b = std::min(b, device.max_damping_ns_per_m);
      const PassivityBudget budget = passivity_budget(parameters_, radius_m_);
      if (budget.unchecked.empty()) {
        b = std::min(b, kDerivedDampingShare * budget.damping_limit_ns_per_m);
      }
    }
    if (b < kDefaultDamping_ns_per_m) {
      note("damping_ns_per_m is " + number(b) + " N s/m instead of " +
           number(kDefaultDamping_ns_per_m));
    }
    c.damping_ns_per_m = b;
  }

  void choose_stiffness() {
    CouplingParameters& c = parameters_.coupling;
    const double length_m = request_.length_m.value_or(kDefaultLengthShare * radius_m_);
    const auto rotary = [&] {
      return request_.k_r_nm_per_rad.value_or(c.k_t_n_per_m * length_m * length_m);
    };
    c.k_r_nm_per_rad = rotary();
    if (request_.allow_active || parameters_.law != LawId::kProxy) return;
    if (!request_.k_t_n_per_m) bound_translation();
    c.k_r_nm_per_rad = rotary();
    if (!request_.k_r_nm_per_rad && !request_.length_m) bound_rotation();
    note_assumed_rotor();
  }

  void bound_translation() {
    CouplingParameters& c = parameters_.coupling;
    const double wanted = c.k_t_n_per_m;
    const double most = parameters_.device.max_stiffness_n_per_m;
    if (most > 0.0) c.k_t_n_per_m = std::min(c.k_t_n_per_m, most);
    const PassivityBudget budget = passivity_budget(parameters_, radius_m_);
    if (budget.unchecked.empty() && budget.damping_holds()) {
      const double limit = budget.limit_of("k_t_n_per_m");
      if (!(limit > 0.0)) fail(request_.k_f_at, "k_f_n_per_m", unstable_words(budget));
      c.k_t_n_per_m = std::min({c.k_t_n_per_m, limit, calm_stiffness(budget.translation)});
    }
    if (c.k_t_n_per_m == wanted) return;
    note("k_t_n_per_m is " + number(c.k_t_n_per_m) + " N/m instead of " + number(wanted) +
         " (k_F)");
  }

  /// A derived rotary stiffness is what the rotor holds and the motors render.
  void bound_rotation() {
    CouplingParameters& c = parameters_.coupling;
    const DeviceParameters& d = parameters_.device;
    const double wanted = c.k_r_nm_per_rad;
    double most = wanted;
    if (d.max_rotary_stiffness_nm_per_rad > 0.0) {
      most = std::min(most, d.max_rotary_stiffness_nm_per_rad);
    }
    if (d.max_torque_nm > 0.0) most = std::min(most, d.max_torque_nm / kLeastFullTurn_rad);
    const PassivityBudget budget = passivity_budget(parameters_, radius_m_);
    if (budget.unchecked.empty()) {
      const double limit = budget.limit_of("k_r_nm_per_rad");
      // Without damping of its own no rotor comes to rest within an encoder's last digit.
      if (!(limit > 0.0) || !(budget.rotation.damping_ns_per_m > 0.0)) {
        fail(
            request_.k_f_at, "k_r_nm_per_rad",
            "no rotary stiffness is stable on this device, whose rotor is damped with " +
                number(budget.rotation.damping_ns_per_m) +
                " N m s/rad of its own; give [device] rotor_damping_nms_per_rad, change [coupling] "
                "damping_ns_per_m, or set allow_active = true");
      }
      most = std::min({most, limit, calm_stiffness(budget.rotation)});
    }
    if (!(most < wanted)) return;
    c.k_r_nm_per_rad = most;
    note("k_r_nm_per_rad is " + number(most) + " N m/rad instead of " + number(wanted) +
         " (k_t L^2)");
  }

  void note_assumed_rotor() {
    const DeviceParameters& d = parameters_.device;
    if (d.given == 0 || !(d.mass_kg > 0.0) || has_rotor(d) || never_turns_) return;
    const double r2 = kAssumedRotorRadius_m * kAssumedRotorRadius_m;
    notes_.push_back(
        "[device] gives no rotor_inertia_kg_m2: rotation is bounded for a light rotor, " +
        number(d.mass_kg * r2) + " kg m2 and " + number(d.damping_ns_per_m * r2) +
        " N m s/rad (mass and damping at " + number(1e3 * kAssumedRotorRadius_m) + " mm)");
  }

  void note(const std::string& words) {
    notes_.push_back("[coupling] " + words + ", which is all that [device] can hold");
  }

  [[noreturn]] void fail(const FilePlace& at, const std::string& key,
                         const std::string& words) const {
    throw InputError(file_ + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) +
                     ": " + key + ": " + words);
  }

  static std::string unstable_words(const PassivityBudget& budget) {
    return "no stiffness is stable on this device, damped with " +
           number(budget.translation.damping_ns_per_m) + " N s/m of its own and " +
           number(budget.virtual_damping_ns_per_m) +
           " of the coupling; give [device] damping_ns_per_m, change [coupling] damping_ns_per_m, "
           "or set allow_active = true";
  }

  void refuse_beyond(const PassivityBudget& budget) const {
    if (!budget.unchecked.empty() || budget.holds()) return;
    const std::string fix = "; give at most that, or set [coupling] allow_active = true";
    if (!budget.damping_holds()) {
      fail(request_.damping_at, "damping_ns_per_m",
           "is " + number(budget.virtual_damping_ns_per_m) + " N s/m, the device is safe up to " +
               number(budget.damping_limit_ns_per_m) + fix);
    }
    for (const ContactStateBudget& state : budget.states) {
      if (state.holds() || state.stiffness > budget.limit_of(state.gain)) continue;
      const std::string gain = state.gain;
      const FilePlace& at = gain == "k_f_n_per_m"   ? request_.k_f_at
                            : gain == "k_t_n_per_m" ? request_.k_t_at
                                                    : request_.k_r_at;
      if (!(state.stiffness > 0.0)) fail(at, gain, unstable_words(budget));
      fail(at, gain,
           "is " + number(state.given) + ", the device is safe up to " + number(state.stiffness) +
               " (" + state.state + ")" + fix);
    }
  }

  const CouplingRequest& request_;
  double radius_m_;
  bool never_turns_;
  const std::string& file_;
  SceneParameters parameters_;
  std::vector<std::string> notes_;
};

}  // namespace

CouplingChoice choose_coupling(const SceneParameters& parameters, const CouplingRequest& request,
                               double radius_m, bool never_turns, const std::string& file) {
  return Choice(parameters, request, radius_m, never_turns, file).make();
}

}  // namespace haptic::tools
