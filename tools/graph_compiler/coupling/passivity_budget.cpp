// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/coupling/passivity_budget.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::tools {
namespace {

/// Position and velocity that a unit force gives an axis at rest within `t_s`.
struct Response {
  double x = 0.0, v = 0.0;
};

/// (1 - exp(-u)) / u and (u - 1 + exp(-u)) / u^2, without cancellation at small u.
double first_ramp(double u) { return u == 0.0 ? 1.0 : -std::expm1(-u) / u; }
double second_ramp(double u) {
  if (u > 0.05) return (u + std::expm1(-u)) / (u * u);
  double term = 0.5, sum = 0.0;
  for (int k = 3; k < 16; ++k) {
    sum += term;
    term *= -u / k;
  }
  return sum;
}

Response response(const SampledAxis& axis, double t_s) {
  const double u = axis.damping_ns_per_m * t_s / axis.mass_kg;
  return {t_s * t_s / axis.mass_kg * second_ramp(u), t_s / axis.mass_kg * first_ramp(u)};
}

/// The closed loop of an axis for any two gains. x(z) (z - 1)(z - decay) = g_k(z) F_k(z) summed
/// over both parts of the force: that of sample n - whole acts from `late` of a period on, that of
/// the sample before until then.
class Loop {
 public:
  explicit Loop(const SampledAxis& axis) {
    const double t = axis.period_s;
    const double delay = axis.delay_s / t;
    computable_ =
        delay <= kMaxDelayTicks && axis.window_ticks >= 1 && axis.window_ticks <= kMaxWindowTicks;
    if (!computable_) return;
    whole_ = static_cast<std::size_t>(delay + 1e-9);
    window_ = axis.window_ticks;
    span_s_ = static_cast<double>(window_) * t;
    const double late = std::max(0.0, delay - static_cast<double>(whole_));
    const double u = axis.damping_ns_per_m * t / axis.mass_kg;
    decay_ = std::exp(-u);
    const double path = t * first_ramp(u);
    const Response all = response(axis, t), newer = response(axis, (1.0 - late) * t);
    const Response older{all.x - newer.x, all.v - newer.v};
    newer_ = {newer.x, path * newer.v - decay_ * newer.x};
    older_ = {older.x, path * older.v - decay_ * older.x};
  }

  /// Schur and Cohn: all roots lie inside the unit circle iff every step finds |last| < |first|.
  [[nodiscard]] bool is_stable(double stiffness, double damping) const {
    if (!computable_) return false;
    std::array<double, 4 + kMaxDelayTicks + kMaxWindowTicks> p{};  // by descending powers
    p[0] = 1.0;
    p[1] = -1.0 - decay_;
    p[2] = decay_;
    const double rate = damping / span_s_;
    add(p, 0, stiffness + rate);
    add(p, window_, -rate);
    std::size_t last = 3 + whole_ + window_;
    while (last > 0 && p[last] == 0.0) --last;  // roots at zero
    for (; last > 0; --last) {
      const double reflection = p[last] / p[0];
      if (!(std::abs(reflection) < 1.0)) return false;
      for (std::size_t i = 0; 2 * i <= last; ++i) {
        const double front = p[i], back = p[last - i];
        p[i] = front - reflection * back;
        p[last - i] = back - reflection * front;
      }
    }
    return true;
  }

 private:
  /// Adds `gain` times position, `ticks` samples old, to the polynomial (times z^(whole + 1 + w)).
  template <typename Polynomial>
  void add(Polynomial& p, std::size_t ticks, double gain) const {
    for (std::size_t k = 0; k < 2; ++k) {
      p[1 + whole_ + k + ticks] += gain * newer_[k];
      p[2 + whole_ + k + ticks] += gain * older_[k];
    }
  }

