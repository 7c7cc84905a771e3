// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A smooth random motion: each coordinate and each turn the sum of three seeded sines between 0.1
/// and 0.8 Hz.

#include "host_sim/shapes/proxy_trace.hpp"

namespace haptic::sim {

struct Wander {
  Vector centre = Vector::Zero();
  Vector reach_m = Vector::Zero();        ///< farthest from the centre, by axis
  Rotation about = Rotation::Identity();  ///< turned about this orientation
  double turn_rad = 0.1;                  ///< at most about x and y, twice that about z
};

[[nodiscard]] TimedPose wander(const Wander& shape, Seeded& random);

}  // namespace haptic::sim
