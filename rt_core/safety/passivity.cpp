// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/passivity.hpp"

#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

Real non_negative(Real value) noexcept {
  return std::isfinite(value) && value > 0.0_r ? value : 0.0_r;
}

double dot(const Vec3& l, const Vec3& r) noexcept {
  return (static_cast<double>(l.x()) * static_cast<double>(r.x()) +
          static_cast<double>(l.y()) * static_cast<double>(r.y())) +
         static_cast<double>(l.z()) * static_cast<double>(r.z());
}

}  // namespace

Passivity::Passivity(const PassivityLimits& limits) noexcept {
  limits_.l_m = non_negative(limits.l_m);
  limits_.alpha_max_ns_per_m = non_negative(limits.alpha_max_ns_per_m);
  limits_.energy_cap_j = non_negative(limits.energy_cap_j);
}

void Passivity::reset() noexcept {
  energy_j_ = 0;
  started_ = false;
  output_w_ = Wrench{};
  interval_s_ = 0;
  twist_w_ = Twist{};
}

// E_k = min(E_{k-1} - (F_{k-1}.dx_k + tau_{k-1}.dphi_k), E_cap), and the interval's twist.
template <bool kTurns>
void Passivity::observe(const PassivityInput& input) noexcept {
  if (!is_finite(input.grip_w) || !is_orientation(input.q_wa)) return;
  Vec3 dx = Vec3::Zero(), dphi = Vec3::Zero();
  if (started_) {
    dx = input.grip_w - grip_w_;
    // Rotation vector of R_k R_{k-1}^T.
    if constexpr (kTurns) dphi = so3_log(input.q_wa * q_wa_.conjugate());
    if (!is_finite(dx) || !is_finite(dphi)) return;
    const Wrench& said = input.accepted_valid ? input.accepted_w : output_w_;
    const Wrench acted = is_finite(said) ? said : Wrench{};
    double work_j = dot(acted.force_w, dx);
    if (kTurns) work_j += dot(acted.torque_w, dphi);
    const double energy_j = energy_j_ - work_j;
    const double cap_j = static_cast<double>(limits_.energy_cap_j);
    if (std::isfinite(energy_j)) energy_j_ = energy_j < cap_j ? energy_j : cap_j;
  }
  if (started_ && input.stamp_ns > stamp_ns_) {
    interval_s_ = seconds_between(stamp_ns_, input.stamp_ns);
    twist_w_ = {dx / interval_s_, dphi / interval_s_};
    if (input.twist_valid && is_finite(input.twist_w)) twist_w_ = input.twist_w;
    if (!kTurns) twist_w_.angular_w = Vec3::Zero();
    if (!is_finite(twist_w_)) twist_w_ = Twist{};
  }
  started_ = true;
  stamp_ns_ = input.stamp_ns;
  grip_w_ = input.grip_w;
  q_wa_ = input.q_wa;
}

PassivityResult Passivity::update(const PassivityInput& input) noexcept {
  return take<true>(input);
}

PassivityResult Passivity::update_place(const PassivityInput& input) noexcept {
  return take<false>(input);
}

template <bool kTurns>
PassivityResult Passivity::take(const PassivityInput& input) noexcept {
  observe<kTurns>(input);
  PassivityResult result;
  result.wrench_w = is_finite(input.command_w) ? input.command_w : Wrench{};
  result.energy_j = energy_j_;
  if (energy_j_ < 0.0 && interval_s_ > 0.0_r) {
    // alpha = min(-E_k / (T (|v|^2 + L^2 |w|^2)), alpha_max): all of the debt within one interval,
    // if the device moves on as it does. In double: squares of float velocities do not vanish.
    const double lever_m = static_cast<double>(limits_.l_m);
    double motion2 = dot(twist_w_.linear_w, twist_w_.linear_w);
    if (kTurns) motion2 += lever_m * lever_m * dot(twist_w_.angular_w, twist_w_.angular_w);
    const double loss_per_alpha = static_cast<double>(interval_s_) * motion2;
    const double most = static_cast<double>(limits_.alpha_max_ns_per_m);
    const bool partial = -energy_j_ < most * loss_per_alpha;
    const Real alpha = static_cast<Real>(partial ? -energy_j_ / loss_per_alpha : most);
    const Vec3 force_w = result.wrench_w.force_w - alpha * twist_w_.linear_w;
    Vec3 torque_w = result.wrench_w.torque_w;
    if (kTurns) torque_w -= (alpha * limits_.l_m * limits_.l_m) * twist_w_.angular_w;
    if (loss_per_alpha > 0.0 && is_finite(force_w) && is_finite(torque_w)) {
      result.acted = alpha > 0.0_r;
      result.alpha_ns_per_m = alpha;
      result.wrench_w = {force_w, torque_w};
    }
  }
  output_w_ = result.wrench_w;
  return result;
}

}  // namespace haptic
