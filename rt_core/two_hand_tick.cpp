// SPDX-License-Identifier: Apache-2.0
#include "rt_core/two_hand_tick.hpp"

namespace haptic {

std::array<ServoResult, kMostHands> TwoHandTick::step(
    const std::array<ServoInput, kMostHands>& inputs) noexcept {
  const std::array<bool, kMostHands> felt{ticks_[0].is_felt(), ticks_[1].is_felt()};
  // The last word of a device that is away stops nobody but its own hand.
  const auto stops_both = [&](std::uint32_t k) {
    const bool is_there = inputs[k].state.link != LinkState::kAbsent;
    return is_there ? ticks_[k].is_stopped(inputs[k]) : inputs[k].emergency_stop;
  };
  const bool stopped = stops_both(0) || stops_both(1);
  hands_->follow({inputs[0].driven, inputs[0].now_ns, felt[0] || felt[1]});
  std::array<ServoInput, kMostHands> given = inputs;
  std::array<ServoTick::Opened, kMostHands> opened;
  std::array<const StepInput*, kMostHands> to_cores{};
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    given[k].now_ns = inputs[0].now_ns;
    given[k].frame = inputs[0].frame;
    given[k].emergency_stop = stopped;
    given[k].other_is_felt = felt[1 - k];
    given[k].has_followed = true;
    given[k].other_faults = present_[1 - k];
    opened[k] = ticks_[k].open(given[k]);
    if (opened[k].renders) to_cores[k] = &opened[k].to_core;
  }
  const std::array<StepResult, kMostHands> rendered = hands_->step(to_cores);
  const std::array<ServoResult, kMostHands> results{
      ticks_[0].close(given[0], opened[0], rendered[0]),
      ticks_[1].close(given[1], opened[1], rendered[1])};
  // A fault that a hand was told of is not told back.
  for (std::uint32_t k = 0; k < kMostHands; ++k)
    present_[k] = results[k].present & ~given[k].other_faults;
  return results;
}

}  // namespace haptic
