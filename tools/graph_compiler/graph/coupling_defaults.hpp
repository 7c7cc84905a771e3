// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the coupling between proxy and device is where a scene does not say: its length, its
/// limits, the windows of the twist estimator. Needs the core's format alone.

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

/// Length L of the coupling as a share of r_A, the radius of the moving part about its grip point:
/// a rotation error counts like the displacement that it gives at L. Far below r_A no torque is
/// felt and a part tips and hooks on a rim that it should slip off (pegs on recorded insertions: at
/// r_A and below); far above, torque steps grow.
inline constexpr double kDefaultLengthShare = 1.5;
/// The same where a device is given: its mass and damping are taken to act at this share of r_A in
/// rotation, so that a rotation is as stable as a translation.
inline constexpr double kDeviceLengthShare = 0.75;

/// The share for a device, or for none.
[[nodiscard]] constexpr double default_length_share(const DeviceParameters& device) {
  return device.given != 0 && device.mass_kg > 0 ? kDeviceLengthShare : kDefaultLengthShare;
}

/// Largest coupling damping as a share of the spring wrench: on withdrawal it would pull inwards.
inline constexpr double kDefaultDampingShare = 0.5;
/// Coupling damping for an unknown hand [N s/m], where there is a device.
inline constexpr double kDefaultDamping_ns_per_m = 1.0;
/// A derived damping stays at half of what the device can hold, so that it leaves room for a
/// spring.
inline constexpr double kDerivedDampingShare = 0.5;
/// Largest rotation error [rad]: far below pi, where the logarithm of a rotation flips.
inline constexpr double kDefaultRotationError_rad = 1.0;
/// Windows of the twist estimator [s].
inline constexpr double kDefaultMinWindow_s = 0.001;
inline constexpr double kDefaultMaxWindow_s = 0.02;

/// Fills every number of the coupling that is zero but may not be: k_t with k_F, k_r with k_t L^2,
/// L by default_length_share, the largest rotation error, the passes, both windows of the estimator
/// (only together). Given values stay.
void complete_coupling(SceneParameters& parameters, double radius_m);

}  // namespace haptic::tools
