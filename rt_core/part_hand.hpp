// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A hand that holds one part after another. Each part has a scene in which it moves and the others
/// stand (scene/part_scenes.hpp), and a core over that; to hold another part is to go on with its
/// core. What is felt never jumps: a part is let go by the ramp of the clutch, stays where it is,
/// and the next one is taken where it lies, with no force. Parts that their owner moves push what
/// is held, and go through what has been let go: nothing there may yield. Each of two hands
/// (hands.hpp) holds its part all the time.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/status.hpp"
#include "rt_core/bodies/driven_parts.hpp"
#include "rt_core/bodies/joint_motion.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/part_scenes.hpp"

namespace haptic {

/// Owner of `step` and `reset`: the servo thread. `release` and `prepare` belong to one other
/// thread, or to the same between ticks. Memory: the caller's, two rooms, of which one is in use.
///
///     kHolding --release()--> kLettingGo --wrench zero--> kEmpty --prepare()--> kPrepared
///     --step()--> kHolding
class PartHand {
 public:
  /// `scene`: PartScenes::most_bytes(), `state`: most_state_bytes(), `law`: most_law_bytes(), all
  /// aligned to 64 bytes.
  struct Room {
    std::span<std::byte> scene, state, law;
  };
  enum class Phase : std::uint32_t { kHolding, kLettingGo, kEmpty, kPrepared };

  PartHand() noexcept = default;
  PartHand(const PartHand&) = delete;
  PartHand& operator=(const PartHand&) = delete;

  /// Holds the part with the hand's role, where it starts. `parts` must outlive the hand.
  /// @return kOk; kNotGraspable for a scene without parts; as PartScenes::place and
  /// HapticCore::create. Cost: O(bytes), no heap.
  [[nodiscard]] RtStatus begin(const PartScenes& parts, const Room& one,
                               const Room& other) noexcept;

  /// Before each tick of a scene with driven parts, whether or not a step comes with it: they
  /// follow their streams. Where one is lost that touches the part, the steps let the wrench fade
  /// until it is found (kFlagDrivenLost). @return whether that is so: a cause to release the hand.
  bool follow(const DrivenInput& input) noexcept;
  /// One tick. The part of the other of two hands is held still (hands.hpp). While the hand holds
  /// nothing the wrench is zero, proxy_pose_wa is where the last part was left, and goal_pose_wa
  /// where the hand would lead it. StepInput::pose_wa is that of the first part's mesh frame as the
  /// hand leads it, also while another part is held: each is led by its own grip point as the first
  /// one is by its, on from where it was taken.
  [[nodiscard]] StepResult step(const StepInput& input) noexcept;
  /// Forgets all contact history. A part that was taken, or is being let go, stays where it is
  /// felt; the first part, as long as it has not been let go, begins where the device leads it. The
  /// part of one of two hands stays where it is: with `keeps_pull` it is held there as it was, so
  /// that the other hand feels no change; else its pull is dropped too.
  void reset(bool keeps_pull = false) noexcept;
  /// Lets go: the wrench fades by the ramp of the clutch, and the part stays. Without effect where
  /// the hand holds nothing, and where parts are held throughout (PartScenes).
  void release() noexcept;

  /// Makes ready that the next step takes `part`. Only while the hand holds nothing.
  /// @return kOk; kNotGraspable; as PartScenes::place and HapticCore::create. Where it fails the
  /// hand holds nothing still. Cost: O(bytes of the part's scene), no heap. Not for the servo loop.
  [[nodiscard]] RtStatus prepare(std::uint32_t part) noexcept;

