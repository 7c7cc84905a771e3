// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parts that move beside those that are held, from tick to tick. One that its owner moves, a
/// robot's fixture, a conveyor, a body of another simulator, follows its stream of poses
/// (safety/moving_frame.hpp) and is felt there, or behind that: where something holds it, and on
/// its way where it was put elsewhere at once. It goes nowhere faster than stated while a part is
/// held. A loose one has an anchor, which gives way beyond the force that it holds; or it sinks by
/// its weight until something holds it. It has no inertia.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/safety/moving_frame.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// A driven part behaves as if it were led faster than stated by no more than this.
inline constexpr Real kCatchUp = 1.25_r;
/// It is told to be behind where it lags by more than this, for a part in the hand of that radius,
/// and than this many times what the force on it stretches its spring by.
inline constexpr Real kBehind_m = 1.0e-4_r, kBehindFor_m = 0.05_r, kBehindForces = 3;

/// Input of the driven parts before a tick.
struct DrivenInput {
  /// The newest pose of each mesh frame, in the frame of the fixed parts; in the order of
  /// PartScenes::driven(). Number 0 and those that are not given: it stays where it is.
  std::span<const FrameRecord> newest;
  std::int64_t now_ns = 0;  ///< monotonic clock of the records' stamps
  bool is_felt = true;      ///< the device exerts a force, or is about to
};

/// A driven part after a tick, in the frame of the fixed parts.
struct DrivenState {
  Pose commanded_wa;             ///< of its mesh frame, where its owner or its anchor has it now
  Pose felt_wa;                  ///< where it is
  Real lag_m = 0, lag_rad = 0;   ///< between the two, at its middle
  Wrench pushed_w;               ///< by what it touches, about its mesh frame's origin, W axes
  std::uint32_t touched_by = 0;  ///< hands whose part it touches, bit by hand
  bool is_lost = false;          ///< its stream is late, too fast or no pose: it stands

  [[nodiscard]] bool touches() const noexcept { return touched_by != 0; }
};

/// Owner: the servo thread. Memory: sizeof; no heap. Same inputs, same bits.
class DrivenParts {
 public:
  /// The parts stand at `starts`, of their mesh frames. Both outlive this; at most kMostDriven.
  void begin(std::span<const DrivenRecord> records, std::span<const Pose> starts) noexcept;

  /// One tick of all streams. @return the hands, bit by hand, whose part touches one that is lost:
  /// a cause to release them. Cost: constant for each.
  std::uint32_t follow(const DrivenInput& input) noexcept;

  [[nodiscard]] std::uint32_t count() const noexcept {
    return static_cast<std::uint32_t>(records_.size());
  }
  [[nodiscard]] const DrivenRecord& record(std::uint32_t k) const noexcept { return records_[k]; }
  [[nodiscard]] std::span<const DrivenState> states() const noexcept {
    return std::span(states_).first(count());
  }

  /// Pose of its middle as it is felt, and where it is to be led in this step: towards where its
  /// owner has it, no faster than stated.
  [[nodiscard]] GripPose felt(std::uint32_t k) const noexcept;
  [[nodiscard]] GripPose goal(std::uint32_t k) const noexcept;
  /// It was moved to `felt`, where what it touches exerts `pushed_w` about its middle.
  void take(std::uint32_t k, const GripPose& felt, const Wrench& pushed_w,
            std::uint32_t touched_by) noexcept;
  /// Beyond these the anchor of a loose part follows it, after take(). Others have none.
  void give_way(std::uint32_t k, Real most_m, Real most_rad) noexcept;
  /// It stood in this tick, for others move that are nearer to a hand.
  void rest(std::uint32_t k) noexcept;
  /// Nothing that moves meets it: it is where its owner has it.
  void pass(std::uint32_t k) noexcept;

 private:
  [[nodiscard]] GripPose grip_of(std::uint32_t k, const Pose& pose_wa) const noexcept;

  /// That it may go in the next step.
  struct Reach {
    Real way_m = 0, turn_rad = 0;
  };

  std::span<const DrivenRecord> records_;
  std::array<MovingFrame, kMostDriven> frames_;
  std::array<DrivenState, kMostDriven> states_;
  std::array<Reach, kMostDriven> reach_;
  std::int64_t last_ns_ = 0;
};

}  // namespace haptic
