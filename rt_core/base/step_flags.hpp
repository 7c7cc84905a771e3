// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Flags of one tick, and the number that stands for what it did not search.

#include <cstdint>
#include <limits>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// D_near and depth where the goal pose was not searched.
inline constexpr Real kNotSearched = std::numeric_limits<Real>::quiet_NaN();

/// Flags of one tick; several may be set. "Pair" stands for at least one pair.
enum StepFlag : std::uint32_t {
  kFlagFirstTick = 1u << 0,         ///< a pair was searched for the first time
  kFlagRelocalised = 1u << 1,       ///< a later search of a pair found every bound stale: a jump
  kFlagFarBand = 1u << 2,           ///< a separated pair beyond the exact band: bound, not D_near
  kFlagVerdictTouching = 1u << 3,   ///< within rounding of the boundary; see thickness_m
  kFlagVerdictUndecided = 1u << 4,  ///< no certificate within the cap; see thickness_m
  kFlagNearSetCut = 1u << 5,        ///< a near set exceeded its room; D_near is exact
  kFlagInexact = 1u << 6,           ///< D_near of a near or colliding pair is a lower bound
  kFlagBudgetUsedUp = 1u << 7,      ///< a near pair was not searched: verdict, no exact D_near
  kFlagMotionExceeded = 1u << 8,    ///< more motion than the scene's speed certificate allows
  kFlagSeveralPlanes = 1u << 9,     ///< paper's law: applied to the deepest of several planes
  kFlagBadPose = 1u << 10,          ///< pose refused: wrench zero, state unchanged
  kFlagRecovery = 1u << 11,         ///< the proxy was put inside an obstacle and is led out of it:
                                    ///< wrench ramped out
  kFlagSaturated = 1u << 12,        ///< the pull has met its limit of force or torque
  kFlagClutched = 1u << 13,         ///< goal frozen; the wrench is ramped out or in
  kFlagProxyLimited = 1u << 14,     ///< a pass met a cap or was rejected, or a pull is not followed
  kFlagProxyStuck = 1u << 15,       ///< a pull above 0.05 N is left along a way that the planes
                                    ///< that hold the part leave open, and it has not moved
  kFlagHooked = 1u << 16,           ///< the goal is out of the proxy's reach: far apart for long
  kFlagPassivity = 1u << 17,        ///< the passivity controller took energy out
  kFlagRamping = 1u << 18,          ///< the wrench is ramped out, is out, or is ramped in
  kFlagOutsideEnvelope = 1u << 19,  ///< the scene's envelope was left, or was about to be: the
                                    ///< wrench is ramped out; latched until reset()
  kFlagBehind = 1u << 20,           ///< the proxy's budget of work was spent before it had got as
                                    ///< far as it could; see behind_ticks
  kFlagListFull = 1u << 21,  ///< more pairs are near than the scene's near_pairs: one without
                             ///< a slot has cut the proxy's step
  kFlagHeld = 1u << 22,  ///< the pull is held below the spring's: since kFlagBehind the part has
                         ///< not caught up
  kFlagDrivenBehind = 1u << 23,  ///< a driven part is not where its owner has it: something holds
                                 ///< it, or it is on its way from another place
  kFlagDrivenLost = 1u << 24     ///< the poses of a driven part that touches the part are late, too
                                 ///< fast or none: it stands, and the wrench is ramped out
};

/// Those that the search at the goal pose sets: never set in a tick that does without it.
inline constexpr std::uint32_t kGoalContactFlags =
    kFlagFirstTick | kFlagRelocalised | kFlagFarBand | kFlagVerdictTouching |
    kFlagVerdictUndecided | kFlagNearSetCut | kFlagInexact | kFlagBudgetUsedUp | kFlagSeveralPlanes;

}  // namespace haptic
