// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Judges whether a loop whose hand holds still comes to rest, or keeps oscillating.

#include <span>

#include "host_sim/device/loop_run.hpp"

namespace haptic::sim {

/// Largest change of the rendered wrench that is no oscillation: that of the encoders' last digits.
struct RestAllowance {
  double force_n = 0, torque_nm = 0;  ///< peak to peak, per W axis
};

/// Encoder counts that may change at rest, peak to peak.
inline constexpr double kRestCounts = 1.5;
/// A wrench that moves by less is still with any encoder: far below what a hand feels.
inline constexpr double kStillForce_n = 1.0e-2;

/// A coupling answers a change of the device's pose by a change of its wrench that is no larger
/// than its stiffness times that change, lengths of rotation being L = sqrt(k_r / k_t): the nearest
/// free pose of a convex set never moves farther than the pose itself. Every axis may be off by
/// kRestCounts counts.
[[nodiscard]] RestAllowance rest_allowance(const SceneParameters& parameters,
                                           const DeviceModel& device);

/// Time that the hand's target must have stood still before anything is judged, and the time that
/// is then looked at once.
inline constexpr double kSettle_s = 0.5, kRestWindow_s = 0.4;
/// An oscillation that falls to less than this from half window to half window is dying out.
inline constexpr double kDiesOut = 0.9;
/// Turns (changes of direction about the middle, by a quarter of the peak to peak) within a window
/// that make an oscillation of a change.
inline constexpr int kLeastTurns = 4;

/// The worst that was seen, as a multiple of what is allowed.
struct RestOscillation {
  double windows = 0;                       ///< looked at: 0 where the hand never rests
  double ratio = 0;                         ///< 1 or less: at rest
  double force_pp_n = 0, torque_pp_nm = 0;  ///< in that window, largest over the axes
  double frequency_hz = 0;                  ///< of its largest axis
  double at_s = 0;                          ///< end of that window
  [[nodiscard]] bool oscillates() const { return ratio > 1; }
};

/// Looks at every window of a stretch in which the target stood still. Laws and carriers alike.
[[nodiscard]] RestOscillation rest_oscillation(std::span<const LoopRecord> records,
                                               const RestAllowance& allowance);

}  // namespace haptic::sim
