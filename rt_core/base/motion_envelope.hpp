// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where the part may go, and the watch over it: what a scene was compiled for, or what a device
/// is allowed.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// Where the part may go, after clutch and anchor. A limit of 0: none.
struct MotionEnvelope {
  Vec3 centre_w = Vec3::Zero();
  Vec3 half_extent_m = Vec3::Zero();  ///< of the box that the grip point stays in, W axes
  Quat q_wa = Quat::Identity();       ///< middle of the orientations
  Real max_angle_rad = 0;             ///< largest turn from it

  [[nodiscard]] bool limits_place() const noexcept { return (half_extent_m.array() > 0.0_r).any(); }
  [[nodiscard]] bool limits_turn() const noexcept { return max_angle_rad > 0.0_r; }
};

/// Finite, no limit negative, the quaternion unit to 1e-3 where it counts.
[[nodiscard]] bool is_usable(const MotionEnvelope& envelope) noexcept;

/// Which limits a pose passes.
enum EnvelopeSide : std::uint32_t { kOutsideWorkspace = 1u << 0, kOutsideOrientation = 1u << 1 };

/// The pose of the envelope nearest to `pose` in the turn and in each axis: one that lies inside
/// keeps its bits. False: it did. Cost: a logarithm, and an exponential outside.
bool hold_inside(const MotionEnvelope& envelope, GripPose& pose) noexcept;

/// The place alone. Cost: three comparisons.
bool hold_place(const MotionEnvelope& envelope, GripPose& pose) noexcept;

/// Tells when the part is outside, or about to be by the next tick if it goes on as in the last.
class EnvelopeWatch {
 public:
  /// EnvelopeSide bits of grip point and orientation of this tick. `envelope` must be usable and
  /// the same in every tick; a quaternion off its unit length is all right.
  [[nodiscard]] std::uint32_t update(const MotionEnvelope& envelope, const Vec3& x0_w,
                                     const Quat& q_wa) noexcept;
  /// The same of a part that never turns.
  [[nodiscard]] std::uint32_t update_place(const MotionEnvelope& envelope,
                                           const Vec3& x0_w) noexcept;
  /// Forgets the last tick.
  void reset() noexcept { has_last_ = false; }

 private:
  Vec3 last_x0_w_ = Vec3::Zero();
  Real last_angle_rad_ = 0;
  bool has_last_ = false;
};

}  // namespace haptic
