// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/output.hpp"

#include <algorithm>

namespace haptic {
namespace {

/// True if anything asks how fast the device moves.
bool needs_twist(const SceneParameters& p) noexcept {
  return p.device.given != 0 || p.coupling.passivity != 0 || p.coupling.damping_ns_per_m > 0;
}

/// The device as the passivity layer counts on it: of a rotor, its lightest axis. Without one what
/// makes a turn count like a displacement at the coupling's length, so that a stiffness of rotation
/// is within its bound where that of translation is.
PassivityLimits passivity_limits(const SceneParameters& p) noexcept {
  const DeviceParameters& d = p.device;
  const CouplingParameters& c = p.coupling;
  const double length2 = c.k_r_nm_per_rad / c.k_t_n_per_m;
  PassivityLimits limits;
  limits.mass_kg = static_cast<Real>(d.mass_kg);
  limits.damping_ns_per_m = static_cast<Real>(d.damping_ns_per_m);
  const auto least = [](const double(&v)[3]) { return std::min({v[0], v[1], v[2]}); };
  const bool rotor = least(d.rotor_inertia_kg_m2) > 0.0;
  limits.rotor_kg_m2 =
      static_cast<Real>(rotor ? least(d.rotor_inertia_kg_m2) : d.mass_kg * length2);
  limits.rotor_damping_nms_per_rad =
      static_cast<Real>(rotor ? least(d.rotor_damping_nms_per_rad) : d.damping_ns_per_m * length2);
  // Play leaves every axis up to one step ahead.
  const double k = p.law == LawId::kProxy ? c.k_t_n_per_m : p.k_f_n_per_m;
  const double step2 =
      d.encoder_step_m * d.encoder_step_m + length2 * d.encoder_step_rad * d.encoder_step_rad;
  limits.noise_j = static_cast<Real>(1.5 * k * step2);
  return limits;
}

/// V at the played pose, `ahead` of which the goal was sensed: along the pull, as the surface that
/// holds the proxy goes along with what lies across it; zero where the pull ends before.
StoredEnergy stored_at_play(const LawWrench& law, const PlayedPose& played) noexcept {
  const double stored_j = law.stored.linear_j + law.stored.angular_j;
  if (!(stored_j > 0.0)) return {};
  const Wrench& pull = law.spring_w;
  const double gained_j = static_cast<double>(pull.force_w.dot(played.ahead_m)) +
                          static_cast<double>(pull.torque_w.dot(played.ahead_rad));
  // The spring's stretch as a share of what it is at the sensed pose; V goes with its square.
  const double stretch = std::max(0.0, 1.0 + gained_j / (2.0 * stored_j));
  const double square = stretch * stretch;
  return {square * law.stored.linear_j, square * law.stored.angular_j};
}

}  // namespace

void OutputStage::place(Arena& arena, const SceneView& scene) noexcept {
  arena.enter(StatePart::kOutput);
  twist_ = arena.take<TwistEstimator>(needs_twist(scene.parameters()) ? 1 : 0);
}

void OutputStage::read_scene(const SceneView& scene) noexcept {
  const SceneParameters& p = scene.parameters();
  const CouplingParameters& c = p.coupling;
  const DeviceParameters& d = p.device;
  period_ns_ = static_cast<std::int64_t>(1.0e9 / p.rate_hz);
  observes_ = c.passivity != 0;
  locked_ = scene.is_locked();
  law_ = p.law;
  passivity_ = Passivity(passivity_limits(p));
  WrenchRampLimits ramp;
  ramp.slew_n_per_s = static_cast<Real>(d.max_force_rate_n_per_s);
  ramp.slew_nm_per_s = static_cast<Real>(d.max_torque_rate_nm_per_s);
  ramp_ = WrenchRamp(ramp);
  TwistWindow window;
  window.step_m = static_cast<Real>(d.encoder_step_m);
  window.step_rad = static_cast<Real>(d.encoder_step_rad);
  window.min_window_s = static_cast<Real>(c.min_window_s);
  window.max_window_s = static_cast<Real>(c.max_window_s);
  play_ = EncoderPlay(window.step_m, window.step_rad);
  for (TwistEstimator& estimator : twist_) estimator = TwistEstimator(window);
}

void OutputStage::reset() noexcept {
  if (kSceneTraits.device) {
    passivity_.reset();
    play_.reset();
  }
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

DeviceMotion OutputStage::sense(const GripPose& device, const StepInput& input) noexcept {
  DeviceMotion motion;
  motion.accepted_w = input.accepted_wrench_w;
  if (!kSceneTraits.device || twist_.empty()) return motion;
  const bool translates = device_translates();
  motion.played = translates ? play_.update_place(device.x0_w, device.q_wa)
                             : play_.update(device.x0_w, device.q_wa);
  const TwistSample sample{stamp_of(input), motion.played.grip_w, motion.played.q_wa, input.twist_w,
                           input.twist_valid};
  TwistEstimator& estimator = twist_.front();
  motion.twist = translates ? estimator.update_place(sample) : estimator.update(sample);
  return motion;
}

Output OutputStage::finish(const LawWrench& law, const DeviceMotion& device, const StepInput& input,
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
  if (kSceneTraits.device && observes_) {
    PassivityInput in;
    in.stamp_ns = stamp_ns;
    in.way_m = device.played.way_m;
    in.turn_rad = device.played.turn_rad;
    in.twist_w = device.twist.twist_w;
    in.twist_valid = device.twist.valid;
    in.stored = stored_at_play(law, device.played);
    in.stores = law.stores;
    in.given_j = law.given_j;
    in.gain = ramped.gain;
    in.fading = !follows || ramped.state == RampState::kOut;
    in.accepted_w = device.accepted_w;
    in.accepted_valid = input.accepted_valid;
    in.command_w = out.wrench_w;
    const PassivityResult passive =
        device_translates() ? passivity_.update_place(in) : passivity_.update(in);
    out.wrench_w = passive.wrench_w;
    out.energy_j = static_cast<Real>(-passive.debt_j);
    if (passive.acted) out.flags |= kFlagPassivity;
  }
  out.device_twist_w = device.twist.twist_w;
  stamp_ns_ = stamp_ns;
  has_stamp_ = true;
  return out;
}

}  // namespace haptic
