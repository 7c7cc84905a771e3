// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/arming.hpp"

#include <bit>

namespace haptic {

const char* fault_text(std::uint32_t fault) noexcept {
  static constexpr const char* kTexts[] = {
      "a wrench was not finite",
      "the device's pose or twist is not usable",
      "the state of the device was not renewed",
      "the servo tick came too late",
      "the device is lost",
      "the device or its link reports a fault",
      "emergency stop",
      "the part starts inside an obstacle",
      "internal: work over its bound, or an impossible value",
      "the part is turned out of its envelope",
      "the part is outside its workspace",
      "the device's pose jumped",
      "states of the device are out of order",
      "the frame of the fixed parts is too fast, late or not finite",
  };
  constexpr int kCount = sizeof(kTexts) / sizeof(kTexts[0]);
  static_assert(1u << (kCount - 1) == kFaultFrame);
  if (fault == 0) return "no fault";
  const int lowest = std::countr_zero(fault);
  return lowest < kCount ? kTexts[lowest] : "unknown fault";
}

ArmingState Arming::update(const ArmingInput& input) noexcept {
  // The switch itself: held from the start is no press, and a press that finds a cause present
  // is used up.
  const bool pressed = input.deadman && was_released_;
  was_released_ = !input.deadman;
  const bool cause = input.present != 0;
  if (cause && latched_ == 0) first_ = input.present;
  latched_ |= input.present;

  switch (state_) {
    case ArmingState::kArming:
    case ArmingState::kArmed:
      if (cause || !input.deadman) {
        state_ = ArmingState::kDisarming;
      } else if (input.output_is_full) {
        state_ = ArmingState::kArmed;
      }
      break;
    case ArmingState::kDisarming:  // a press counts only where there is nothing left to let go of
      if (input.output_is_zero) {
        state_ = latched_ != 0 ? ArmingState::kFaulted : ArmingState::kDisarmed;
      }
      break;
    case ArmingState::kDisarmed:
    case ArmingState::kFaulted:
      if (cause) {
        state_ = ArmingState::kFaulted;
      } else if (pressed && input.ready) {
        latched_ = first_ = 0;
        count_ += 1;
        state_ = ArmingState::kArming;
      }
      break;
  }
  return state_;
}

}  // namespace haptic
