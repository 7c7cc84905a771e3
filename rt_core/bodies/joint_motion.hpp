// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parts in the hands, those that their owner moves, and loose ones: the law of several bodies,
/// as the cores of the hands ask for it. What is driven is led by a spring many times as stiff as a
/// hand's: it pushes what is held and does not yield, but stays behind where it would go through
/// it. What is loose yields to all of these. Two hands that meet push each other: what one feels of
/// that is minus what the other does. Of more parts than may move in one tick loose ones take
/// turns.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/bodies/awake_set.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "rt_core/bodies/driven_parts.hpp"
#include "rt_core/bodies/joint_scenes.hpp"
#include "rt_core/proxy/shared_motion.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// Alignment of a law's memory [bytes].
inline constexpr std::size_t kLawAlignment = 64;

/// Owner: the servo thread. Placed in the caller's memory; never moved.
class JointMotion {
 public:
  /// Memory of one over `scenes`, whose slots are `slots`; aligned to kLawAlignment. Cost:
  /// O(pieces).
  [[nodiscard]] static std::size_t state_bytes(const PartScenes& parts, const JointScenes& scenes,
                                               std::span<const BodyPairScene> slots) noexcept;

  /// Makes one in `memory`. Parts and the scenes in which they are held outlive it. No destructor
  /// needs to run.
  /// @return kOk, with no motion where nothing moves but the part in one hand; kMemoryTooSmall,
  /// kMemoryMisaligned; as JointScenes::open. Cost: O(bytes of the scenes), no heap. Not for the
  /// servo loop.
  [[nodiscard]] static RtStatus create(std::span<std::byte> memory, const PartScenes& parts,
                                       const PartsInHands& held, DrivenParts& movers,
                                       JointMotion*& motion) noexcept;

  /// Where a hand leads its part, from the next tick on. Each must have been led once before it.
  void lead(std::uint32_t hand, const GripPose& goal) noexcept { goals_[hand] = goal; }
  [[nodiscard]] const GripPose& goal(std::uint32_t hand) const noexcept { return goals_[hand]; }
  /// There was a tick.
  [[nodiscard]] bool has_begun() const noexcept { return has_begun_; }
  /// Moves all of them towards their goals. Cost: within bounds().
  void tick() noexcept;

  /// The law's word on a hand's part, which its core is to join.
  [[nodiscard]] SharedMotion& of_hand(std::uint32_t hand) noexcept { return told_[hand]; }
  [[nodiscard]] const SharedMotion& of_hand(std::uint32_t hand) const noexcept {
    return told_[hand];
  }
  [[nodiscard]] const SceneCapacity& bounds() const noexcept { return bounds_; }
  [[nodiscard]] std::uint32_t hands() const noexcept { return scenes_.hands(); }
  /// Sum of the contacts on a hand's part in the last tick: about its grip point, W axes.
  [[nodiscard]] Wrench contact_w(std::uint32_t hand) const noexcept { return law_.contact_w(hand); }

 private:
  explicit JointMotion(DrivenParts& parts) noexcept : parts_(&parts) {}
  static void count_rooms(Arena& arena, JointScenes::Counts counts) noexcept;
  [[nodiscard]] RtStatus place(Arena& arena, std::size_t bytes, const PartScenes& parts,
                               const PartsInHands& held) noexcept;
  void configure() noexcept;
  void configure_turns(Real tolerance_m) noexcept;
  [[nodiscard]] MovingBody body_of(std::uint32_t member) const noexcept;
  [[nodiscard]] SceneCapacity bounds_of_tick() const noexcept;
  /// Where a body is led in this tick.
  [[nodiscard]] GripPose goal_of(std::uint32_t body) const noexcept;
  [[nodiscard]] std::uint32_t member_at(std::uint32_t body) const noexcept {
    return turns_ != nullptr ? turns_->member_at(body) : body;
  }
  /// In PartScenes::driven(), of a body behind the hands'.
  [[nodiscard]] std::uint32_t mover_at(std::uint32_t body) const noexcept {
    return scenes_.mover_of(member_at(body));
  }
  void take_turns() noexcept;
  void begin() noexcept;
  void tell(std::uint32_t hand, const BodiesTick& moved, const GripPose& goal) noexcept;
  [[nodiscard]] bool is_inside(std::uint32_t hand) const noexcept;
  void feel(std::uint32_t hand) noexcept;
  void lead_back() noexcept;
  void lead_back(std::uint32_t body) noexcept;
  [[nodiscard]] std::uint32_t hands_in(const BodyPair& pair, std::uint32_t body) const noexcept;

  BodyLaw law_;
  JointScenes scenes_;
  std::span<BodyPairScene> slots_;
  AwakeSet* turns_ = nullptr;     ///< null: all move in every tick
  std::span<MovingBody> bodies_;  ///< by member
  std::span<GripPose> starts_;    ///< the same
  std::uint64_t met_ = 0;         ///< movers that are members, bit by number
  DrivenParts* parts_;
  std::array<SharedMotion, kMostHands> told_;
  std::array<GripPose, kMostHands> goals_;
  bool has_begun_ = false;
  std::array<Spring, kMostHands> held_spring_;
  Real behind_m_ = 0;  ///< a driven part that lags by more is behind
  SceneCapacity bounds_{};
};

}  // namespace haptic
