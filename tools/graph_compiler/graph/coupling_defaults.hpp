// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Defaults of the coupling between proxy and device for a scene that does not state them: its
/// length, its limits, the windows of the twist estimator. Needs the core's format alone.

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

/// Length L of the coupling as a share of r_A, the radius of the moving part about its grip point:
/// a rotation error counts like the displacement that it gives at L. Far below, a part tips under
/// load and hooks on a rim that it should slip off; the longer, the less (`host_sim pegs
/// --length-share`: ticks held over 61 insertions 19 244, 11 845, 5673, 3901 at 1.5, 3, 4.5, 8), at
/// the price of larger torques. Where a device is given its rotor bounds the stiffness of rotation.
inline constexpr double kDefaultLengthShare = 4.5;

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
/// L with kDefaultLengthShare, the largest rotation error, the passes, both windows of the
/// estimator (only together). Given values stay.
void complete_coupling(SceneParameters& parameters, double radius_m);

}  // namespace haptic::tools
