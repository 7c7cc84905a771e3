// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parts of one law, those in the hands and those that move beside them, and the scenes in
/// which two of them meet. Parts of one shape share these scenes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/status.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// The parts that the hands hold, and the scene in which each is held.
struct PartsInHands {
  std::uint32_t count = 1;
  std::array<std::uint32_t, kMostHands> part{};
  std::array<const SceneView*, kMostHands> scene{};
};

/// Members are the parts in the hands, then the movers that may meet one of the others or are
/// loose, in their order. Memory: from place(). Scenes, parts and views outlive it.
class JointScenes {
 public:
  static constexpr std::uint32_t kMostMembers = kMostBodies;
  /// Scenes of pairs that differ, at most.
  static constexpr std::uint32_t kMostKinds = 254;
  static constexpr std::uint8_t kNone = 0xff;
  /// Slots of a kind for two members that take turns: so many of its pairs may be near each other.
  /// Each pair with a member that always moves has one.
  static constexpr std::uint32_t kSlotsOfKind = 48;

  /// Room of open() and list().
  struct Counts {
    std::uint32_t views = 0;  ///< scenes that are opened
    std::size_t kinds = 0;
  };
  /// Cost: O(pairs of parts times kinds).
  [[nodiscard]] static Counts count(const PartScenes& parts, const PartsInHands& held) noexcept;

  /// Opens the scenes in `views`, and tells members and kinds. Both rooms outlive this.
  /// @return kOk; what SceneView::open finds; kBlobBadNumber where two scenes of a part do not
  /// agree; kBlobBadCount for too many of them. Not for the servo loop.
  [[nodiscard]] RtStatus open(const PartScenes& parts, const PartsInHands& held,
                              std::span<SceneView> views, std::span<std::uint8_t> kinds) noexcept;

  [[nodiscard]] std::uint32_t hands() const noexcept { return held_.count; }
  /// Members.
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// Another moves than the part in one hand.
  [[nodiscard]] bool is_needed() const noexcept { return count_ > 1; }
  /// The number of a member behind the hands in PartScenes::driven().
  [[nodiscard]] std::uint32_t mover_of(std::uint32_t member) const noexcept {
    return mover_[member];
  }
  [[nodiscard]] std::uint32_t part_of(std::uint32_t member) const noexcept;
  [[nodiscard]] bool is_loose(std::uint32_t member) const noexcept;
  /// Members that move in one tick.
  [[nodiscard]] std::uint32_t moving_count() const noexcept {
    return count_ < kMostMovingBodies ? count_ : kMostMovingBodies;
  }
  /// There are more: loose ones take turns.
  [[nodiscard]] bool takes_turns() const noexcept { return count_ > kMostMovingBodies; }

  /// The scene in which member `a` moves and `b`, kStanding for all that stands, does not; kNone:
  /// they never meet, or B is the one that moves.
  [[nodiscard]] std::uint8_t kind(std::uint32_t a, std::uint32_t b) const noexcept {
    return kinds_[std::size_t{a} * (count_ + 1) + (b == kStanding ? count_ : b)];
  }
  [[nodiscard]] const SceneView& scene(std::uint8_t kind) const noexcept { return *views_[kind]; }
  [[nodiscard]] std::uint32_t kind_count() const noexcept { return kind_count_; }
  [[nodiscard]] const PartsInHands& held() const noexcept { return held_; }

  /// The slots of the law's pairs: those of members that always move first, and open; where all do
  /// these are all. Then those of each kind that members which take turns share.
  /// @return how many there are, also where `slots` has no room for them. Cost: O(members^2).
  std::uint32_t list(std::span<BodyPairScene> slots) const noexcept;
  /// Slots of a kind that are shared.
  [[nodiscard]] std::uint32_t shared_slots(std::uint8_t kind) const noexcept;

 private:
  [[nodiscard]] static bool meets(const PartScenes& parts, const PartsInHands& held,
                                  std::uint32_t part) noexcept;
  void find_members(const PartScenes& parts) noexcept;
  [[nodiscard]] RtStatus open_kind(std::span<const std::byte> bytes, std::span<SceneView> views,
                                   std::uint8_t& kind) noexcept;
  [[nodiscard]] bool is_shared(std::uint32_t a, std::uint32_t b) const noexcept;

  const PartScenes* parts_ = nullptr;
  PartsInHands held_;
  std::uint32_t count_ = 0, kind_count_ = 0, opened_ = 0;
  std::array<std::uint8_t, kMostMembers> mover_{};
  std::array<const SceneView*, kMostKinds> views_{};
  std::span<std::uint8_t> kinds_;
};

}  // namespace haptic
