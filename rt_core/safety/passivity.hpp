// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Passivity observer and controller (METHOD section 9). The force held over an interval does
/// exactly F.dx + tau.dphi on the device, for any device; the observer sums what the hand
/// has put in and not got back. Where that falls below zero the rendering has made energy, and the
/// controller takes it out again with a damper over the next interval. Fixed cost, no loops.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// alpha_max as a share of m / T. The damper acts after sampling and delay itself: with one sample
/// of delay m / T diverges, 0.25 to 0.5 m / T hold next to a stiff contact.
inline constexpr Real kControllerShare = 0.25_r;

/// Parameters. A value that is not finite or negative counts as 0.
struct PassivityLimits {
  Real l_m =
      0;  ///< L: lever that makes a turn comparable to a translation; 0: torque is left alone
  /// Largest damping of the controller [N s/m]; kControllerShare m / T for a device of mass m and
  /// sample time T. 0: the controller never acts, the observer still counts.
  Real alpha_max_ns_per_m = 0;
  /// Largest balance that is credited to later intervals [J]. Small: a long free or damped phase
  /// does not pay for a later oscillation. 0: none of it.
  Real energy_cap_j = 0;
};

/// One tick. Everything in W axes, torque about the grip point.
struct PassivityInput {
  std::int64_t stamp_ns = 0;  ///< of the device's report
  Vec3 grip_w =
      Vec3::Zero();  ///< the device's own sampled grip point, before clutch and anchor [m]
  Quat q_wa =
      Quat::Identity();  ///< the device's own sampled orientation; its length does not matter
  /// The device's own sensed velocity, when `twist_valid`; else this interval's displacement over
  /// its time serves. Not an estimate over a window: its delay leaves several times the oscillation
  /// that the rounding of one interval does.
  Twist twist_w;
  bool twist_valid = false;
  /// The wrench that acted on the device from the last report to this one, after delay and every
  /// limit behind this layer. Not valid: this layer's last output.
  Wrench accepted_w;
  bool accepted_valid = false;
  Wrench command_w;  ///< what is to act from now on
};

struct PassivityResult {
  Wrench wrench_w;          ///< command_w, less the damper's wrench
  double energy_j = 0;      ///< E: what the hand has put in and not got back, at most the cap
  Real alpha_ns_per_m = 0;  ///< damping in force
  bool acted = false;       ///< the damper changed the wrench
};

/// Owner: the servo thread. Memory: sizeof(Passivity); no heap. Same input, same bits.
///
/// Work needs no clock: every displacement between two calls counts, also under equal, backward or
/// far apart stamps. The controller does need the time: where a stamp is not newer than the last,
/// it uses the last interval's time and velocity again (none before the first: it does not act). A
/// number that is not finite never enters the account: a pose is skipped, the displacement being
/// counted whole with the next good one; twists count as not valid, wrenches as zero.
class Passivity {
 public:
  Passivity() noexcept = default;
  explicit Passivity(const PassivityLimits& limits) noexcept;

  /// Counts the interval that ends now and damps the wrench of the next one.
  PassivityResult update(const PassivityInput& input) noexcept;
  /// The same of a device that only translates: no torque does work on it, and none damps it.
  PassivityResult update_place(const PassivityInput& input) noexcept;

  /// Balance zero, no last pose: the next tick has no interval behind it.
  void reset() noexcept;

  [[nodiscard]] double energy_j() const noexcept { return energy_j_; }

 private:
  template <bool kTurns>
  void observe(const PassivityInput& input) noexcept;
  template <bool kTurns>
  PassivityResult take(const PassivityInput& input) noexcept;

  PassivityLimits limits_;
  double energy_j_ = 0;  ///< double in every build: a tick's work is far below the sum of hours
  bool started_ = false;
  std::int64_t stamp_ns_ = 0;
  Vec3 grip_w_ = Vec3::Zero();
  Quat q_wa_ = Quat::Identity();
  Wrench output_w_;
  Real interval_s_ = 0;  ///< of the last newer stamp; 0: none yet
  Twist twist_w_;        ///< of that interval
};

}  // namespace haptic
