// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The tick of two hands as their devices see it: checks, arming, limits and ramps for each device,
/// and one step of both parts between.

#include <array>
#include <span>

#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/hands.hpp"
#include "rt_core/servo_tick.hpp"

namespace haptic {

/// Owner: the servo thread; the hands and the recorders outlive it. No heap, lock or system call;
/// cost: that of Hands::step and a constant. Same inputs, same bits.
///
/// A fault releases the hand that it is of. Its part stays, held by its spring, and the other hand
/// goes on: a device that is lost, late or disarmed is to the other one a part held still. Both are
/// released by an emergency stop of either, a lost frame of the fixed parts, and a fault of the
/// core, which is one.
class TwoHandTick {
 public:
  /// @param recorders  by hand; may be nullptr.
  TwoHandTick(Hands& hands, const std::array<ServoParameters, kMostHands>& parameters,
              const std::array<FlightRecorder*, kMostHands>& recorders) noexcept
      : hands_(&hands),
        ticks_{ServoTick{hands.hand(0), parameters[0], recorders[0]},
               ServoTick{hands.hand(1), parameters[1], recorders[1]}} {}

  /// @param inputs  by hand. Their frame, driven parts and time are one: those of the first count.
  [[nodiscard]] std::array<ServoResult, kMostHands> step(
      const std::array<ServoInput, kMostHands>& inputs) noexcept;

 private:
  Hands* hands_;
  std::array<ServoTick, kMostHands> ticks_;
  std::array<std::uint32_t, kMostHands> present_{};  ///< SafetyFault of the last tick, by hand
};

}  // namespace haptic