  bool computable_ = false;
  std::size_t whole_ = 0, window_ = 1;
  double span_s_ = 0.0, decay_ = 1.0;
  std::array<double, 2> newer_{0, 0}, older_{0, 0};
};

/// Steps of a search per decade.
constexpr double kStepsPerDecade = 60.0;

/// First value at which `stable` fails on the way up from `low`, in steps of the search and by
/// halving; `high` when it never does, 0 when it fails at once.
template <typename Stable>
double boundary_between(double low, double high, const Stable& stable) {
  if (!stable(low)) return 0.0;
  const double factor = std::pow(10.0, 1.0 / kStepsPerDecade);
  double inside = low, outside = low * factor;
  while (outside < high && stable(outside)) {
    inside = outside;
    outside = inside * factor;
  }
  if (outside >= high) return high;
  for (int k = 0; k < 32; ++k) {
    const double middle = 0.5 * (inside + outside);
    (stable(middle) ? inside : outside) = middle;
  }
  return inside;
}

/// 4 m / T^2, beyond which no sampled spring is stable; 4 m / T likewise for dampers.
double largest_stiffness(const SampledAxis& axis) {
  return 4.0 * axis.mass_kg / (axis.period_s * axis.period_s);
}

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

/// The rotor's axis about which the least stiffness is stable, with a virtual damping of
/// `damping_per_stiffness_s` times the stiffness.
SampledAxis least_stable_rotor(const SceneParameters& p, double damping_per_stiffness_s) {
  SampledAxis least = translation_axis(p);
  double limit = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    SampledAxis axis = translation_axis(p);
    axis.mass_kg = p.device.rotor_inertia_kg_m2[k];
    axis.damping_ns_per_m = p.device.rotor_damping_nms_per_rad[k];
    const double stiffness = stiffness_boundary(axis, 0.0, damping_per_stiffness_s);
    if (k > 0 && stiffness >= limit) continue;
    least = axis;
    limit = stiffness;
  }
  return least;
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

bool is_stable(const SampledAxis& axis, double stiffness_n_per_m, double virtual_damping_ns_per_m) {
  return Loop(axis).is_stable(stiffness_n_per_m, virtual_damping_ns_per_m);
}

double stiffness_boundary(const SampledAxis& axis, double virtual_damping_ns_per_m,
                          double damping_per_stiffness_s) {
  const Loop loop(axis);
  const double most = largest_stiffness(axis);
  // Without damping of either kind the smallest spring already swings up.
  const double least = std::clamp(0.01 * first_order_stiffness(axis), 1e-9 * most, 1e-5 * most);
  return boundary_between(least, 2.0 * most, [&](double k) {
    return loop.is_stable(k, virtual_damping_ns_per_m + damping_per_stiffness_s * k);
  });
}

double damping_boundary(const SampledAxis& axis, double stiffness_n_per_m) {
  const Loop loop(axis);
  // With no spring at all the place is free, which is no instability.
  const double k = std::max(stiffness_n_per_m, 1e-7 * largest_stiffness(axis));
  const double most = 4.0 * axis.mass_kg / axis.period_s;
  const auto stable = [&](double b) { return loop.is_stable(k, b); };
  double low = 1e-4 * most;
  const double factor = std::pow(10.0, 1.0 / kStepsPerDecade);
  while (low < most && !stable(low)) low *= factor;
  return low < most ? boundary_between(low, 2.0 * most, stable) : 0.0;
}

double calm_stiffness(const SampledAxis& axis) {
  const double boundary = stiffness_boundary(axis, 0.0);
  return boundary > 0.0 ? boundary / kCalmMargin : std::numeric_limits<double>::max();
}

double first_order_stiffness(const SampledAxis& axis) {
  return axis.damping_ns_per_m / (0.5 * axis.period_s + axis.delay_s);
}

double first_order_damping(const SampledAxis& axis) {
  const double d = axis.delay_s / axis.period_s;
  return 2.0 * axis.mass_kg / axis.period_s * std::tan(std::numbers::pi / (4.0 * (d + 1.0)));
}

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
  const double b = proxy ? p.coupling.damping_ns_per_m : 0.0;
  // The coupling damps rotation with B L^2 = (B / k_t) k_r, which follows k_r.
  const double damping_per_stiffness_s = proxy ? b / p.coupling.k_t_n_per_m : 0.0;
  budget.rotor_assumed = !has_rotor(d);
  if (budget.rotor_assumed) {
    const double r = proxy ? kAssumedRotorRadius_m : kDirectRotorShare * radius_m;
    budget.rotation_radius_m = r;
    budget.rotation.mass_kg *= r * r;
    budget.rotation.damping_ns_per_m *= r * r;
  } else {
    budget.rotation = least_stable_rotor(p, damping_per_stiffness_s);
    budget.rotation_radius_m = std::sqrt(budget.rotation.mass_kg / d.mass_kg);
  }
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
    const AxisLimits turn{
        stiffness_boundary(budget.rotation, 0.0, damping_per_stiffness_s) / kBudgetMargin,
        damping_boundary(budget.rotation, k_r) / kBudgetMargin};
    budget.states.push_back({"rotation", "k_r_nm_per_rad", 1.0, turn.stiffness, turn.damping, k_r});
  } else {
    // k_F r_A^2 at the largest lever, against the rotor.
    const double lever_m2 = radius_m * radius_m;
    const AxisLimits turn = limits(budget.rotation, p.k_f_n_per_m * lever_m2, 0.0);
    budget.states.push_back({"rotation, contact at the largest lever", "k_f_n_per_m", lever_m2,
                             turn.stiffness / lever_m2, turn.damping, p.k_f_n_per_m});
  }
  return budget;
}

}  // namespace haptic::tools
