// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Passivity observer and controller (METHOD section 9.2). The law's wrench is the gradient of the
/// energy V that its spring stores, and the proxy only lowers V; what sampling and delay generate
/// in an interval is therefore known: the change of V and the work of the wrench that acted. The
/// device's own damping takes some of it out by itself; the rest is kept as a debt, which the
/// controller pays by a damper while there is contact. Fixed cost, no loops but over the last few
/// outputs.

#include <array>
#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// The controller's largest damping as a share of m / T. The damper acts after sampling and delay
/// itself: with one sample of delay m / T diverges, and half of it does worse than a quarter.
inline constexpr Real kControllerShare = 0.25_r;
/// In free space the debt fades with this time constant, so that a bounce still pays at the next
/// touch.
inline constexpr Real kDebtFades_s = 1.0_r;
/// What the device's damping takes out beyond what is generated serves the intervals after it, by
/// this share from each to the next: within a cycle both take turns.
inline constexpr double kSpareShare = 0.8;
/// Outputs of which one is what acts now: a period of computation, and delay.
inline constexpr std::uint32_t kPendingOutputs = 4;

/// The device: lower bounds of its own damping, and inertias for the controller's largest. A value
/// that is not finite or negative counts as 0: no damping of its own, no controller.
struct PassivityLimits {
  Real mass_kg = 0, damping_ns_per_m = 0;
  Real rotor_kg_m2 = 0, rotor_damping_nms_per_rad = 0;
  /// Energy that the encoders' last digits make up between two poses; so much debt is not paid. [J]
  Real noise_j = 0;
};

/// Energy of the law's spring, in translation and in rotation [J].
struct StoredEnergy {
  double linear_j = 0, angular_j = 0;
};

/// One tick. Everything in W axes, torque about the grip point.
struct PassivityInput {
  std::int64_t stamp_ns = 0;  ///< of the device's report
  /// Way of the device since the last call, of the pose after play (base/encoder_play.hpp).
  Vec3 way_m = Vec3::Zero(), turn_rad = Vec3::Zero();
  Twist twist_w;             ///< over an adaptive window of that pose (base/twist_estimator.hpp)
  bool twist_valid = false;  ///< else the controller waits
  /// V at the played pose with the proxy of this tick. Not given: laws without a potential; then
  /// the work of their own wrench, half of it before and half after the way, stands for its change.
  StoredEnergy stored;
  bool stores = false;
  /// Share of V's change in this interval: what other parts that move have given the spring, less
  /// what it gave them: no energy that the rendering has made [J].
  double given_j = 0;
  /// The gain that a ramp in has put on the law's wrench in `command_w`.
  Real gain = 1;
  /// The wrench is not the law's: a ramp out fades it. It is passed on, nothing is counted.
  bool fading = false;
  /// The wrench that acted on the device from the last report to this one, after delay and every
  /// limit behind this layer. Not valid: this layer's last output.
  Wrench accepted_w;
  bool accepted_valid = false;
  Wrench command_w;  ///< what is to act from now on
};

struct PassivityResult {
  Wrench wrench_w;          ///< command_w, less the damper's wrench; never a pull against it
  double debt_j = 0;        ///< G: generated and not yet taken out, >= 0
  Real alpha_ns_per_m = 0;  ///< damping in force, in translation
  bool acted = false;       ///< the damper changed the wrench
};

/// Owner: the servo thread. Memory: sizeof(Passivity); no heap. Same input, same bits.
///
/// The account needs no clock: every way between two calls counts, also under equal, backward or
/// far apart stamps; device damping is credited, and the controller acts, only where the stamp is
/// newer. A number that is not finite never enters: a way counts as none, a wrench as zero.
class Passivity {
 public:
  Passivity() noexcept = default;
  explicit Passivity(const PassivityLimits& limits) noexcept;

  /// Counts the interval that ends now and damps the wrench of the next one.
  PassivityResult update(const PassivityInput& input) noexcept;
  /// The same of a device that only translates: no torque does work on it, and none damps it.
  PassivityResult update_place(const PassivityInput& input) noexcept;

  /// No debt, no last energy: the next tick has no interval behind it.
  void reset() noexcept;

 private:
  template <bool kTurns>
  PassivityResult take(const PassivityInput& input) noexcept;
  template <bool kTurns>
  [[nodiscard]] double generated_j(const PassivityInput& input,
                                   const Wrench& command) const noexcept;
  [[nodiscard]] double passed_on(const Vec3& accepted, std::size_t part) const noexcept;
  [[nodiscard]] double ignored_j(const PassivityInput& input) const noexcept;
  template <bool kTurns>
  void pay(const PassivityInput& input, PassivityResult& result) const noexcept;

  PassivityLimits limits_;
  double debt_j_ =
      0;  ///< G, below 0: spare. Double in every build: a tick adds far less than it is
  bool counts_ = false;  ///< the last tick's wrench and energy are the law's
  bool started_ = false;
  std::int64_t stamp_ns_ = 0;
  StoredEnergy stored_;
  Real gain_ = 1;
  Wrench command_w_, output_w_;
  /// Squares of the last outputs, newest first: {force, torque}.
  std::array<std::array<double, 2>, kPendingOutputs> pending2_{};
};

}  // namespace haptic
