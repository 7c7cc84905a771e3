// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the guide does in a tick.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

enum class GuideState : std::uint8_t {
  kNone,  ///< the scene has no guide
  kOff,   ///< switched off, or out for the clutch, recovery or the envelope
  kLost,  ///< looks for a station
  kOn
};

/// What the guide does in a tick, and where on the plan the part is.
struct Guidance {
  Wrench wrench_w;  ///< on the hand, about the grip point; to be added to the contact's
  GuideState state = GuideState::kNone;
  std::uint32_t station = 0, stations = 0;  ///< the last one passed; of how many
  std::uint32_t contacts = 0;               ///< pairs of pieces that touch at the next one
  Real cost_m = 0;                          ///< length of the rest of the way
  Real off_m = 0;                           ///< distance from the way
  Real energy_j = 0;                        ///< what it may still do
};

}  // namespace haptic
