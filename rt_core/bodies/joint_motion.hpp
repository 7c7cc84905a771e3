// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parts in the hands, those that their owner moves, and loose ones: the law of several bodies,
/// as the cores of the hands ask for it. What is driven is led by a spring many times as stiff as a
/// hand's: it pushes what is held and does not yield, but stays behind where it would go through
/// it. What is loose yields to all of these. Two hands that meet push each other: what one feels of
/// that is minus what the other does.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "rt_core/bodies/driven_parts.hpp"
#include "rt_core/proxy/shared_motion.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// Alignment of a law's memory [bytes].
inline constexpr std::size_t kLawAlignment = 64;

/// The scenes of the parts in the hands among others that move.
struct JointScenes {
  struct OfHand {
    const SceneView* held = nullptr;                   ///< in which its part is held
    bool meets_standing = true;                        ///< false: what stands there moves too
    std::array<const SceneView*, kMostDriven> with{};  ///< by driven part; null: they never meet
  };
  /// A part that moves beside those that are held: scenes in which it is the moving body.
  struct OfMover {
    const SceneView* standing = nullptr;  ///< of a loose part: with all that stands
    std::array<const SceneView*, kMostHands> with_hand{};  ///< by hand, whose part stands there
    std::array<const SceneView*, kMostDriven> with{};      ///< by mover, which stands there
  };
  std::array<OfHand, kMostHands> of;
  std::array<OfMover, kMostDriven> movers;
  std::uint32_t hands = 1;
  /// The scene of the two parts that are held, of which `between_a` moves; null: they never meet.
  const SceneView* between = nullptr;
  std::uint32_t between_a = 0;
};

/// Owner: the servo thread. Placed in the caller's memory; never moved.
class JointMotion {
 public:
  /// Memory of one, aligned to kLawAlignment. Cost: O(pieces).
  [[nodiscard]] static std::size_t state_bytes(const JointScenes& scenes) noexcept;

  /// Bounds of a tick: those of the scene in which the first hand's part is held, with what the law
  /// adds. Cost: O(pairs of parts).
  [[nodiscard]] static SceneCapacity bounds_of(const JointScenes& scenes) noexcept;

  /// Makes one in `memory`. Scenes and parts outlive it. No destructor needs to run.
  /// @return kOk; kMemoryTooSmall, kMemoryMisaligned. Cost: O(bytes of the scenes), no heap. Not
  /// for the servo loop.
  [[nodiscard]] static RtStatus create(std::span<std::byte> memory, const JointScenes& scenes,
                                       DrivenParts& parts, JointMotion*& motion) noexcept;

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
  [[nodiscard]] std::uint32_t hands() const noexcept { return hands_; }
  /// Sum of the contacts on a hand's part in the last tick: about its grip point, W axes.
  [[nodiscard]] Wrench contact_w(std::uint32_t hand) const noexcept { return law_.contact_w(hand); }

 private:
  using Pairs = std::array<BodyPairScene, kMostBodyPairs>;

  explicit JointMotion(DrivenParts& parts) noexcept : parts_(&parts) {}
  [[nodiscard]] static bool meets(const JointScenes& scenes, std::uint32_t mover) noexcept;
  [[nodiscard]] static std::uint32_t body_count(const JointScenes& scenes) noexcept;
  [[nodiscard]] static std::uint32_t list_pairs(const JointScenes& scenes, Pairs& pairs) noexcept;
  static void list_mover(const JointScenes& scenes, std::uint32_t mover,
                         const std::array<std::uint32_t, kMostDriven>& bodies, Pairs& pairs,
                         std::uint32_t& count) noexcept;
  void place(Arena& arena, const JointScenes& scenes) noexcept;
  void configure(const JointScenes& scenes) noexcept;
  void begin() noexcept;
  void tell(std::uint32_t hand, const BodiesTick& moved, const GripPose& goal) noexcept;
  [[nodiscard]] bool is_inside(std::uint32_t hand) const noexcept;
  void feel(std::uint32_t hand) noexcept;
  void lead_back() noexcept;
  void lead_back(std::uint32_t body) noexcept;
  [[nodiscard]] std::uint32_t hands_in(const BodyPair& pair, std::uint32_t body) const noexcept;

  BodyLaw law_;
  DrivenParts* parts_;
  std::array<SharedMotion, kMostHands> told_;
  std::array<GripPose, kMostHands> goals_;
  std::uint32_t hands_ = 1;
  bool has_begun_ = false;
  std::array<std::uint32_t, kMostDriven> met_{};  ///< by body behind the hands': number of the part
  std::uint32_t met_count_ = 0;
  std::array<Spring, kMostHands> held_spring_;
  Real behind_m_ = 0;  ///< a driven part that lags by more is behind
  SceneCapacity bounds_{};
};

}  // namespace haptic
