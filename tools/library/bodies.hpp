// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where the parts are that the hand holds one after another, as the caller has it.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/hands.hpp"
#include "tools/library/haptic.h"

namespace haptic::tools {

/// The parts that are held now, by hand, and the driven ones.
struct HeldNow {
  std::array<std::uint32_t, kMostHands> hold{};  ///< their numbers and 1; 0: none is held
  double felt_pose[kMostHands][7] = {{0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, 1}};  ///< in W
  double frame_pose[7] = {0, 0, 0, 0, 0, 0, 1};  ///< in W, of the frame that the scene is in
  std::uint64_t driven_count = 0;
  std::array<haptic_driven, kMostDriven> driven{};
};

/// Takes over what `hand` says of the driven parts after a tick, with the frame of `now`.
void note_driven(const PartHand& hand, HeldNow& now) noexcept;

/// Number of a driven part in their order; kMostDriven: `part` is none.
[[nodiscard]] std::uint32_t driven_of(const PartScenes& parts, std::uint32_t part) noexcept;

/// An owner moves it.
[[nodiscard]] bool is_owned(const PartScenes& parts, std::uint32_t part) noexcept;

/// HAPTIC_OK; HAPTIC_ERROR_VERSION; HAPTIC_ERROR_NUMBER: a speed or time is out of its range.
[[nodiscard]] int check_frame(const haptic_frame* frame) noexcept;

/// The record that follows `last`, of `frame` as it was given at `stamp_ns`.
[[nodiscard]] FrameRecord next_record(const FrameRecord& last, const haptic_frame& frame,
                                      std::int64_t stamp_ns) noexcept;

/// As many as there is room for. @return how many there are.
std::size_t write_driven(const HeldNow& now, std::span<haptic_driven> driven) noexcept;

/// Takes over what the hands hold after a tick, and where it is felt, with the frame of `now`.
void note_holds(const Hands& hands, HeldNow& now) noexcept;

/// As many as there is room for. @return how many there are. Whoever may prepare the hand calls it.
std::size_t write_bodies(const PartScenes& parts, const PartHand& hand, const HeldNow& now,
                         std::span<haptic_body> bodies) noexcept;

}  // namespace haptic::tools
