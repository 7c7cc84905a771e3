// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where the scene lets a plan's poses lie: [motion_limits] workspace and orientation, which the
/// core holds the part inside of.

#include <string>

#include "rt_core/scene/scene_format.hpp"
#include "tools/plan/plan.hpp"

namespace haptic::tools {

/// A pose farther out than this is outside [m, and rad]: the rounding of a pose that the core
/// holds.
inline constexpr double kLimitRounding = HAPTIC_REAL_IS_FLOAT ? 1.0e-5 : 1.0e-9;

class PlanLimits {
 public:
  explicit PlanLimits(const EnvelopeParameters& envelope) : envelope_(envelope) {}

  [[nodiscard]] bool has_box() const { return (envelope_.given & kWorkspaceGiven) != 0; }
  [[nodiscard]] double low_m(int axis) const { return envelope_.min_m[axis]; }
  [[nodiscard]] double high_m(int axis) const { return envelope_.max_m[axis]; }

  [[nodiscard]] bool hold(const PlanPose& pose) const;
  /// True if the straight step between two poses that are inside is inside.
  [[nodiscard]] bool hold_between(const PlanPose& from, const PlanPose& to) const;
  /// Which limit a pose leaves, as a sentence with the two values; empty: none.
  [[nodiscard]] std::string left_by(const PlanPose& pose) const;
  /// The same for the first of a plan's poses that does, or is reached by a way that does.
  [[nodiscard]] std::string left_by(const Plan& plan) const;

 private:
  [[nodiscard]] double product(const PlanPose& pose) const;
  [[nodiscard]] double angle_rad(const PlanPose& pose) const;

  EnvelopeParameters envelope_;
};

}  // namespace haptic::tools
