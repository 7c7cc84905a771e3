// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A gain in [0, 1] on a wrench that leaves and enters without a jump: for the clutch, for recovery
/// and for all else that has to release the hand and take it up again. Ramping out, it holds the
/// last wrench and lets it fade, because the one behind it may no longer mean anything; ramping in,
/// it follows the wrench of each tick.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// Shortest ramp in: the hand must be able to answer.
inline constexpr Real kMinRampIn_s = 50.0e-3_r;
/// A tick moves the gain by no more than this time allows: a late one makes the ramp longer, never
/// its step larger.
inline constexpr Real kLongestRampTick_s = 5.0e-3_r;

/// Limits. A value that is not finite or negative counts as 0.
struct WrenchRampLimits {
  Real slew_n_per_s = 0;        ///< largest change of force by the ramp; 0: none given
  Real slew_nm_per_s = 0;       ///< largest change of torque by the ramp; 0: none given
  Real ramp_out_s = 50.0e-3_r;  ///< shortest time of a ramp out where a slew limit is not given
  Real ramp_in_s = 100.0e-3_r;  ///< shortest time of a ramp in; at least kMinRampIn_s
};

enum class RampState : std::uint8_t { kIn, kRampingOut, kOut, kRampingIn };

struct RampedWrench {
  Wrench wrench_w;
  Real gain = 1;  ///< on the wrench given (in, ramping in) or held (ramping out); 0 when out
  RampState state = RampState::kIn;
};

/// Owner: the servo thread. Memory: sizeof(WrenchRamp); no heap. Starts in, with gain 1.
///
///     kIn --ramp_out()--> kRampingOut --gain 0--> kOut --ramp_in()--> kRampingIn --gain 1--> kIn
///
/// ramp_out() while ramping in turns round at the gain reached. ramp_in() while ramping out is
/// remembered and followed once out: the wrench to come need not be the one held, and a change of
/// wrench at part gain would be a jump. Requests may be repeated every tick; the last one counts.
class WrenchRamp {
 public:
  WrenchRamp() noexcept = default;
  explicit WrenchRamp(const WrenchRampLimits& limits) noexcept;

  void ramp_out() noexcept { wanted_ = false; }
  void ramp_in() noexcept { wanted_ = true; }

  /// One tick. The gain moves by the real time since the last stamp, at most kLongestRampTick_s of
  /// it; not at all where the stamp is not newer, or at the first. The force then differs from the
  /// last by at most slew times that time plus gain times the change of `wrench_w` itself; out, it
  /// is exactly zero. A wrench that is not finite is replaced by the last one that was.
  RampedWrench update(std::int64_t stamp_ns, const Wrench& wrench_w) noexcept;

  /// As built, but in (gain 1) or out (gain 0), with the request to stay so; forgets the last
  /// stamp.
  void reset(bool in = true) noexcept;

  [[nodiscard]] RampState state() const noexcept { return state_; }
  [[nodiscard]] Real gain() const noexcept { return gain_; }

 private:
  [[nodiscard]] Real elapsed_s(std::int64_t stamp_ns) noexcept;
  [[nodiscard]] Real slew_rate_per_s(Real fastest_per_s) const noexcept;

  WrenchRampLimits limits_;
  RampState state_ = RampState::kIn;
  bool wanted_ = true;
  bool stamped_ = false;
  std::int64_t stamp_ns_ = 0;
  Real gain_ = 1;
  Wrench wrench_w_;  ///< the last one given; ramping out: the one held
};

}  // namespace haptic
