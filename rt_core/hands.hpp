// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The hands of a scene with parts: one that holds one part after another, or two that hold one
/// each. Two are moved in one law and one tick: where their parts meet, what one feels is minus
/// what the other does. Neither follows the other through a stream of poses, which would certify
/// nothing and make energy.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/bodies/joint_motion.hpp"
#include "rt_core/part_hand.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// Owner: the servo thread; of release and prepare as PartHand has it. Memory: the caller's.
///
/// Each of two hands leads its part on from where that is: from its start at first, after a reset
/// from where it is felt. A part never jumps, for it could be put into that of the other hand.
class Hands {
 public:
  /// Results, or inputs, by hand.
  template <class T>
  using Each = std::array<T, kMostHands>;

  Hands() noexcept = default;
  Hands(const Hands&) = delete;
  Hands& operator=(const Hands&) = delete;

  /// Each holds its part where that starts. `parts` must outlive them.
  /// @param rooms  of one hand both; of two one each, with the law of both in the first.
  /// @return kOk; kNotGraspable for a scene without parts; as PartScenes::place,
  /// HapticCore::create, JointMotion::create. Cost: O(bytes), no heap.
  [[nodiscard]] RtStatus begin(const PartScenes& parts, const Each<PartHand::Room>& rooms) noexcept;

  /// As PartHand::follow, for all. @return the hands to release, bit by hand.
  std::uint32_t follow(const DrivenInput& input) noexcept;

  /// One tick. Of two hands one that is given no input keeps its goal: its part is held still, and
  /// gives way as the spring of its hand does. Without any input nothing moves.
  /// @return by hand; of one without input kOk and no wrench.
  /// Cost: within bounds() for all parts together, and a constant.
  [[nodiscard]] Each<StepResult> step(const Each<const StepInput*>& inputs) noexcept;
  /// With the first alone.
  [[nodiscard]] StepResult step(const StepInput& input) noexcept;
  /// As PartHand::reset, of all.
  void reset() noexcept;

  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  [[nodiscard]] PartHand& hand(std::uint32_t number) noexcept { return hands_[number]; }
  [[nodiscard]] const PartHand& hand(std::uint32_t number) const noexcept { return hands_[number]; }
  /// Bounds of a tick. Servo thread.
  [[nodiscard]] const SceneCapacity& bounds() const noexcept { return hands_[0].bounds(); }
  /// Driven parts after the last step.
  [[nodiscard]] const DrivenParts& driven() const noexcept { return hands_[0].driven(); }
  /// Where the part that a hand holds is felt, or was last: its mesh frame.
  [[nodiscard]] Pose felt_wa(std::uint32_t number) const noexcept;
  /// For two hands: sum of the contacts on the part of one, of the last step: about its grip point,
  /// W axes.
  [[nodiscard]] Wrench contact_w(std::uint32_t number) const noexcept {
    return motion_ != nullptr ? motion_->contact_w(number) : Wrench{};
  }

 private:
  [[nodiscard]] RtStatus begin_two(const PartScenes& parts,
                                   const Each<PartHand::Room>& rooms) noexcept;
  [[nodiscard]] RtStatus open_law(const PartScenes& parts, std::span<std::byte> memory) noexcept;
  [[nodiscard]] Each<StepResult> step_two(const Each<const StepInput*>& inputs) noexcept;

  std::uint32_t count_ = 0;
  std::array<PartHand, kMostHands> hands_;
  DrivenParts driven_;             ///< of two hands
  JointMotion* motion_ = nullptr;  ///< of two hands; else null
};

}  // namespace haptic
