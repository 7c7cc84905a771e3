// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Those that move in a tick, where there are more parts than may. The parts in the hands and those
/// that an owner moves always do; loose ones take turns: those that are nearest to what moves, then
/// those that have not yet come to rest. A part that does not move rests where it is, as hard as
/// what stands; what is known of its contacts with those that move stays.
///
/// Two parts are asked about while they are near each other. Those that are not asked about cannot
/// meet in the tick: none moves farther than a quarter of what is between them.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "rt_core/bodies/joint_scenes.hpp"

namespace haptic {

/// Units of work of a tick for the choice of those that move, which takes about as long in each.
inline constexpr std::uint32_t kTurnUnits = 256;

/// Owner: the servo thread. Bodies of the law are members in an order that changes.
class AwakeSet {
 public:
  struct Member {
    Vec3 grip_m = Vec3::Zero();  ///< in its mesh frame
    Real radius_m = 0;           ///< about its grip point
    bool sinks = false;          ///< by its weight, until something holds it
  };

  /// Takes the memory of the slots that are shared.
  void place(Arena& arena, const JointScenes& scenes) noexcept;
  static void count_bytes(Arena& arena, const JointScenes& scenes) noexcept;
  /// @param slots  as JointScenes::list() has them. `scenes` outlives this. Reads all vertices: not
  /// for the servo loop.
  void configure(const JointScenes& scenes, std::span<const BodyPairScene> slots,
                 std::span<const Member> members, Real tolerance_m) noexcept;

  /// Body k is member k, at `poses`, and nothing is known; before BodyLaw::begin with the members
  /// in their order.
  void begin(BodyLaw& law, std::span<const GripPose> poses) noexcept;
  /// Before a tick of the law, in which the goals of what always moves go up to `ahead_m`. Cost:
  /// constant for each two of which one moves, and a reset of each pair that comes near.
  void choose(BodyLaw& law, Real ahead_m) noexcept;

  [[nodiscard]] std::uint32_t member_at(std::uint32_t body) const noexcept {
    return member_at_[body];
  }
  /// In the last tick a part that should have moved did not, for more are near than may.
  [[nodiscard]] bool is_crowded() const noexcept { return is_crowded_; }

 private:
  static constexpr std::uint16_t kNoSlot = 0xffff;
  /// A box about all of a member, in its axes about its grip point.
  struct Box {
    Vec3 middle_m = Vec3::Zero(), half_m = Vec3::Zero();
  };
  /// Since when it has not moved.
  struct Rest {
    GripPose from;
    std::uint32_t ticks = 0;
    bool has_settled = true;
  };
  /// A member that should move, and a body that it comes near; none: it has not come to rest.
  struct Candidate {
    std::uint32_t body = kStanding, near = kStanding;
    Real gap_m = 0;
  };

  [[nodiscard]] static Box box_of(const SceneView& scene, std::uint32_t body,
                                  const Vec3& grip_m) noexcept;
  [[nodiscard]] Box box_of(std::uint32_t member) const noexcept;
  [[nodiscard]] std::uint16_t& slot_of(std::uint32_t one, std::uint32_t other) noexcept;
  [[nodiscard]] std::uint8_t kind_of(std::uint32_t& a, std::uint32_t& b) const noexcept;
  [[nodiscard]] bool moves(std::uint32_t body) const noexcept { return body < moving_; }
  [[nodiscard]] bool is_lively(std::uint32_t body) const noexcept;
  [[nodiscard]] Real apart_m(const BodyLaw& law, std::uint32_t one, std::uint32_t other,
                             Real enough_m) const noexcept;
  [[nodiscard]] Real gap_m(const BodyLaw& law, std::uint32_t one, std::uint32_t other,
                           Real enough_m) noexcept;
  [[nodiscard]] Real wake_m(std::uint32_t one, std::uint32_t other) const noexcept;
  [[nodiscard]] bool open(BodyLaw& law, std::uint32_t one, std::uint32_t other) noexcept;
  void close(BodyLaw& law, std::uint32_t one, std::uint32_t other) noexcept;
  void follow_rest(const BodyLaw& law) noexcept;
  void follow_near(BodyLaw& law, std::uint32_t body) noexcept;
  [[nodiscard]] Candidate candidate(const BodyLaw& law) noexcept;
  [[nodiscard]] std::uint32_t place_for(const BodyLaw& law, const Candidate& candidate) noexcept;
  void exchange(BodyLaw& law, std::uint32_t moving, std::uint32_t resting) noexcept;

  const JointScenes* scenes_ = nullptr;
  std::uint32_t count_ = 0, moving_ = 0, always_ = 0;  ///< the first `always_` always move
  Real tolerance_m_ = 0, ahead_m_ = 0;
  bool is_crowded_ = false;
  std::uint32_t opened_ = 0;  ///< pairs, in this tick
  std::array<Member, kMostBodies> members_;
  std::array<Box, kMostBodies> boxes_;
  std::array<Rest, kMostBodies> rests_;
  std::array<std::uint8_t, kMostBodies> member_at_{};
  std::array<Real, kMostMovingBodies> clear_m_{};
  std::span<std::uint16_t> slot_of_;  ///< by two members; of one with itself: with what stands
  std::span<std::uint8_t> is_taken_;  ///< by slot
  std::array<std::uint16_t, JointScenes::kMostKinds + 1> first_slot_{};  ///< of a kind; its end
};

}  // namespace haptic
