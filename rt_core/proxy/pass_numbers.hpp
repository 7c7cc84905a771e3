// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numbers of a pass that the law of one part and that of several bodies share. Not for inclusion
/// outside proxy/ and bodies/.

#include <cstdint>
#include <limits>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/proxy_limits.hpp"

namespace haptic {

// Rounds of a search.

/// By how much the first retry shrinks the trust region; in the last one it is kLastTolerances. A
/// part that rolls as it slides settles where the pull along the surface is as small against that
/// into it as the last region is short [rad]; and planes that a pair has beside the best one are
/// not imposed for so short a step.
inline constexpr Real kRetryShare = 0.1_r;
/// Rows linearised at a step hold a part that they let move by no more than this share of its way.
inline constexpr Real kHeldBack = 0.02_r;
/// A step that meets a pair where no plane of it is in the way is tried again with this share of
/// it, some times, and then with what the pair has room for, or at least that share.
inline constexpr Real kNearerShare = 0.25_r, kRoomShare = 0.9_r, kLeastRoom = 1.0e-3_r;
inline constexpr std::uint32_t kMostNearer = 3;
/// A step uses up no more than this share of what a list of near pairs leaves that takes long.
inline constexpr Real kListShare = 0.9_r;
/// A retry goes this many of the scale's steps far at the most.
inline constexpr Real kRetrySteps = 8;

// Ends of a pass.

/// Shares of the tolerance: a gap that deep is eased, by so much in a pass.
inline constexpr Real kDeepShare = 0.25_r, kEasedShare = 0.125_r;
/// Share of the pull that friction may leave of a part that rests: what creeps so slowly would
/// hardly come to an end.
inline constexpr Real kRestShare = 3.0e-4_r, kRestTolerances = 3;
/// Gaps less negative than this share of the tolerance are not worth a closing.
inline constexpr Real kClosedShare = 0.02_r;

// How far a tick may go.

/// A pull that is let go falls by this much in a tick, its torque by this much at the part's
/// radius, and either by at least this share of it.
inline constexpr Real kRelease_n = 1.0_r, kReleaseTurn_n = 0.75_r, kReleaseShare = 0.05_r;
/// A turn is at most this multiple of the chord between its quaternions.
inline constexpr Real kTurnOfChord = 2.25_r;

// Goals that rest.

/// Ticks with one goal, to the bit, are counted that lower the energy by less than
/// kOnItsWay of it though the part might have moved farther, less the others: the count after which
/// a step must lower it by more in each, and the one after which it would have to by more than any
/// spring holds.
inline constexpr Real kOnItsWay = 0.02_r;
inline constexpr std::uint32_t kPatience = 48, kMostHeld = kPatience + 2 * 128;
/// With one goal the planes are chosen from the start in every such tick.
inline constexpr std::uint32_t kChoicePeriod = 4;
/// Ticks with one goal of which every pass was rejected, after which nothing is tried any more.
inline constexpr std::uint32_t kLeastHeld = 4;

}  // namespace haptic
