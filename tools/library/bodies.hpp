// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where the parts are that the hand holds one after another, as the caller has it.

#include <cstdint>
#include <span>

#include "rt_core/part_hand.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

/// The part that is held now.
struct HeldNow {
  std::uint32_t hold = 0;                        ///< its number and 1; 0: none is held
  double felt_pose[7] = {0, 0, 0, 0, 0, 0, 1};   ///< of its mesh frame in W
  double frame_pose[7] = {0, 0, 0, 0, 0, 0, 1};  ///< in W, of the frame that the scene is in
};

/// Number and 1 of the part that `hand` holds after a tick; 0: none.
[[nodiscard]] std::uint32_t hold_of(const PartHand& hand) noexcept;

/// As many as there is room for. @return how many there are. Whoever may prepare the hand calls it.
std::size_t write_bodies(const PartScenes& parts, const PartHand& hand, const HeldNow& now,
                         std::span<haptic_body> bodies) noexcept;

}  // namespace haptic::tools
