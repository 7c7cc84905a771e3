// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Who may feel a force, and when: the state machine between the operator's deadman switch and the
/// output. Faults latch; re-arming is the only thing that clears them.

#include <cstdint>

namespace haptic {

/// Reasons to release the hand, as bits. Each latches.
enum SafetyFault : std::uint32_t {
  kFaultNotFinite = 1u << 0,      ///< a wrench was NaN or infinite
  kFaultBadPose = 1u << 1,        ///< the device's pose or twist was not finite or not unit
  kFaultStaleState = 1u << 2,     ///< no new state for longer than the limit
  kFaultLateTick = 1u << 3,       ///< the servo tick itself came too late
  kFaultDeviceLost = 1u << 4,     ///< link not ready any more
  kFaultDevice = 1u << 5,         ///< the device, or its link, reports a fault
  kFaultEmergencyStop = 1u << 6,  ///< input of the device, or emergency_stop()
  kFaultScene = 1u << 7,          ///< the core refused the scene's tick: part started inside, ...
  kFaultInternal = 1u << 8,       ///< a work counter over its bound, or an impossible value
  kFaultEnvelope = 1u << 9,       ///< orientation outside the declared envelope
  kFaultWorkspace = 1u << 10,     ///< position outside the declared workspace
  kFaultJump = 1u << 11,          ///< the pose moved farther than any hand can in that time
  kFaultSequence = 1u << 12,      ///< states came with the sequence not advancing
  kFaultFrame = 1u << 13          ///< the frame of the fixed parts: too fast, late, or no pose
};

/// Text of the lowest bit set, for people. Never null; static storage.
[[nodiscard]] const char* fault_text(std::uint32_t fault) noexcept;

/// What has to come first before a press of the deadman switch arms, as bits.
enum ArmingWait : std::uint32_t {
  kWaitDevice = 1u << 0,           ///< the link is not ready, or no state has come
  kWaitHomed = 1u << 1,            ///< the device is not calibrated
  kWaitPose = 1u << 2,             ///< no pose of it that can be used has been rendered yet
  kWaitLate = 1u << 3,             ///< states or ticks come too late
  kWaitInside = 1u << 4,           ///< the part is being led out of an obstacle
  kWaitCause = 1u << 5,            ///< the cause of a fault is there
  kWaitRampOut = 1u << 6,          ///< the force ramps to zero
  kWaitDeadmanReleased = 1u << 7,  ///< the switch is held: it is to be released, then pressed
  kWaitDeadmanPressed = 1u << 8    ///< the switch is to be pressed
};

enum class ArmingState : std::uint8_t {
  kDisarmed = 0,  ///< no force; deadman switch not held, or not pressed again
  kArming,        ///< deadman held, force ramps in
  kArmed,         ///< deadman held, full force
  kDisarming,     ///< ramping out, because the deadman switch was released or a fault came: a press
                  ///< now does not count
  kFaulted        ///< no force; a fault is latched
};

struct ArmingInput {
  bool deadman = false;        ///< held now; where that cannot be known: true, which is no release
  bool ready = false;          ///< device calibrated, state finite and fresh; asked at a press
  std::uint32_t present = 0;   ///< SafetyFault: causes present now
  bool output_is_zero = true;  ///< of the ramp, as of the last tick
  bool output_is_full = false;
};

/// Owner: the servo thread. Starts disarmed; a deadman that is held from the start does not count
/// until it has been released once.
///
///     disarmed --deadman pressed, ready, no cause present: latch cleared--> arming --> armed
///     arming, armed --deadman released--> disarming --> disarmed
///     any --cause present--> (latched) disarming --> faulted
///     faulted --deadman released and pressed again, ready, no cause present--> arming
class Arming {
 public:
  ArmingState update(const ArmingInput& input) noexcept;

  [[nodiscard]] ArmingState state() const noexcept { return state_; }
  [[nodiscard]] std::uint32_t latched() const noexcept { return latched_; }  ///< SafetyFault
  [[nodiscard]] std::uint32_t first() const noexcept {
    return first_;
  }  ///< those of the tick that latched first
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }  ///< of armings
  /// True if the output may be other than zero: the ramp is asked in.
  [[nodiscard]] bool wants_force() const noexcept {
    return state_ == ArmingState::kArming || state_ == ArmingState::kArmed;
  }

 private:
  ArmingState state_ = ArmingState::kDisarmed;
  std::uint32_t latched_ = 0, first_ = 0, count_ = 0;
  bool was_released_ = false;  ///< the deadman, at the last update
};

}  // namespace haptic
