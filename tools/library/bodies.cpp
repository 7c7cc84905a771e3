// SPDX-License-Identifier: Apache-2.0
#include "tools/library/bodies.hpp"

#include <algorithm>
#include <string_view>

#include "tools/library/call.hpp"

namespace haptic::tools {

std::uint32_t hold_of(const PartHand& hand) noexcept {
  const PartHand::Phase phase = hand.phase();
  const bool holds = phase == PartHand::Phase::kHolding || phase == PartHand::Phase::kLettingGo;
  return holds ? hand.part() + 1 : 0;
}

std::size_t write_bodies(const PartScenes& parts, const PartHand& hand, const HeldNow& now,
                         std::span<haptic_body> bodies) noexcept {
  const Pose frame = pose_of_numbers(now.frame_pose);
  const std::size_t count = std::min<std::size_t>(bodies.size(), parts.count());
  for (std::uint32_t k = 0; k < count; ++k) {
    haptic_body& body = bodies[k];
    body = haptic_body{};
    body.part = k;
    body.role = static_cast<std::uint32_t>(parts[k].role);
    const std::string_view name = parts.name(k);
    name.copy(body.name, sizeof body.name - 1);
    if (now.hold == k + 1) {
      body.held_by = 1;
      std::copy_n(now.felt_pose, 7, body.pose);
      continue;
    }
    double pose[7];
    std::copy_n(hand.places()[k].p_wa_m, 3, pose);
    std::copy_n(hand.places()[k].q_wa_xyzw, 4, pose + 3);
    const Pose placed = pose_of_numbers(pose);
    write_numbers(Pose{frame.p_wa + frame.q_wa * placed.p_wa, frame.q_wa * placed.q_wa}, body.pose);
  }
  return parts.count();
}

}  // namespace haptic::tools
