// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Play (backlash) of two encoder steps on the sensed pose: what the last digit of an encoder makes
/// up, to and fro between two counts, does not move the played pose. It lags by one step at most
/// per axis, and is the sensed pose itself where no step is known.

#include "rt_core/base/pose.hpp"

namespace haptic {

/// The played pose, its way since the last one, and where the sensed pose lies off it.
struct PlayedPose {
  Vec3 grip_w = Vec3::Zero();
  Quat q_wa = Quat::Identity();
  Vec3 way_m = Vec3::Zero(), turn_rad = Vec3::Zero();     ///< W axes
  Vec3 ahead_m = Vec3::Zero(), ahead_rad = Vec3::Zero();  ///< sensed less played, W axes
};

/// Owner: the servo thread. No heap, no loop but over three axes. Same input, same bits.
class EncoderPlay {
 public:
  EncoderPlay() noexcept = default;
  /// Steps along and about each W axis; not finite or negative counts as 0: exact.
  EncoderPlay(Real step_m, Real step_rad) noexcept;

  /// Takes one sensed pose; one that is not finite leaves the play where it is. The first has no
  /// way behind it.
  PlayedPose update(const Vec3& grip_w, const Quat& q_wa) noexcept;
  /// The same of a device that only translates: it never turns.
  PlayedPose update_place(const Vec3& grip_w, const Quat& q_wa) noexcept;
  void reset() noexcept;

 private:
  template <bool kTurns>
  PlayedPose take(const Vec3& grip_w, const Quat& q_wa) noexcept;

  Real step_m_ = 0, step_rad_ = 0;
  bool started_ = false;
  Vec3 grip_w_ = Vec3::Zero();
  Quat q_wa_ = Quat::Identity();
};

}  // namespace haptic
