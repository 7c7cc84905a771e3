// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded coherent motions at 1 kHz near the boundary of a C-obstacle, free and in contact, for
/// trackers to be compared on.

#include <cstdint>
#include <vector>

#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

struct PathSpeed {
  double linear_m_per_s = 1.0, angular_rad_per_s = 10.0;
};

/// A hand that wanders at constant speed round one obstacle and presses now and then: the wanted
/// D_near swings smoothly between -6 and +50 mm and the hand follows it, steered by the exhaustive
/// search, never by a tracker under test.
class CoherentPath {
 public:
  /// The scene has one pair; A starts 30 mm off.
  CoherentPath(const SceneView& view, const PathSpeed& speed, std::uint64_t seed);

  /// Pose of the next tick. `d_near_m`: true value at the pose returned last (ignored the first
  /// time).
  [[nodiscard]] Pose next(double d_near_m);

 private:
  struct Wave {
    double frequency_hz = 0, phase = 0;
  };
  /// Smooth unit vector, from three waves per axis.
  [[nodiscard]] Vector wander(const Wave (&waves)[3][3]) const;

  PathSpeed speed_;
  Wave linear_[3][3], angular_[3][3], gap_[3];
  Vector x_, velocity_ = Vector::Zero(), centre_w_, centre_a_;
  Rotation q_;
  double t_s_ = 0;
  bool started_ = false;
};

}  // namespace haptic::sim