  [[nodiscard]] Phase phase() const noexcept { return phase_.load(std::memory_order_acquire); }
  /// The part that is held, or was last.
  [[nodiscard]] std::uint32_t part() const noexcept {
    return part_.load(std::memory_order_acquire);
  }
  /// Where the parts are; of the one that is held, where it was taken.
  [[nodiscard]] std::span<const PartPlace> places() const noexcept {
    return {places_.data(), parts_->count()};
  }
  /// Energy that the spring has had from driven parts since `begin`, less what it gave them [J].
  /// Servo thread.
  [[nodiscard]] double given_j() const noexcept { return given_j_; }
  /// Driven parts after the last step, in the order of PartScenes::driven(). Servo thread.
  [[nodiscard]] const DrivenParts& driven() const noexcept { return *driven_; }
  /// It is one of two that move at once.
  [[nodiscard]] bool is_of_two() const noexcept { return parts_ != nullptr && parts_->hands() > 1; }
  /// As what the last step found the hand: calls before it have taken effect in it. Servo thread.
  [[nodiscard]] Phase stepped_as() const noexcept { return stepped_as_; }
  /// A lost driven part touches what is held, as the last `follow` has found.
  [[nodiscard]] bool is_driven_lost() const noexcept { return driven_lost_; }
  /// Bounds of a tick with the part that is held, or was last. Servo thread.
  [[nodiscard]] const SceneCapacity& bounds() const noexcept;
  /// The core and the scene of the part that is held, or was last. Servo thread.
  [[nodiscard]] HapticCore& core() noexcept { return *sides_[side_].core; }
  [[nodiscard]] const SceneView& scene() const noexcept { return sides_[side_].view; }
  /// Grip point of that part, in its mesh frame.
  [[nodiscard]] Vec3 grip_a() const noexcept;

 private:
  friend class Hands;

  struct Side {
    Room room;
    SceneView view;
    HapticCore* core = nullptr;
    JointMotion* motion = nullptr;  ///< null: no other moves that it may meet
  };

  /// As hand `number` of two: it holds its part where that starts, also after the first step, and
  /// leads it from there. `driven` are of both.
  [[nodiscard]] RtStatus begin_of_two(const PartScenes& parts, std::uint32_t number,
                                      const Room& room, DrivenParts& driven) noexcept;
  /// The law of both: what moves its part.
  void join(JointMotion& motion) noexcept;
  [[nodiscard]] RtStatus place(std::uint32_t part, Side& side) noexcept;
  [[nodiscard]] RtStatus open(std::uint32_t part, Side& side) noexcept;
  [[nodiscard]] RtStatus open_law(std::uint32_t part, Side& side) noexcept;
  /// A tick with a part in the hand: what its core is given, and what its result means.
  [[nodiscard]] StepInput enter(const StepInput& input) noexcept;
  [[nodiscard]] StepResult leave(StepResult result) noexcept;
  [[nodiscard]] StepResult step_core(const StepInput& input) noexcept;
  void take_given() noexcept;
  [[nodiscard]] Pose begun_wa() const noexcept;
  [[nodiscard]] Pose held_wa(bool leads) const noexcept;
  [[nodiscard]] StepInput led(const StepInput& input) const noexcept;
  [[nodiscard]] StepResult empty_step(const StepInput& input) noexcept;
  void put_down(const StepResult& last) noexcept;

  const PartScenes* parts_ = nullptr;
  std::array<Side, 2> sides_;
  std::array<PartPlace, kMostParts> places_;
  DrivenParts own_driven_;
  DrivenParts* driven_ = &own_driven_;  ///< of both hands where there are two
  std::uint32_t number_ = 0;            ///< of the hand
  bool driven_lost_ = false;            ///< one that touches the part
  Phase stepped_as_ = Phase::kEmpty;
  double given_j_ = 0;
  std::uint32_t next_ = 0, side_ = 0;
  std::uint64_t hash_ = 0;
  Vec3 first_grip_a_ = Vec3::Zero();   ///< of the part that it held at first, in its mesh frame
  Pose taken_wa_, felt_wa_, left_wa_;  ///< of the part that is held, or was last
  bool from_place_ = false;            ///< it was taken where it lay
  bool was_taken_ = false;             ///< there was a step with it
  bool begins_ = false;  ///< the next step is the first of a core that begins at a place
  std::atomic<std::uint32_t> part_{0};
  std::atomic<Phase> phase_{Phase::kEmpty};
};

}  // namespace haptic
