// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The records of law proxy: its lengths, pairs, planes, rows, and the account of a tick.

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/motion_envelope.hpp"
#include "rt_core/base/scalar.hpp"
#include "rt_core/law/coupling.hpp"
#include "rt_core/proxy/contact_manifold.hpp"
#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/felt_contact.hpp"
#include "rt_core/proxy/near_pairs.hpp"
#include "rt_core/proxy/proxy_qp.hpp"
#include "rt_core/proxy/valid_planes.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic {

// The lengths of law `proxy`, chosen for one size of part and scaled with it.

/// Lengths of the passes; they grow with the part.
struct ProxyScale {
  Real tolerance_m = 0;      ///< depth that counts as free
  Real skin_m = 0;           ///< gap that is held in a scene with facets
  Real step_m = 0;           ///< largest displacement of a pass
  Real turn_rad = 0;         ///< largest turn of a pass
  Real margin_m = 0;         ///< what corrections may add to a displacement
  Real manifold_m = 0;       ///< height within which a face or edge lies in a contact
  Real reach_m = 0;          ///< pairs farther apart than this cannot meet within a pass
  Real recovery_step_m = 0;  ///< way out that a pass of recovery goes
  Real climb_m = 0;          ///< a step no higher than this does not hold the part; 0: any does
  Real still_m = 0, still_rad = 0;  ///< a shorter move is none
  Real last_m = 0, last_rad = 0;    ///< a shorter move is the last of a tick whose goal moves
};

/// Lengths for a part whose vertices lie within `radius_m` of the grip point, in a scene with
/// coordinates up to `extent_m`; `tolerance_m` and `climb_m` replace the derived ones when > 0, and
/// with `climb_m` < 0 every step holds the part.
[[nodiscard]] ProxyScale proxy_scale(Real radius_m, Real extent_m, Real tolerance_m,
                                     Real climb_m = 0) noexcept;

/// What those lengths are chosen for.
struct SceneSize {
  Real radius_m = 0;  ///< every vertex of the part lies within it of the grip point
  Real extent_m = 0;  ///< largest distance from the origin, of obstacles and of the start
};
/// Cost: one look at each piece.
[[nodiscard]] SceneSize scene_size(const SceneView& scene) noexcept;
/// The lengths of a scene, with the tolerance and the climb that it asks for.
[[nodiscard]] ProxyScale proxy_scale(const SceneView& scene) noexcept;

static_assert(kMaxProxyRows <= kMaxQpRows, "with friction a program has more rows");

inline constexpr std::uint32_t kNoSet = ~0u;

struct SlideForce;
struct SlideForces;

/// What the proxy keeps of one pair near it. Pairs are named by their slot. Every pass looks at the
/// first line of the cache of each, and a step that has a direction to go by at the second.
struct alignas(64) ProxyPair {
  const PairView* view = nullptr;  ///< null: to be formed
  double clear_until_m = 0;        ///< reading of the odometer at which the gap may have closed
  Real reach_a_m = 0;              ///< lever of the piece of A about the grip point
  Real gap_m = 0;                  ///< along the plane at p, of version `gap_version`
  std::uint64_t gap_version = 0;
  std::uint64_t reached_in = 0;  ///< the pass that has it within reach
  bool known = false;
  bool inside = false;  ///< no plane had a gap: the part is led out
  bool waits = false;   ///< for a search that a tick had no budget for
  bool has_held = false;
  bool slips = true;              ///< it slid in one of the last kStickTicks ticks
  std::uint32_t quiet_ticks = 0;  ///< in which it did not
  /// When there is one: the direction along which the gap was measured, and along which the pair
  /// stays apart as long as clear_until_m says; the middle of the piece of A and the radius about
  /// it.
  Vec3 held_w = Vec3::Zero(), middle_a = Vec3::Zero();
  Real radius_a_m = 0;
  /// There: the gap less how far the middle was along it, and the reading of what p has turned by.
  Real held_m = 0;
  double held_turn_rad = 0;
  PlaneId plane;  ///< that last certified the pair, when known
  SupportPair support;
  Vec3 reference_w = Vec3::Zero();  ///< of B's body
  Real friction = 0;                ///< Coulomb coefficient while it slides
  Real friction_static = 0;         ///< the same while it sticks; below `friction` counts as that
  std::uint64_t held_in = 0;        ///< the last pass that had a plane of it
  PairIndex index = 0;              ///< of the scene
  std::uint32_t set = kNoSet;  ///< its valid set in the list of those found at p, if it has one
};

/// A pair that a pass can reach.
struct ReachedPair {
  std::uint32_t pair = 0;
  Real gap_m = 0;  ///< at p, along the pair's plane, or a lower bound of it
  /// Its certificate at the configuration checked last, or, where none was, the plane that came
  /// closest: of those that can carry a force while one of these is valid.
  PlaneId plane;
  SupportPair support;
  Real gap_p_m = 0;                ///< at p, along that plane
  Vec3 normal_q_w = Vec3::Zero();  ///< of that plane, where gap_q_m is the gap itself
  Real gap_q_m = 0;                ///< there, or a lower bound of it
  Real path_m = 0;        ///< on the way there, a lower bound: of the plane between its two ends
  bool exact_p = true;    ///< gap_m is the gap itself
  bool unsure = false;    ///< no plane certifies it at p, for want of budget
  bool exact_q = false;   ///< gap_q_m is, along `plane`
  bool shared = false;    ///< gap_q_m is, along normal_q_w, the normal of a plane of another pair
  Real shared_m = 0;      ///< the largest gap there along the normal of one
  bool open = false;      ///< `plane` is its own still, which does not certify it
  bool searched = false;  ///< its valid set is there
  bool sound = false;     ///< the check of number `checked` has certified it
  std::uint32_t checked = 0;
  std::uint32_t next_open = 0;  ///< of those that a check has found to lack
  /// True if a plane of another pair, moved out of the way, clears it too.
  [[nodiscard]] bool follows() const noexcept { return shared_m > gap_q_m; }
  /// Its valid set; the first `exposed_count` of it can carry a force.
  std::uint32_t valid_begin = 0, valid_count = 0, exposed_count = 0;
};

