// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the felt part keeps, by how long it lives. Between ticks: the placed part, its rest, the
/// pairs near it, the range that lists and steps are trusted in, planes that held it, what slid,
/// the last climb, the way out. For one tick: what it may still move by. For one pass: the pass and
/// its program. Memory is in the core's arena; a BoundedList or a span here is a view of it.

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/proxy/proxy_parts.hpp"

namespace haptic {

/// Between ticks: the part's free configuration, how far it has come, and what was computed there.
struct PlacedPart {
  GripPose pose;              ///< p: always free of obstacles but for a tolerance
  double path_m = 0;          ///< sum of the moves of the grip point, rounded up [m]
  double turn_rad = 0;        ///< sum of the turns, rounded up [rad]
  std::uint64_t version = 1;  ///< counts the poses: what was computed at one is known by it
  std::span<Real> lanes;      ///< A's vertices turned to the pose, by piece [m]
  std::span<std::size_t> lanes_begin;      ///< of each piece of A, in `lanes`
  std::span<std::uint64_t> lanes_version;  ///< of the pose that each piece was turned to last
  std::span<PlaneRegion> regions;          ///< contact regions at the pose, those asked for last
  std::uint32_t oldest_region = 0;
};

/// Between ticks, where the goal stays the same to the bit: is there nothing more to do?
struct RestWatch {
  GripPose goal;                      ///< of the last tick
  std::uint32_t held = 0;             ///< ticks in a row with this goal
  std::uint32_t slow = 0;             ///< of them those that gained little, less the others
  bool still = false;                 ///< nothing moved in the last tick
  bool choice_spent = false;          ///< nor did the budget suffice to choose the planes again
  bool settled = false;               ///< nor can, with planes chosen from the start
  ProxyTick* settled_tick = nullptr;  ///< its account
  /// The next pass starts without the planes of the last one.
  bool choose_from_start = false;
  std::uint64_t chosen_planes = 0;  ///< a hash of those last chosen from the start
  std::uint32_t chosen_ago = 0;     ///< passes that have ended with them since
};

/// Of each view, where pairs take turns: the slot that it was formed for last, and the pass that
/// keeps it.
struct ViewPlace {
  std::uint32_t slot = 0;
  std::uint64_t kept_in = 0;
};

/// Between ticks: the pairs near the part.
struct NearSlots {
  std::span<SceneView> scene;  ///< one
  bool has_facets = false;     ///< some piece is a facet
  NearPairs list;
  FacetScreen* screen = nullptr;  ///< of a scene that it serves
  std::span<ProxyPair> pairs;     ///< by slot
  std::span<PairView> views;      ///< by slot; where pairs take turns fewer
  std::span<ViewPlace> view_of;   ///< empty where every slot has a view of its own
  std::uint32_t next_view = 0, next_seat = 0;
  BoundedList<std::uint32_t> hot;  ///< slots of the pairs that are near, where there may be many
  double hot_until_m = 0;          ///< reading of the odometer at which another pair may be
  /// Motion of the last steps, fading: of the first pass of a tick, and of the later ones [m].
  std::array<Real, 2> pass_steps_m{};
  Real tick_motion_m = 0;   ///< of the last ticks, fading
  double tick_start_m = 0;  ///< reading of the odometer where this tick began
  bool waiting = false;     ///< a pair waits for a search that this tick had no budget for
  bool waited = false;      ///< one did in the last tick
};

/// Between ticks: how far steps and lists are trusted, and what lists cost.
struct TrustedRange {
  Real trust_m = std::numeric_limits<Real>::max();  ///< no step is longer
  Real list_m = std::numeric_limits<Real>::max();   ///< no list reaches farther
  double list_path_m = 0, list_turn_rad = 0;        ///< how far p had come where the list was begun
  std::uint32_t visits_of_tick = 0;  ///< nodes of the trees that a list may look at in a tick
  std::uint32_t list_ticks = 1;      ///< that the last list took
  std::uint32_t list_age = 0;        ///< ticks of the one that is begun
  std::uint32_t pass_units = 0;      ///< work of the last ticks but for lists, fading
};

/// Found at p of version `sets_version`, by any pass of any tick: a part that stays goes on with
/// what an earlier tick has found.
struct FoundPlanes {
  BoundedList<ValidPlane> valid;
  BoundedList<FoundSet> sets;
  std::uint64_t sets_version = 0;
};

/// Between ticks.
struct KeptPlanes {
  BoundedList<ImposedPlane> active;   ///< those with a multiplier in the last pass
  BoundedList<ImposedPlane> pending;  ///< of a pass at p that ended for want of budget
};

/// Between ticks, with friction.
struct SlipWatch {
  PoseError way;   ///< what the goal has moved by in this tick and p not yet
  PoseError came;  ///< what p has moved by in the first pass of this tick, or of the last one
  BoundedList<FrictionCone> last_cones;  ///< of the pass before
  bool wedged = false;  ///< contact points with friction lie in planes that are not parallel
};

/// Between ticks: the last climb that led nowhere, and the one of this tick.
struct ClimbWatch {
  std::array<std::uint32_t, kMaxFeltPlanes> pairs{};  ///< slots
  std::uint32_t pair_count = 0;
  Vec3 x0_w = Vec3::Zero();   ///< from where [m]
  Real v_j = 0, lacks_j = 0;  ///< the energy then, and what it lacked [J]
  double no_low_until_m = 0;  ///< reading of the odometer before which no face here can be low
  std::uint32_t leg = 0;      ///< this pass is the second leg of a climb, the so-manieth of a tick
};

/// Between ticks: out of obstacles that p is inside of.
struct WayOut {
  bool led_out = false;          ///< p was put inside an obstacle and has not been free since
  std::uint32_t short_ways = 0;  ///< passes that have gone out of several pairs at once
  Vec3 way_w = Vec3::Zero();     ///< unit; zero: none chosen
};

/// For one tick: what p may still move by, and what the tick has begun.
struct TickMove {
  Real way_left_m = 0, turn_left_rad = 0;  ///< what p may move by in the rest of the tick
  Real came_m = 0, came_rad = 0;           ///< of it, what the goal has come since p was not behind
  std::uint32_t behind_ticks = 0;          ///< in a row; between ticks
  std::uint8_t grants = 0;                 ///< Proxy::Grant
  bool spent = false;                      ///< a pass has stopped for want of budget
  std::uint32_t pass_of_tick = 0;          ///< number of the pass
  std::uint32_t list_visits_left = 0;
  std::uint32_t granted_lists = 0, granted_planes = 0;  ///< work of the screen
  bool may_close = true;      ///< no pass that closed a negative gap was rejected
  bool longest = false;       ///< the last step was as long as any among facets
  bool moved_little = false;  ///< the last pass of a tick whose goal moves
  bool list_cut = false;      ///< a step went no farther than the list of near pairs
};

/// For one pass.
struct PassState {
  std::uint64_t number = 0;           ///< counts all passes, for ProxyPair::reached_in
  BoundedList<ReachedPair> reached;   ///< those with a seat
  BoundedList<std::uint32_t> beside;  ///< slots of the others within reach
  Real reach_m = 0;                   ///< pairs farther apart than this are not in it
  Real nearest_m = 0;                 ///< no pair is nearer than this at p
  Real worst_gap_m = 0;               ///< at p, of the pairs in the list
  Real tried_m = 0;                   ///< motion of the step that was tried last
  std::uint32_t checks = 0;           ///< counts them, for ReachedPair::checked
  bool inside = false;                ///< p is led out of an obstacle
  bool recovering = false;            ///< as ProxyTick says
  bool whole = false;                 ///< the step is all that its program asks for
  bool is_short = false;              ///< the steps of this try are a few times the tolerance
  bool keeps_active = false;          ///< the planes that hold p stay as they are
};

/// For one pass: its quadratic program.
struct PassProgram {
  Spring secant;  ///< whose energy the pass lowers
  BoundedList<ImposedPlane> imposed;
  BoundedList<QpRow> rows;
  std::span<std::uint8_t> row_plane;  ///< index of the imposed plane of each row
  BoundedList<FrictionCone> cones;
  std::span<std::uint8_t> row_cone;  ///< index of the cone of each row
  QpResult found;                    ///< of the last program
  PoseError wish;                    ///< the step that the last program asked for
  PoseError near_wish;               ///< that of the last one without rows linearised at a step
  bool has_wish = false;             ///< `wish` is that of a program of this pass
  bool far_rows = false;             ///< rows linearised away from p are in the program
  Real close_m = 0;                  ///< of a negative gap, what rows may ask to be closed
  std::uint32_t cone_programs = 0;   ///< that cuts of cones asked for
  std::uint32_t shift_programs = 0;  ///< that shifts of cones did
  std::uint32_t bound_programs = 0;  ///< that bounds of the way and turn did
};

/// Working memory of one search at a time; nothing in it outlives the search.
struct ProxyScratch {
  std::span<std::uint64_t> search_memory;  ///< bounds of one full search
  ValidScratch valid;
  ManifoldScratch manifold;
  NearScratch* near = nullptr;  ///< the core's, for this tick
};

}  // namespace haptic
