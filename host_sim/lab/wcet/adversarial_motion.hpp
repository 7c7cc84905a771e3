// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Short motions that a search can change bit by bit: a start pose and the velocities after it,
/// never faster than a hand.

#include <array>
#include <span>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

inline constexpr std::size_t kMotionSegments = 4, kSegmentTicks = 8;
inline constexpr double kAdversarialSpeed_m_per_s = 1.0, kAdversarialTurn_rad_per_s = 10.0;

/// Velocities of one segment, W axes, turning about A's reference point.
struct SegmentVelocity {
  Vector v_m_per_s = Vector::Zero(), w_rad_per_s = Vector::Zero();
};

struct AdversarialMotion {
  Vector p_wr = Vector::Zero();  ///< A's reference point in W at the start [m]
  Rotation q_wa = Rotation::Identity();
  std::array<SegmentVelocity, kMotionSegments> segments;
};

/// Where such motions lie: about the static bodies, and about the poses of a motion of the scene.
class AdversarialSpace {
 public:
  /// `known` must outlive this; not empty.
  AdversarialSpace(const SceneView& view, std::span<const MotionSample> known);

  /// Two of three start within a hundredth of A's radius of a known pose, the third anywhere about
  /// the static bodies and any way up.
  [[nodiscard]] AdversarialMotion drawn(Seeded& random) const;

  /// Like `motion`, with its start shifted or turned, or a segment's velocity changed or drawn
  /// again; by how much is drawn over six powers of ten.
  [[nodiscard]] AdversarialMotion changed(const AdversarialMotion& motion, Seeded& random) const;

  /// Samples at the scene's rate, exactly as a motion file has them: what read_motion_csv gives of
  /// them is what as_read gives.
  [[nodiscard]] std::vector<MotionSample> samples(const AdversarialMotion& motion) const;

 private:
  [[nodiscard]] SegmentVelocity drawn_velocity(Seeded& random) const;

  std::span<const MotionSample> known_;
  Vector reference_m_;  ///< of A, in its frame
  Vector low_m_, high_m_;
  double radius_m_, period_s_;
};

/// The sample as read_motion_csv gives it back: quaternion normalised.
[[nodiscard]] MotionSample as_read(const MotionSample& sample);

}  // namespace haptic::sim
