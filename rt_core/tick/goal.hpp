// SPDX-License-Identifier: Apache-2.0
#pragma once
/// First stage of a tick: from the device's pose to the goal, where the device asks the part to be.

#include <cstdint>

#include "rt_core/base/motion_envelope.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/law/coupling.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/step.hpp"

namespace haptic {

struct Goal {
  GripPose device;            ///< the device's pose, at the grip point
  GripPose grip;              ///< the goal, at the grip point
  Pose pose_wa;               ///< the goal of A's mesh frame
  std::uint32_t outside = 0;  ///< EnvelopeSide of the scene's envelope
  std::uint32_t flags = 0;    ///< kFlagClutched, kFlagSaturated, kFlagOutsideEnvelope
};

/// Clutch, anchor and envelope. Keeps the goal's offset from the device. Law kProxy: once the
/// envelope is left the goal stays where it was in that tick, until `reset`, and the clutch moves
/// nothing; Goal::outside goes on to say where the device asks for.
class GoalStage {
 public:
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;
  /// After a reset: the goal stands at this pose of A's mesh frame, as if the clutch had left it
  /// there.
  void begin_at(const Pose& pose_wa) noexcept;
  /// `felt`: the proxy, from which the goal is never turned by more than the anchor allows; null:
  /// none. `at_rest`: nothing pulls at the proxy, so that the anchor may turn back.
  [[nodiscard]] Goal update(const Pose& pose_wa, bool clutched, const GripPose* felt,
                            bool at_rest) noexcept;

  [[nodiscard]] const MotionEnvelope& envelope() const noexcept { return envelope_; }
  /// Pose of A's mesh frame.
  [[nodiscard]] Pose mesh_pose(const GripPose& grip) const noexcept {
    return {grip.x0_w - grip.r_wa * grip_a_, grip.q_wa};
  }

 private:
  /// Where the goal lies off the device: what the clutch and the anchor have added.
  struct Offset {
    Vec3 translation_m = Vec3::Zero();
    Quat rotation = Quat::Identity();
    Quat anchor = Quat::Identity();  ///< on top of it
    bool is_zero = true;             ///< then the goal is the device's pose, bit by bit
    bool clutched = false;
  };

  [[nodiscard]] bool is_locked() const noexcept { return kSceneTraits.is_locked(locked_); }
  [[nodiscard]] GripPose device_grip(const Pose& pose_wa) const noexcept;
  [[nodiscard]] Offset offset_between(const GripPose& device, const GripPose& goal) const noexcept;
  [[nodiscard]] GripPose offset_goal(const GripPose& device) const noexcept;
  void turn_back() noexcept;
  [[nodiscard]] std::uint32_t outside_of(const GripPose& goal) noexcept;
  [[nodiscard]] Goal left_goal(Goal goal, bool clutched) noexcept;
  [[nodiscard]] bool hold(GripPose& goal) const noexcept;

  Vec3 grip_a_ = Vec3::Zero();  ///< grip point in A's mesh frame
  bool holds_ = false;          ///< law kProxy: the goal is held inside the envelope
  bool locked_ = false;         ///< the envelope is one orientation; the device's is not used
  Mat3 locked_r_wa_ = Mat3::Identity();  ///< that orientation
  MotionEnvelope envelope_;
  Real anchor_rad_ = 0;     ///< largest turn of the goal from the proxy
  Real turn_back_rad_ = 0;  ///< of the anchor in a tick
  Offset offset_;
  GripPose frozen_;  ///< the goal while clutched, or since the envelope was left
  EnvelopeWatch watch_;
  bool left_ = false;  ///< the envelope, since the last reset
};

}  // namespace haptic
