// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contacts of a tick with their shares of its wrench. The core renders one wrench and says
/// which planes hold the part; how much each point carries follows from neither where more than
/// three share a face, so the shares are those of least squares among all that push.

#include <cstdint>
#include <span>

#include "rt_core/base/pose.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

/// A tick of law kProxy whose contacts are wanted, in the frame of the fixed parts.
struct FeltTick {
  Wrench wrench_w;  ///< on the hand, about the grip point
  Pose felt_wa;     ///< of A's mesh frame
};

/// As many as there is room for. `rest`: what of the wrench they do not make. @return how many
/// there are. Between ticks, on their thread. No heap.
std::size_t write_contacts(HapticCore& core, const SceneView& scene, const FeltTick& tick,
                           std::span<haptic_contact> contacts, Wrench& rest) noexcept;

/// From the frame of the fixed parts to W.
void turn_into(const Pose& frame_wf, std::span<haptic_contact> contacts, Wrench& rest) noexcept;

}  // namespace haptic::tools
