// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The law by which a displacement device moves a pose: how far its cap is pushed and turned from
/// rest stands for a velocity, which is integrated over time. Frame D: x right, y away from the
/// operator, z up; the pose begins at its origin.
///
/// A velocity lasts until the next report, or for longest_step_ns, so silence is a hand at rest.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic::hal {

/// Full scale of an axis where nobody says one: the logical maximum that 3Dconnexion's current
/// models declare.
inline constexpr double kDisplacementFullScale = 350.0;

struct DisplacementSettings {
  Real full_speed_m_per_s = 0.10_r;           ///< at full displacement, 0 to 10
  Real full_turn_rad_per_s = 1.0_r;           ///< at full turn, 0 to 100
  Real dead_zone = 0.05_r;                    ///< share of full scale that counts as rest, 0 to 0.9
  Real reach_m = 0.25_r;                      ///< the pose stays this close to the origin, 0 to 100
  std::int64_t longest_step_ns = 50'000'000;  ///< longest time that one velocity lasts, up to 1 s
};

/// Settings with the default in place of each value that is out of its range or no number.
[[nodiscard]] DisplacementSettings usable(const DisplacementSettings& wanted) noexcept;

/// Owner: one thread. No heap.
class DisplacementPose {
 public:
  explicit DisplacementPose(const DisplacementSettings& settings) noexcept
      : settings_(usable(settings)) {}

  /// Back to the origin, at rest, with no time known.
  void reset() noexcept;

  /// Share of full speed, -1 to 1, for a raw value: 0 inside the dead zone, then rising from 0.
  /// @param full_scale  raw value at full displacement, positive.
  [[nodiscard]] Real share_of(double raw, double full_scale) const noexcept;

  /// Integrates the velocity up to `stamp_ns`; a time before the last one changes nothing.
  void advance(std::int64_t stamp_ns) noexcept;

  /// A new displacement: integrates the velocity so far, then takes over the new one.
  /// @param push, turn  shares of full speed in D, each component -1 to 1.
  void take(const Vec3& push, const Vec3& turn, std::int64_t stamp_ns) noexcept;

  [[nodiscard]] const Pose& pose_dh() const noexcept { return pose_dh_; }
  [[nodiscard]] const Twist& velocity_d() const noexcept { return velocity_d_; }
  [[nodiscard]] Real reach_m() const noexcept { return settings_.reach_m; }

 private:
  DisplacementSettings settings_;
  Pose pose_dh_;
  Twist velocity_d_;
  std::int64_t stamp_ns_ = 0;     ///< up to which the velocity is in the pose
  std::int64_t reported_ns_ = 0;  ///< when it was reported
  bool stamped_ = false;
};

}  // namespace haptic::hal
