// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where the work of law kProxy ends in one tick, for any scene.

#include <cstdint>

namespace haptic {

/// Passes of the proxy in one tick: the default, and the most that a scene may ask for.
inline constexpr std::uint32_t kDefaultProxyPasses = 3, kMaxProxyPasses = 32;
/// Rounds of one pass: tries to impose what is needed, and again within smaller steps.
inline constexpr std::uint32_t kProxyRounds = 8, kProxyRetryRounds = 6, kProxyRetries = 2;
/// Planes of one pair that are looked at for one whose features touch.
inline constexpr std::uint32_t kMaxTouchingLooks = 8;
/// Steps of one pass that are tried when no round has found one: displaced ones (twice), shorter
/// ones.
inline constexpr std::uint32_t kMaxCorrections = 3, kMaxBackOffs = 4;
/// Programs that a pass solves again because p may not move as far in this tick as they ask.
inline constexpr std::uint32_t kMaxBoundPrograms = 6;
/// Planes in one quadratic program; its rows without friction.
inline constexpr std::uint32_t kMaxImposedPlanes = 32;
/// Planes that hold the proxy: a program has no more rows with a multiplier than unknowns.
inline constexpr std::uint32_t kMaxFeltPlanes = 6;
/// Rows of one program: without friction, and the most of all; iterations after which it ends with
/// what it has.
inline constexpr std::uint32_t kMaxProxyRows = 96, kMaxFrictionRows = 192, kMaxQpIterations = 64;
/// Contact points with friction in one program, and programs that one pass solves again because
/// their rows left one of the cones out by more than a share.
inline constexpr std::uint32_t kMaxFrictionCones = 48, kMaxConePrograms = 12;
/// Programs that one pass solves again because the shifts of its cones were not the slip, and those
/// of them for one set of planes.
inline constexpr std::uint32_t kMaxShiftPrograms = 24, kMaxShiftsOfRound = 12;
/// Balances of forces that are solved for one program.
inline constexpr std::uint32_t kMaxBalances = 8;
/// Ticks without slip after which a pair sticks.
inline constexpr std::uint32_t kStickTicks = 50;
/// Planes of a pair's valid set that are kept, nodes that a search for them looks at, and pairs
/// whose sets a pass has room for; further ones keep their certificate as the only plane.
inline constexpr std::uint32_t kMaxValidPlanes = 64, kMaxValidVisits = 512;
inline constexpr std::uint32_t kMaxValidSearches = 64;

/// Units of work, each about as long: a gap along a plane, a node of a valid set and a step of a
/// search are one each; a contact region, a quadratic program, an iteration of it and a balance of
/// forces are several, a node of the trees is a part of one.
inline constexpr std::uint32_t kRegionUnits = 6, kProgramUnits = 2, kQpStepUnits = 3,
                               kBalanceUnits = 16, kListVisitsOfUnit = 8;
/// Nodes that it takes to compare every two groups of pairs without a slot, and pairs of edges that
/// are looked at for the nearest of two pieces at most.
inline constexpr std::uint32_t kJoinVisits = 64, kMostEdgeLines = 256;
/// Units that a tick may spend before it ends with what it has: the least and the most that a scene
/// may ask for.
inline constexpr std::uint32_t kLeastWorkUnits = 50, kMostWorkUnits = 1000000;
/// Steps of an ended pass that the next one imposes planes at although the units are spent.
inline constexpr std::uint32_t kGrantedSteps = 3;
/// Programs that cones with friction may ask for although the units are spent, and their shifts:
/// one that is tried and one without any.
inline constexpr std::uint32_t kGrantedConePrograms = 2, kGrantedShiftPrograms = 2;
/// Nodes of the trees that lists of near pairs look at in one tick, at most, unless the part has to
/// wait for one; longer lists take several.
inline constexpr std::uint32_t kListVisitsOfTick = 16384;
/// A pair whose pieces have no more faces, and no more pairs of edges that can matter, is not
/// walked but scanned for its valid set.
inline constexpr std::uint32_t kMostScannedFaces = 512, kMostScannedPairs = 4096;
/// Pairs of edges that count as one unit where their signs are looked at, and support pairs that a
/// search for the nearest C-face of a pair asks for.
inline constexpr std::uint32_t kEdgePairsOfUnit = 8, kMaxNearestSupports = 256;
/// Edges of one piece that a scan has room for.
inline constexpr std::uint32_t kMostScannedEdges = kMaxValidVisits / 2;
/// Pairs that lack a plane, of which one is looked for whose features meet.
inline constexpr std::uint32_t kMaxMeetingLooks = 4;
/// Planes imposed in a pass whose directions are tried for a pair that has none of its own.
inline constexpr std::uint32_t kMaxSharedDirections = 8;
/// The faces of A are tried for a certificate where they are no more than this.
inline constexpr std::uint32_t kFewFaces = 16;

/// Pairs near the part that a tick can follow at once, further ones bound its way: where the scene
/// does not ask for more, the same with surfaces, whose facets are many, and the most that a scene
/// may ask for. As many as the pairs that a scene of solids lists, so that no such scene has more.
inline constexpr std::uint32_t kMaxNearPairs = 4096, kMaxNearFacets = 32768, kMostNearPairs = 32768;
/// With more slots than this a pass does not look at each of them: those far away are left aside
/// together.
inline constexpr std::uint32_t kManyNearPairs = 128;
/// `asked`: by the scene, 0: nothing; `facets`: it has pieces that are flat.
[[nodiscard]] constexpr std::uint32_t near_slots(std::uint32_t pairs, std::uint32_t asked,
                                                 bool facets) noexcept {
  const std::uint32_t usual = facets ? kMaxNearFacets : kMaxNearPairs;
  const std::uint32_t most = asked > usual ? asked : usual;
  return pairs < most ? pairs : most;
}
/// Seats of a scene at least: where more pairs than these are near, few of them matter to a pass.
inline constexpr std::uint32_t kLeastSeats = 256;
/// Views of pairs beyond those in seats: of the planes that a pass goes on with, and of pairs that
/// are looked at in passing.
inline constexpr std::uint32_t kGuestViews = kMaxImposedPlanes + 4;
/// Of the pairs that a tick follows so many have a seat, with what a pass needs to look at them
/// closely; the others take turns, each keeping its plane.
struct NearSeats {
  std::uint32_t seats = 0, views = 0;  ///< room for pairs looked at closely, and for views
  bool take_turns = false;             ///< there are more slots
};
/// `slots`: pairs that a tick follows; `asked`: by the scene, 0: all of them.
[[nodiscard]] constexpr NearSeats near_seats(std::uint32_t slots, std::uint32_t asked) noexcept {
  const std::uint32_t seats = asked > kLeastSeats ? asked : kLeastSeats;
  if (asked == 0 || seats + kGuestViews >= slots) return {slots, slots, false};
  return {seats, seats + kGuestViews, true};
}

}  // namespace haptic
