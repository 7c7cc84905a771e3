// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/output.hpp"

#include <cmath>

namespace haptic {
namespace {

/// Largest balance that the passivity observer credits to later intervals: what a press of 1 mm at
/// 2 N stores.
constexpr double kEnergyCap_j = 1.0e-3;

}  // namespace

void OutputStage::place(Arena& arena, const SceneView& scene) noexcept {
  arena.enter(StatePart::kOutput);
  twist_ = arena.take<TwistEstimator>(scene.parameters().device.given != 0 ? 1 : 0);
}

void OutputStage::read_scene(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  const CouplingParameters& c = p.coupling;
  const DeviceParameters& d = p.device;
  period_ns_ = static_cast<std::int64_t>(1.0e9 / p.rate_hz);
  observes_ = c.passivity != 0;
  never_turns_ = scene.is_fixed();
  law_ = p.law;
  PassivityLimits passivity;
  passivity.l_m = static_cast<Real>(std::sqrt(c.k_r_nm_per_rad / c.k_t_n_per_m));
  passivity.alpha_max_ns_per_m = kControllerShare * static_cast<Real>(d.mass_kg * p.rate_hz);
  passivity.energy_cap_j = static_cast<Real>(kEnergyCap_j);
  passivity_ = Passivity(passivity);
  WrenchRampLimits ramp;
  ramp.slew_n_per_s = static_cast<Real>(d.max_force_rate_n_per_s);
  ramp.slew_nm_per_s = static_cast<Real>(d.max_torque_rate_nm_per_s);
  ramp_ = WrenchRamp(ramp);
  TwistWindow window;
  window.step_m = static_cast<Real>(d.encoder_step_m);
  window.step_rad = static_cast<Real>(d.encoder_step_rad);
  window.min_window_s = static_cast<Real>(c.min_window_s);
  window.max_window_s = static_cast<Real>(c.max_window_s);
  for (TwistEstimator& estimator : twist_) estimator = TwistEstimator(window);
}

void OutputStage::reset() noexcept {
  if (kSceneTraits.device) passivity_.reset();
  ramp_.reset();
  if (kSceneTraits.device) {
    for (TwistEstimator& estimator : twist_) estimator.reset();
  }
  has_stamp_ = false;
}

std::int64_t OutputStage::stamp_of(const StepInput& input) const noexcept {
  if (input.stamp_ns != 0) return input.stamp_ns;
  return has_stamp_ ? stamp_ns_ + period_ns_ : 0;
}

Output OutputStage::finish(const LawWrench& law, const GripPose& device, const StepInput& input,
                           std::uint32_t flags) noexcept {
  Output out;
  const std::int64_t stamp_ns = stamp_of(input);
  constexpr std::uint32_t kOut = kFlagClutched | kFlagRecovery | kFlagOutsideEnvelope;
  if ((flags & kOut) != 0) {
    if (!has_stamp_) ramp_.reset(false);  // there is no wrench yet that could be ramped out
    ramp_.ramp_out();
  } else {
    ramp_.ramp_in();
  }
  const RampedWrench ramped = ramp_.update(stamp_ns, law.wrench_w);
  out.wrench_w = ramped.wrench_w;
  if (ramped.state != RampState::kIn) out.flags |= kFlagRamping;
  // Ramping out, and for a wrench that is not finite, the ramp's is an earlier one.
  const bool follows = ramped.state != RampState::kRampingOut && is_finite(law.wrench_w);
  const Wrench& pull = law.spring_w;
  out.spring_w =
      follows ? Wrench{ramped.gain * pull.force_w, ramped.gain * pull.torque_w} : ramped.wrench_w;
  const bool translates = device_translates();
  if (kSceneTraits.device && observes_) {
    PassivityInput in;
    in.stamp_ns = stamp_ns;
    in.grip_w = device.x0_w;
    in.q_wa = device.q_wa;
    in.twist_w = input.twist_w;
    in.twist_valid = input.twist_valid;
    in.accepted_w = input.accepted_wrench_w;
    in.accepted_valid = input.accepted_valid;
    in.command_w = out.wrench_w;
    const PassivityResult passive =
        translates ? passivity_.update_place(in) : passivity_.update(in);
    out.wrench_w = passive.wrench_w;
    out.energy_j = static_cast<Real>(passive.energy_j);
    if (passive.acted) out.flags |= kFlagPassivity;
  }
  if (kSceneTraits.device && !twist_.empty()) {
    TwistEstimator& estimator = twist_.front();
    const TwistSample sample{stamp_ns, device.x0_w, device.q_wa, input.twist_w, input.twist_valid};
    const TwistEstimate twist =
        translates ? estimator.update_place(sample) : estimator.update(sample);
    out.device_twist_w = twist.twist_w;
  }
  stamp_ns_ = stamp_ns;
  has_stamp_ = true;
  return out;
}

}  // namespace haptic