/// The valid set of a pair: a part of the list of valid planes.
struct FoundSet {
  std::uint32_t pair = 0, begin = 0, count = 0;
  std::uint32_t exposed = 0;  ///< the first of it, which can carry a force
};

/// A plane of a pair in the quadratic program.
struct ImposedPlane {
  std::uint32_t pair = 0;
  PlaneId id;
  SupportPair support;
  bool at_start = false;  ///< its rows at p are in
  bool at_step = false;   ///< and those at the step below from p
  std::uint8_t times = 0;
  Vec3 dx_m = Vec3::Zero(), dtheta_rad = Vec3::Zero();
};

/// How a turn dtheta of A changes the gap along a direction w: by w.(dtheta x App) + turn.dtheta.
struct RowArm {
  Vec3 app_w = Vec3::Zero();   ///< contact point about the grip point, W axes [m]
  Vec3 turn_w = Vec3::Zero();  ///< plane_turn [m]
};

/// What a turn adds to the gap along `w` [m].
[[nodiscard]] inline Real turned_m(const RowArm& arm, const Vec3& w,
                                   const Vec3& dtheta_rad) noexcept {
  return (arm.app_w.cross(w) + arm.turn_w).dot(dtheta_rad);
}

/// A contact point with friction in the quadratic program: n.dp - mu (|dp_t| - s) >= least, with
/// the motion dp of the point, its part dp_t along the plane, and the shift s, which is to become
/// |dp_t|.
struct FrictionCone {
  RowArm arm;
  Vec3 normal_w = Vec3::Zero();
  Vec3 direction_w = Vec3::Zero();  ///< unit, along the plane: against the slip
  Real shift_m = 0;                 ///< s
  Real least_m = 0;
  Real friction = 0;
  std::uint32_t pair = 0;
  std::uint8_t imposed = 0;  ///< index of its plane
  std::uint8_t number = 0;   ///< among the points of its pair
};

/// Contact regions at the proxy that are kept while it stays.
inline constexpr std::uint32_t kKeptRegions = kMaxFeltPlanes + 2;

/// A pull that the planes leave and the proxy has not followed is said when it is larger [N].
inline constexpr Real kResidual_n = 0.01_r;

/// A plane at the proxy, the gap along it and its contact region.
struct PlaneRegion {
  std::uint32_t pair = 0;
  std::uint64_t version = 0;  ///< of the configuration; 0: none
  PlaneGap gap;
  bool overlap = false;        ///< the two features of the plane overlap as seen along it
  Vec3 turn_w = Vec3::Zero();  ///< plane_turn, where they do not
  std::uint32_t count = 0;
  std::array<ManifoldPoint, kMaxManifoldPoints> points;
};

/// The account of one tick: written by addition, and `rounds`, `rows` and `qp_iterations` as those
/// of the largest pass or program.
struct ProxyWork {
  std::uint32_t passes = 0, rejected = 0;
  std::uint32_t rounds = 0, rows = 0, qp_iterations = 0;
  std::uint32_t qp_programs = 0, qp_steps = 0;
  std::uint32_t plane_gaps = 0, valid_nodes = 0, full_searches = 0, search_work = 0;
  std::uint32_t regions = 0;      ///< contact regions found
  std::uint32_t balances = 0;     ///< of the forces of what rubs
  std::uint32_t list_visits = 0;  ///< nodes of the trees that lists of near pairs looked at
  std::uint32_t screened = 0;     ///< work of the screen, in kScreenOfUnit of a unit

  /// In units of the budget.
  [[nodiscard]] std::uint32_t units() const noexcept {
    return plane_gaps + valid_nodes + search_work + kRegionUnits * regions +
           kProgramUnits * qp_programs + kQpStepUnits * qp_steps + kBalanceUnits * balances +
           list_visits / kListVisitsOfUnit + screened / kScreenOfUnit;
  }
};

/// One tick of the proxy: what came of it, and what it cost.
struct ProxyTick {
  PoseError error;  ///< of the goal against the proxy at the end
  Real gap_m = 0;   ///< smallest known gap, a lower bound of the distance
  /// The end is no higher than the start but for rounding: a pass may raise the energy to close a
  /// gap that is negative, by no more than half of what earlier passes of the tick have lowered it.
  Real start_potential_j = 0, end_potential_j = 0;
  Real residual_n = 0;  ///< pull that the planes of the last program leave, were p to follow it
  std::uint32_t behind_ticks = 0;  ///< ticks in a row that have ended for want of budget
  bool spent = false;              ///< this is one
  bool moved = false;              ///< p is not where it was
  bool limited = false;            ///< a cap was met, or a residual is left
  bool recovering = false;  ///< the last pass has led p out of an obstacle that it was put in, or
                            ///< out of more than what rounding and low steps make: no force is due
  bool crowded = false;     ///< pairs that the list has no slot for have cut a step
  ProxyWork work;
};

}  // namespace haptic
