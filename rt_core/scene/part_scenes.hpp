// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts that the hand holds one after another. A compiled scene of such parts is the scene of the
/// one that it holds at first, and holds a scene for each that may be held, in which that one moves
/// and the others stand. To hold another part is to go on in its scene, with the others placed
/// where they are. Parts that their owner moves are in none of these scenes: each makes one with
/// each part that may be held, in which it alone stands. A scene needs a static body: where a part
/// that may be held meets driven parts alone, these stand in its scene too, at their start.
/// Loose parts are as driven ones, and have a scene too in which each moves and the others stand.
///
/// Two hands hold part 0 and part 1 all the time. Each is in the scene of the other as a driven
/// part is: not at all, or where nothing else stands there.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "rt_core/base/status.hpp"
#include "rt_core/scene/placed_bodies.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Parts of one scene, at most.
inline constexpr std::uint32_t kMostParts = 64;
/// Those of them that their owner moves or that are loose; with two hands one fewer.
inline constexpr std::uint32_t kMostDriven = 62;
/// Parts that move in one tick: those in the hands, all that an owner moves, and as many loose ones
/// as there is room for.
inline constexpr std::uint32_t kMostMoving = 8;
/// Hands that hold one.
inline constexpr std::uint32_t kMostHands = 2;
/// Without a newer pose a driven part is late after this, at most [s].
inline constexpr double kLatestDriven_s = 0.5;
/// Stiffness of the spring that leads a driven part over that of the hand's spring, as the compiler
/// sets it.
inline constexpr double kDrivenRatio = 1.0e4;
/// The same of the anchor of a loose part.
inline constexpr double kLooseRatio = 20;

class PartScenes {
 public:
  /// Checks what `scene` says of its parts, and opens each of their scenes once.
  /// @return kOk, also for a scene without parts, which has count() 0; else what is wrong with
  /// them. Cost: O(bytes), no heap. `scene` must outlive `parts`.
  [[nodiscard]] static RtStatus open(const SceneView& scene, PartScenes& parts) noexcept;

  [[nodiscard]] std::uint32_t count() const noexcept {
    return static_cast<std::uint32_t>(parts_.size());
  }
  [[nodiscard]] const PartRecord& operator[](std::uint32_t part) const noexcept {
    return parts_[part];
  }
  [[nodiscard]] bool may_be_held(std::uint32_t part) const noexcept {
    return parts_[part].scene_bytes > 0 && parts_[part].role != PartRole::kLoose;
  }
  /// The parts in the hands stay there: those of two, and among loose parts.
  [[nodiscard]] bool holds_throughout() const noexcept { return hands() > 1 || has_loose(); }
  /// The hand may let go what it holds and take it.
  [[nodiscard]] bool may_be_taken(std::uint32_t part) const noexcept {
    return !holds_throughout() && may_be_held(part);
  }
  /// A part is loose.
  [[nodiscard]] bool has_loose() const noexcept;
  /// Hands that hold a part at the start: hand k holds part k.
  [[nodiscard]] std::uint32_t hands() const noexcept {
    return count() > 1 && parts_[1].role == PartRole::kHand2 ? 2 : std::min(count(), 1u);
  }
  /// UTF-8, not terminated.
  [[nodiscard]] std::string_view name(std::uint32_t part) const noexcept;
  /// Where the part is at the start.
  [[nodiscard]] PartPlace start_of(std::uint32_t part) const noexcept;
  /// The parts that are the static bodies of the scene of `part`, in their order: those that move
  /// too only where it meets no other.
  [[nodiscard]] std::span<const std::uint32_t> others_of(std::uint32_t part) const noexcept;
  /// The scene in which `part` is held, or loose, as it was compiled; empty: it never is.
  [[nodiscard]] std::span<const std::byte> scene_of(std::uint32_t part) const noexcept;
  /// False: the static bodies of the scene of `part` move too, for it meets nothing else.
  [[nodiscard]] bool meets_standing(std::uint32_t part) const noexcept;
  /// Parts that their owner moves, and loose ones, ascending by part.
  [[nodiscard]] std::span<const DrivenRecord> driven() const noexcept { return driven_; }
  /// The scene in which part `a` moves and part `b`, which moves too, stands at its mesh frame, as
  /// it was compiled; empty: the two never meet, or B is the one that moves. Cost: O(pairs).
  [[nodiscard]] std::span<const std::byte> pair_scene(std::uint32_t a,
                                                      std::uint32_t b) const noexcept;
  /// All of these pairs. Pairs of parts of one shape may have one scene.
  [[nodiscard]] std::span<const BodyPairRecord> pairs() const noexcept { return pairs_; }
  [[nodiscard]] std::span<const std::byte> scene_of(const BodyPairRecord& pair) const noexcept;
  /// State of the law of any part among others that move, at most; 0: none does.
  [[nodiscard]] std::size_t most_law_bytes() const noexcept { return most_law_bytes_; }
  /// Bytes of the largest of these scenes, and state of a core for any of them.
  [[nodiscard]] std::size_t most_bytes() const noexcept { return most_bytes_; }
  [[nodiscard]] std::size_t most_state_bytes() const noexcept { return most_state_bytes_; }

  /// Writes the scene in which `part` is held with all parts at `places`, by part: it starts at its
  /// own, and the others stand at theirs. A part at its start keeps its bits.
  /// @param memory  most_bytes() at a multiple of kSceneAlignment.
  /// @param view    the scene as it was written.
  /// @return kOk; kBlobBadIndex for a part that may not be held; kBlobBadCount for another number
  /// of places; as PlacedBodies; what SceneView::open finds. Cost: O(bytes), no heap. Not for the
  /// servo loop.
  [[nodiscard]] RtStatus place(std::uint32_t part, std::span<const PartPlace> places,
                               std::span<std::byte> memory, SceneView& view) const noexcept;

 private:
  [[nodiscard]] RtStatus check_driven() const noexcept;
  [[nodiscard]] RtStatus check_pairs() const noexcept;
  [[nodiscard]] bool has_known_role(std::uint32_t k) const noexcept;
  [[nodiscard]] bool moves_beside(std::uint32_t part) const noexcept;
  [[nodiscard]] bool holds_bytes(std::uint64_t begin, std::uint64_t bytes) const noexcept;

  const SceneView* scene_ = nullptr;
  std::span<const PartRecord> parts_;
  std::span<const std::uint32_t> bodies_;
  std::span<const std::byte> scenes_;
  std::span<const DrivenRecord> driven_;
  std::span<const BodyPairRecord> pairs_;
  std::size_t most_bytes_ = 0, most_state_bytes_ = 0, most_law_bytes_ = 0;
};

}  // namespace haptic
