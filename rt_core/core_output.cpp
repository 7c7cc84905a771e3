// SPDX-License-Identifier: Apache-2.0
// From the law's wrench to the output: coupling damping, ramps and passivity.
#include <algorithm>
#include <cmath>

#include "rt_core/core_state.hpp"

namespace haptic {
namespace {

/// Filter of the rate of the coupling's error: share of the newest difference.
constexpr Real kRateShare = 0.75_r;
/// Largest balance that the passivity observer credits to later intervals: what a press of 1 mm at
/// 2 N stores.
constexpr double kEnergyCap_j = 1.0e-3;

/// Damping `d` beside the spring's pull `s`: it may take back no more than `share` of the pull,
/// and nothing where there is none.
Vec3 limited_damping(const Vec3& d, const Vec3& s, Real share) noexcept {
  const Real pull2 = s.squaredNorm();
  if (!(pull2 > 0)) return Vec3::Zero();
  const Real along = d.dot(s) / pull2;
  return along < -share ? Vec3(d + s * (-share - along)) : d;
}

}  // namespace

void HapticCore::State::configure_output() noexcept {
  const SceneParameters& p = scene.parameters();
  const CouplingParameters& c = p.coupling;
  const DeviceParameters& d = p.device;
  output.period_ns = static_cast<std::int64_t>(1.0e9 / p.rate_hz);
  output.damping_ns_per_m = has_law(LawId::kProxy) ? static_cast<Real>(c.damping_ns_per_m) : 0;
  output.damping_share = static_cast<Real>(c.damping_share);
  output.observes = c.passivity != 0;
  PassivityLimits passivity;
  passivity.l_m = static_cast<Real>(std::sqrt(c.k_r_nm_per_rad / c.k_t_n_per_m));
  passivity.alpha_max_ns_per_m = kControllerShare * static_cast<Real>(d.mass_kg * p.rate_hz);
  passivity.energy_cap_j = static_cast<Real>(kEnergyCap_j);
  output.passivity = Passivity(passivity);
  WrenchRampLimits ramp;
  ramp.slew_n_per_s = static_cast<Real>(d.max_force_rate_n_per_s);
  ramp.slew_nm_per_s = static_cast<Real>(d.max_torque_rate_nm_per_s);
  output.ramp = WrenchRamp(ramp);
  TwistWindow window;
  window.step_m = static_cast<Real>(d.encoder_step_m);
  window.step_rad = static_cast<Real>(c.encoder_step_rad);
  window.min_window_s = static_cast<Real>(c.min_window_s);
  window.max_window_s = static_cast<Real>(c.max_window_s);
  for (TwistEstimator& estimator : output.twist) estimator = TwistEstimator(window);
}

void HapticCore::State::forget_output() noexcept {
  if (kSceneTraits.passivity) output.passivity.reset();
  output.ramp.reset();
  if (kSceneTraits.device_twist) {
    for (TwistEstimator& estimator : output.twist) estimator.reset();
  }
  output.has_error = output.has_stamp = false;
  output.rate = PoseError{};
}

/// Time of this report; without stamps ticks are a period apart.
std::int64_t HapticCore::State::stamp_of(const StepInput& input) noexcept {
  if (input.stamp_ns != 0) return input.stamp_ns;
  return output.has_stamp ? output.stamp_ns + output.period_ns : 0;
}

/// Coupling damping B (p' - q_d') in translation and B L^2 in rotation, of the filtered backward
/// difference of the error over the real time between reports.
void HapticCore::State::damp(const PoseError& error, std::int64_t stamp_ns,
                             Wrench& wrench) noexcept {
  const std::int64_t elapsed_ns = stamp_ns - output.stamp_ns;
  if (output.has_error && output.has_stamp && elapsed_ns > 0) {
    const Real per_s = 1.0e9_r / static_cast<Real>(elapsed_ns);
    const auto follow = [per_s](Vec3& rate, const Vec3& now, const Vec3& before) {
      rate += kRateShare * (per_s * (now - before) - rate);
    };
    follow(output.rate.translation_m, error.translation_m, output.error.translation_m);
    follow(output.rate.rotation_rad, error.rotation_rad, output.error.rotation_rad);
  }
  output.error = error;
  output.has_error = true;
  const Real b = output.damping_ns_per_m;
  const Real b_r = b * spring.length_m * spring.length_m;
  wrench.force_w +=
      limited_damping(-b * output.rate.translation_m, wrench.force_w, output.damping_share);
  wrench.torque_w +=
      limited_damping(-b_r * output.rate.rotation_rad, wrench.torque_w, output.damping_share);
}

/// Last stages before the device: ramps where the wrench must not act, and energy. Takes the law's
/// spring part in `result` along.
Wrench HapticCore::State::finish(const Wrench& law_wrench, const GripPose& device,
                                 const StepInput& input, StepResult& result) noexcept {
  const std::int64_t stamp_ns = stamp_of(input);
  constexpr std::uint32_t kOut = kFlagClutched | kFlagRecovery | kFlagOutsideEnvelope;
  if ((result.flags & kOut) != 0) {
    if (tick == 1) output.ramp.reset(false);  // there is no wrench yet that could be ramped out
    output.ramp.ramp_out();
  } else {
    output.ramp.ramp_in();
  }
  const RampedWrench ramped = output.ramp.update(stamp_ns, law_wrench);
  Wrench wrench = ramped.wrench_w;
  if (ramped.state != RampState::kIn) result.flags |= kFlagRamping;
  // Ramping out, and for a wrench that is not finite, the ramp's is an earlier one.
  const bool follows = ramped.state != RampState::kRampingOut && is_finite(law_wrench);
  const Wrench& pull = result.spring_w;
  result.spring_w =
      follows ? Wrench{ramped.gain * pull.force_w, ramped.gain * pull.torque_w} : ramped.wrench_w;
  if (kSceneTraits.passivity && output.observes) {
    PassivityInput in;
    in.stamp_ns = stamp_ns;
    in.grip_w = device.x0_w;
    in.q_wa = device.q_wa;
    in.twist_w = input.twist_w;
    in.twist_valid = input.twist_valid;
    in.accepted_w = input.accepted_wrench_w;
    in.accepted_valid = input.accepted_valid;
    in.command_w = wrench;
    const PassivityResult passive =
        device_translates() ? output.passivity.update_place(in) : output.passivity.update(in);
    wrench = passive.wrench_w;
    result.energy_j = static_cast<Real>(passive.energy_j);
    if (passive.acted) result.flags |= kFlagPassivity;
  }
  if (kSceneTraits.device_twist && !output.twist.empty()) {
    TwistEstimator& estimator = output.twist.front();
    const TwistSample sample{stamp_ns, device.x0_w, device.q_wa, input.twist_w, input.twist_valid};
    const TwistEstimate twist =
        device_translates() ? estimator.update_place(sample) : estimator.update(sample);
    result.device_twist_w = twist.twist_w;
  }
  output.stamp_ns = stamp_ns;
  output.has_stamp = true;
  return wrench;
}

}  // namespace haptic
