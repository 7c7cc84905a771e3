// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The god-object of the virtual part: a configuration that is always free, drawn to the goal by a
/// spring and held by C-face planes (Zilles and Salisbury, IROS 1995; Ortega, Redon, Coquillart,
/// IEEE TVCG 13(3), 2007, here in the paper's C-space and with the planes that certify each step).
///
/// A pair of convex pieces is free when *some* C-face plane has a gap: so a plane is imposed only
/// when a step would leave a pair without one. Each pass moves the proxy p to the minimum of the
/// spring's energy under the imposed planes, one small exact quadratic program, and accepts the
/// step only when every near pair keeps one plane that had a gap at p and has one still: a step
/// cannot have crossed an obstacle, however thin. After every pass p is free and the energy has not
/// risen, so a tick may end after any of them.

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
  /// Whether a plane of another pair, moved out of the way, clears it too.
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

/// Work and state of one tick of the proxy.
struct ProxyTick {
  PoseError error;  ///< of the goal against the proxy at the end
  Real gap_m = 0;   ///< smallest known gap, a lower bound of the distance
  /// The end is no higher than the start but for rounding: a pass may raise the energy to close a
  /// gap that is negative, by no more than half of what earlier passes of the tick have lowered it.
  Real start_potential_j = 0, end_potential_j = 0;
  Real residual_n = 0;  ///< pull that the planes of the last program leave, were p to follow it
  std::uint32_t passes = 0, rounds = 0, rows = 0, qp_iterations = 0, plane_gaps = 0;
  std::uint32_t valid_nodes = 0, full_searches = 0, search_work = 0, rejected = 0;
  std::uint32_t qp_programs = 0, qp_steps = 0;
  std::uint32_t regions = 0;       ///< contact regions found
  std::uint32_t list_visits = 0;   ///< nodes of the trees that lists of near pairs looked at
  std::uint32_t behind_ticks = 0;  ///< ticks in a row that have ended for want of budget
  std::uint16_t balances = 0;      ///< of the forces of what rubs
  std::uint32_t screened = 0;      ///< work of the screen, in kScreenOfUnit of a unit
  bool spent = false;              ///< this is one
  bool moved = false;              ///< p is not where it was
  bool limited = false;            ///< a cap was met, or a residual is left
  bool inside = false;             ///< the last pass has led p out of an obstacle
  bool recovering = false;         ///< the same of where it was put, or of more than what rounding
                                   ///< and low steps make: no wrench is due
  bool crowded = false;            ///< pairs that the list has no slot for have cut a step

  /// Work so far, in units of the budget.
  [[nodiscard]] std::uint32_t units() const noexcept {
    return plane_gaps + valid_nodes + search_work + kRegionUnits * regions +
           kProgramUnits * qp_programs + kQpStepUnits * qp_steps + kBalanceUnits * balances +
           list_visits / kListVisitsOfUnit + screened / kScreenOfUnit;
  }
};

/// The proxy of one scene. Memory is placed once; nothing grows.
class Proxy {
 public:
  struct Parameters {
    Spring spring;
    ProxyScale scale;
    Real radius_m = 0;  ///< of A about the grip point
    std::uint32_t passes = kDefaultProxyPasses;
    /// Units of work after which a tick begins nothing more; what it has begun it ends.
    std::uint32_t work_units = std::numeric_limits<std::uint32_t>::max();
    Real epsilon_m = 0;  ///< of the scene: for full searches
    /// The proxy never leaves it: no step that a pass considers does. Goals must lie inside.
    MotionEnvelope envelope;
    bool locked = false;  ///< the part never turns: all poses have one orientation
  };

  /// Places everything; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& scene) noexcept;
  /// Forgets all pairs; the next tick starts at its goal.
  void reset() noexcept;
  /// Reads the pieces; `scene` itself need not outlive the call, its blob must. Not for the servo
  /// loop.
  void read_scene(const SceneView& scene) noexcept;
  void configure(const Parameters& parameters) noexcept { parameters_ = parameters; }

  /// Moves the proxy towards `goal`. `scratch` is that of the core's near-set search, free at this
  /// time. Cost: bounded by the caps above times the pairs within reach.
  [[nodiscard]] ProxyTick tick(const GripPose& goal, NearScratch& scratch) noexcept;

  [[nodiscard]] const GripPose& pose() const noexcept { return p_; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  /// Of the pull's translation, what the planes of the last program hold.
  [[nodiscard]] Real held_m() const noexcept;
  /// Planes that hold the proxy: those with a multiplier in the last pass.
  [[nodiscard]] std::span<const ImposedPlane> active() const noexcept { return active_.view(); }
  /// Those of them that the proxy touches, at the end of the last tick.
  [[nodiscard]] const FeltContact& felt() const noexcept { return felt_[0]; }
  /// Appends the near set of pair `index` at the proxy to `near`, by a search without history that
  /// leaves the proxy as it is; for reports between ticks. `pose`: the pair's.
  [[nodiscard]] NearResult near_set_of(PairIndex index, NearScratch& scratch,
                                       BoundedList<NearNode>& near, PairPose& pose) noexcept;

 private:
  struct Step;
  struct Check;
  struct HeldGap;
  struct PlaneWorth;
  struct SharedGap;

  /// How a pass ended.
  enum class PassEnd : std::uint8_t {
    kMoved,
    kDone,      ///< no step lowers the energy by more than rounding
    kRejected,  ///< steps that would have are not certified
    kSpent      ///< for want of budget
  };
  /// What a tick may begin once however much it has spent: else no budget could be too small for
  /// the part to arrive.
  enum Grant : std::uint8_t { kRoundGrant = 1, kSetGrant = 2, kSearchGrant = 4, kSweepGrant = 8 };

  [[nodiscard]] PassEnd pass(const GripPose& goal, ProxyTick& tick) noexcept;
  void gather(const PoseError& error, ProxyTick& tick) noexcept;
  void bound_move(const GripPose& goal) noexcept;
  [[nodiscard]] bool may_move() const noexcept;
  void widen(Real motion_m, ProxyTick& tick) noexcept;
  void reach_all(ProxyTick& tick) noexcept;
  void list_pairs(ProxyTick& tick) noexcept;
  [[nodiscard]] std::span<const std::uint32_t> hot_pairs() noexcept;
  /// What the gap of every pair that hot_pairs has left aside is at least.
  [[nodiscard]] Real cold_m() const noexcept {
    if (hot_.capacity() == 0) return std::numeric_limits<Real>::max();
    return static_cast<Real>(hot_until_m_ - odometer_m());
  }
  /// What a motion may be, as list_motion_m() has it, that meets no pair which is not in the list.
  [[nodiscard]] Real unlisted_m() const noexcept {
    if (has_screen()) return screen_->clear_m() - skin_m();
    return near_pairs_.unlisted_m(list_odometer_m(near_pairs_.least_share())) -
           skin_m() / near_pairs_.least_share();
  }
  /// A motion by the odometer of the list.
  [[nodiscard]] Real list_motion_m(Real far_m, Real turn_rad) const noexcept {
    return far_m / near_pairs_.least_share() + turn_rad * parameters_.radius_m;
  }
  /// Whether the scene has more pairs than slots, of pieces whose faces are asked then.
  [[nodiscard]] bool has_left_out() const noexcept { return near_pairs_.may_leave_out(); }
  /// What the gap of every pair is at least that the list has had no slot for.
  [[nodiscard]] Real left_out_m() const noexcept;
  /// Held between every two pieces of a scene with facets, solid ones too: where a solid and a
  /// facet lie in one plane, the part slides on evenly.
  [[nodiscard]] Real skin_m() const noexcept {
    return has_facets() ? parameters_.scale.skin_m : Real{0};
  }
  void stand_beside(const ReachedPair& reached, ProxyTick& tick) noexcept;
  [[nodiscard]] ReachedPair seen(std::uint32_t slot) const noexcept;
  [[nodiscard]] std::uint32_t free_seat(Real least_m, bool shared_too) noexcept;
  void give_seat(std::uint32_t seat, std::uint32_t& slot, const ReachedPair& reached) noexcept;
  /// The scene has more near pairs than seats: some take turns.
  [[nodiscard]] bool takes_turns() const noexcept {
    return kSceneTraits.many_pairs && !view_of_.empty();
  }
  /// The slots of the pairs within reach that have no seat.
  [[nodiscard]] std::span<std::uint32_t> beside() noexcept {
    return takes_turns() ? std::span{beside_.begin(), beside_.size()} : std::span<std::uint32_t>{};
  }
  void need_view(ProxyPair& pair, ProxyTick& tick) noexcept {
    if (pair.view == nullptr) form_view(pair, tick);
  }
  void form_view(ProxyPair& pair, ProxyTick& tick) noexcept;
  void keep_view(std::uint32_t slot, bool keep) noexcept;
  void forget(std::uint32_t slot) noexcept;

  /// Facets screened in bulk (proxy_screen.cpp).
  [[nodiscard]] bool has_screen() const noexcept {
    return kSceneTraits.facets && screen_ != nullptr;
  }
  void renew_screen(ProxyTick& tick) noexcept;
  void settle_screen(ProxyTick& tick) noexcept;
  void give_back(ProxyTick& tick) noexcept;
  enum class Screened : std::uint8_t { kDone, kMissed, kSpent, kRefused };
  [[nodiscard]] Screened screen_step(const Step& step, Real least_m, bool goes_on,
                                     ProxyTick& tick) noexcept;
  [[nodiscard]] bool take_missed(bool reach, ProxyTick& tick) noexcept;
  [[nodiscard]] std::uint32_t screen_budget(std::uint32_t granted,
                                            const ProxyTick& tick) const noexcept;
  void count_screened(std::uint32_t& granted, ProxyTick& tick) noexcept;
  [[nodiscard]] Real screened_least_m() const noexcept;
  void enter(std::uint32_t slot) noexcept;
  void hold(ProxyPair& pair, const Vec3& normal_w, Real gap_m) const noexcept;
  [[nodiscard]] Real along_held_m(const ProxyPair& pair) const noexcept;
  [[nodiscard]] Real clear_m(const ProxyPair& pair) const noexcept;
  [[nodiscard]] bool measure(ProxyPair& pair, ProxyTick& tick) noexcept;
  [[nodiscard]] Real take_in(std::uint32_t slot, Real known_m, ProxyTick& tick) noexcept;
  void look_closer(ReachedPair& reached, ProxyTick& tick) noexcept;
  [[nodiscard]] bool reach_pair(ProxyPair& pair, ReachedPair& reached, ProxyTick& tick) noexcept;
  [[nodiscard]] Real least_fall_j(Real potential_j) const noexcept;
  [[nodiscard]] bool has_budget(const ProxyTick& tick) const noexcept {
    return tick.units() < parameters_.work_units;
  }
  [[nodiscard]] bool may_begin(Grant grant, ProxyTick& tick) noexcept;
  [[nodiscard]] bool may_search(ProxyPair& pair, ProxyTick& tick) noexcept;
  void keep_plane(const ReachedPair& reached) noexcept;
  void keep_found() noexcept;
  void adapt_trust(PassEnd end) noexcept;
  [[nodiscard]] Real most_trust_m() const noexcept;
  /// Some piece is a facet.
  [[nodiscard]] bool has_facets() const noexcept { return kSceneTraits.facets && has_facets_; }
  /// Whether there are facets, and so many pairs that a list of those near takes long.
  [[nodiscard]] bool has_long_lists() const noexcept {
    return has_facets() && list_visits_of_tick_ >= kListVisitsOfTick;
  }
  [[nodiscard]] std::size_t step_place() const noexcept {
    return std::min<std::size_t>(pass_of_tick_, pass_steps_m_.size() - 1);
  }
  void search_fully(ProxyPair& pair, ProxyTick& tick) noexcept;
  void search_between(ProxyPair& pair, ProxyTick& tick) noexcept;
  [[nodiscard]] bool find_face(ProxyPair& pair, ProxyTick& tick) noexcept;
  void find_valid(ReachedPair& reached, ProxyTick& tick) noexcept;
  void recall_valid(ReachedPair& reached) const noexcept;

  [[nodiscard]] bool solve(const PoseError& error, Step& step, ProxyTick& tick) noexcept;
  [[nodiscard]] bool correct(Step& step, ProxyTick& tick) noexcept;
  [[nodiscard]] PassEnd end_spent() noexcept;

  /// Recovery (proxy_recovery.cpp).
  [[nodiscard]] Real way_out_m(const Vec3& along_w, Real least_m, Real most_m,
                               ProxyTick& tick) noexcept;
  [[nodiscard]] Real choose_way_out(ProxyTick& tick) noexcept;
  [[nodiscard]] Vec3 short_way_out(ProxyTick& tick) noexcept;
  void lead_out(const GripPose& goal, ProxyTick& tick) noexcept;
  void go_out(const Vec3& way_m, const GripPose& goal, ProxyTick& tick) noexcept;

  /// Steps that do not hold the part (proxy_climb.cpp).
  struct Rise;
  struct ClimbStart;
  [[nodiscard]] bool climb(const GripPose& goal, ProxyTick& tick) noexcept;
  [[nodiscard]] bool may_climb(ProxyTick& tick) noexcept;
  [[nodiscard]] bool find_rise(Rise& rise, ProxyTick& tick) noexcept;
  [[nodiscard]] bool is_wedged_beside(const Rise& rise) const noexcept;
  [[nodiscard]] bool find_low_face(const ImposedPlane& imposed, const Vec3& normal_w,
                                   ValidPlane& low, Real& room_m, ProxyTick& tick) noexcept;
  [[nodiscard]] PlaneGap gap_at_p(const ImposedPlane& plane, ProxyTick& tick) const noexcept;
  void step_back(const ClimbStart& start, ProxyTick& tick) noexcept;

  [[nodiscard]] bool is_imposed(std::uint32_t pair, const PlaneId& id) const noexcept;
  void impose_last(const PoseError& error, ProxyTick& tick) noexcept;
  void impose_pending(const PoseError& error, ProxyTick& tick) noexcept;
  [[nodiscard]] bool meets(const ReachedPair& reached, const Step* step, ProxyTick& tick) noexcept;
  void take_touching(const ReachedPair& reached, ImposedPlane& plane, ProxyTick& tick) noexcept;
  [[nodiscard]] std::uint32_t worst_that_meets(const Check& check, const Step& step, Real least_m,
                                               ProxyTick& tick) noexcept;
  [[nodiscard]] bool impose(std::uint32_t number, const Step& step, const PoseError& error,
                            ProxyTick& tick) noexcept;
  [[nodiscard]] bool make_room(std::uint32_t rows, std::uint32_t cones,
                               const PoseError& error) noexcept;
  [[nodiscard]] const PlaneRegion& region_at_p(std::uint32_t pair, const PlaneId& id,
                                               SupportPair support, ProxyTick& tick) noexcept;
  void find_region(const ProxyPair& pair, const GripPose& at, PlaneRegion& region,
                   ProxyTick& tick) noexcept;
  [[nodiscard]] bool add_rows_at_p(std::uint32_t imposed, const PoseError& error,
                                   ProxyTick& tick) noexcept;
  [[nodiscard]] bool add_rows(std::uint32_t imposed, const Step& at, const PoseError& error,
                              bool support_too, ProxyTick& tick) noexcept;
  [[nodiscard]] bool add_region(std::uint32_t imposed, const PlaneRegion& region,
                                const PoseError& error, const Step* at = nullptr) noexcept;
  [[nodiscard]] PlaneGap gap_at(const ProxyPair& pair, const Step& at, const PlaneId& id,
                                SupportPair support, ProxyTick& tick) const noexcept;
  [[nodiscard]] bool add_row(std::uint32_t imposed, const RowArm& arm, Real gap_m,
                             const Vec3& normal_w, const Step* at, const PoseError& error) noexcept;
  [[nodiscard]] bool push_row(std::uint32_t imposed, const RowArm& arm, const Vec3& w, Real least_m,
                              const PoseError& error, std::uint32_t most_rows) noexcept;
  [[nodiscard]] QpResult solve_rows(Real tolerance_m, ProxyTick& tick,
                                    std::span<const std::uint8_t> first = {}) const noexcept;
  void remember_active() noexcept;
  [[nodiscard]] bool stay_still(Step& step, ProxyTick& tick) noexcept;
  void feel(ProxyTick& tick) noexcept;
  [[nodiscard]] PoseError asked(const QpVector& z, const PoseError& error) const noexcept;
  [[nodiscard]] PoseError bounded(const PoseError& error, Real tolerance_m,
                                  ProxyTick& tick) noexcept;
  [[nodiscard]] bool crowded() const noexcept;
  [[nodiscard]] bool choice_is_due() noexcept;
  [[nodiscard]] bool is_still(const Step& step) const noexcept;
  [[nodiscard]] bool gains_nothing(const Step& step, const ProxyTick& tick) const noexcept;
  [[nodiscard]] Real left_over_n(const PoseError& wish, const Vec3& dx_m,
                                 const Vec3& dtheta_rad) const noexcept;

  /// Friction (proxy_friction.cpp).
  [[nodiscard]] static bool rubs(const ProxyPair& pair) noexcept {
    return kSceneTraits.friction && pair.friction > 0;
  }
  void begin_cones() noexcept;
  [[nodiscard]] bool add_cone(std::uint32_t imposed, const RowArm& arm, const Vec3& normal_w,
                              Real least_m, const PoseError& error) noexcept;
  [[nodiscard]] bool push_cone_row(std::uint32_t at, const Vec3& direction_w,
                                   const PoseError& error) noexcept;
  void cut_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept;
  [[nodiscard]] Vec3 slip_of(const FrictionCone& cone, const PoseError& motion) const noexcept;
  [[nodiscard]] Real rise_of(const FrictionCone& cone, const PoseError& motion) const noexcept;
  void note_slip(const Step& step) noexcept;
  void settle_slip() noexcept;
  [[nodiscard]] bool sticks() const noexcept;
  [[nodiscard]] bool rests_on_friction() const noexcept;
  [[nodiscard]] bool rests(const PoseError& error, const ProxyTick& tick) const noexcept;
  /// Of a tick, and no leg of a climb.
  [[nodiscard]] bool is_first_pass() const noexcept { return pass_of_tick_ == 0 && climbing_ == 0; }
  /// Whether something of the scene rubs.
  [[nodiscard]] bool has_friction() const noexcept {
    return kSceneTraits.friction && cones_.capacity() > 0;
  }

  /// Shifts of cones (proxy_shift.cpp).
  void settle_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept;
  [[nodiscard]] Real wanted_shift_m(const FrictionCone& cone,
                                    const PoseError& motion) const noexcept;
  [[nodiscard]] bool shifts_fit(const PoseError& motion, bool may_lift) const noexcept;
  void shift_cones(const PoseError& motion) noexcept;
  [[nodiscard]] bool is_near(const PoseError& balanced, const PoseError& motion) const noexcept;
  [[nodiscard]] bool is_held(const PoseError& motion) const noexcept;
  /// What the forces of a program lead to where those that slide keep their planes.
  struct Balance {
    PoseError motion;
    QpVector z = QpVector::Zero();  ///< of the program
    bool is_exact = false;          ///< it keeps Coulomb's law and all planes
  };
  void take(const Balance& balance) noexcept;
  [[nodiscard]] bool find_balance(const PoseError& error, bool begins, Balance& found,
                                  ProxyTick& tick) const noexcept;
  [[nodiscard]] QpVector force_at(const FrictionCone& cone, const Vec3& w,
                                  bool pushes) const noexcept;
  void aim(SlideForce& force, const Vec3& slip) const noexcept;
  void take_forces(const PoseError& error, bool begins, SlideForces& taken) const noexcept;
  [[nodiscard]] bool keeps_the_rest(const Balance& found,
                                    std::span<const std::uint32_t> stuck) const noexcept;
  [[nodiscard]] bool hardly_slides(const FrictionCone& cone,
                                   const PoseError& motion) const noexcept;

  [[nodiscard]] Check check(const Step& step, Real least_m, ProxyTick& tick,
                            const Step* before = nullptr) noexcept;
  [[nodiscard]] Real least_from(Real least_m, Real gap_p_m) const noexcept;
  [[nodiscard]] Real worth_m(const ReachedPair& reached, Real least_m) const noexcept;
  void judge_gap(std::uint32_t k, Real least_m, Check& result) const noexcept;
  [[nodiscard]] PlaneWorth worth_of(const ReachedPair& reached, const ValidPlane& plane,
                                    const Step& step, Real least_m, ProxyTick& tick) const noexcept;
  static void take_plane(ReachedPair& reached, const PlaneWorth& plane) noexcept;
  [[nodiscard]] bool has_many_nodes(const ReachedPair& reached) const noexcept;
  [[nodiscard]] bool keeps_plane(ReachedPair& reached, const Step& step, Real least_m,
                                 ProxyTick& tick) const noexcept;
  [[nodiscard]] HeldGap held_gap(const ReachedPair& reached, const Step& step, Real far_m,
                                 Real turn_rad) const noexcept;
  [[nodiscard]] bool certify(ReachedPair& reached, const Step& step, Real least_m,
                             ProxyTick& tick) noexcept;
  [[nodiscard]] SharedGap shared_gap(ReachedPair& reached, const Step& step, Real least_m,
                                     ProxyTick& tick) const noexcept;
  [[nodiscard]] Real path_gap(const ProxyPair& pair, Real gap_p_m, const PlaneGap& at_q,
                              const Step& step) const noexcept;
  [[nodiscard]] Real path_gap(const ProxyPair& pair, const DirectionGap& at_p,
                              const DirectionGap& at_q, const Step& step) const noexcept;
  [[nodiscard]] Step step_by(const Vec3& dx_m, const Vec3& dtheta_rad) const noexcept;
  void accept(const Step& step) noexcept;
  [[nodiscard]] PairPose pose_of(const ProxyPair& pair) noexcept;
  [[nodiscard]] bool is_locked() const noexcept {
    return kSceneTraits.is_locked(parameters_.locked);
  }
  [[nodiscard]] PoseError error_of(const GripPose& goal, const GripPose& pose) const noexcept {
    return is_locked() ? place_error(goal, pose) : pose_error(goal, pose);
  }
  [[nodiscard]] double odometer_m(const ProxyPair& pair) const noexcept {
    return path_m_ + turn_rad_ * static_cast<double>(pair.reach_a_m);
  }
  /// That of the whole part.
  [[nodiscard]] double odometer_m() const noexcept { return list_odometer_m(1); }
  /// And of a list of near pairs with this least share.
  [[nodiscard]] double list_odometer_m(Real least_share) const noexcept {
    return (path_m_ / static_cast<double>(least_share) +
            turn_rad_ * static_cast<double>(parameters_.radius_m)) *
           (1 + kOdometerRounding);
  }

  Parameters parameters_;
  GripPose p_;
  bool started_ = false;
  bool led_out_ = false;              ///< p_ was put inside an obstacle and has not been free since
  double path_m_ = 0, turn_rad_ = 0;  ///< how far p_ has come, rounded up
  std::uint64_t version_ = 1;         ///< of p_: vertices are turned once for each

  std::span<SceneView> scene_;  ///< one
  NearPairs near_pairs_;
  FacetScreen* screen_ = nullptr;  ///< of a scene that it serves
  std::span<ProxyPair> pairs_;     ///< by slot
  std::span<PairView> views_;      ///< by slot; where pairs take turns fewer
  /// Of each view, where pairs take turns: the slot that it was formed for last, and the pass that
  /// keeps it.
  struct ViewPlace {
    std::uint32_t slot = 0;
    std::uint64_t kept_in = 0;
  };
  std::span<ViewPlace> view_of_;
  std::uint32_t next_view_ = 0, next_seat_ = 0;
  BoundedList<ReachedPair> reached_;   ///< those with a seat in this pass
  BoundedList<std::uint32_t> beside_;  ///< slots of the others within reach
  /// Found at p of version `sets_version_`, by any pass of any tick: a part that stays goes on with
  /// what an earlier tick has found.
  BoundedList<ValidPlane> valid_;
  BoundedList<FoundSet> sets_;
  std::uint64_t sets_version_ = 0;
  BoundedList<ImposedPlane> imposed_, active_;
  BoundedList<ImposedPlane> pending_;  ///< of a pass at p_ that ended for want of budget
  Real trust_m_ = std::numeric_limits<Real>::max();       ///< no step is longer
  Real list_range_m_ = std::numeric_limits<Real>::max();  ///< no list reaches farther
  double list_path_m_ = 0, list_turn_rad_ = 0;  ///< how far p_ had come where the list was begun
  std::uint32_t list_visits_of_tick_ = 0, list_visits_left_ = 0;
  std::uint32_t granted_lists_ = 0, granted_planes_ = 0;  ///< work of the screen, of this tick
  std::uint32_t list_ticks_ = 1;                          ///< that the last list took
  std::uint32_t checks_ = 0;                              ///< counts them, for ReachedPair::checked
  std::uint32_t list_age_ = 0;                            ///< ticks of the one that is begun
  std::uint32_t pass_units_ = 0;    ///< work of the last ticks but for lists, fading
  std::uint32_t pass_of_tick_ = 0;  ///< of this pass
  bool has_facets_ = false;
  BoundedList<std::uint32_t> hot_;  ///< slots of the pairs that are near, where there may be many
  double hot_until_m_ = 0;          ///< reading of the odometer at which another pair may be
  /// Motion of the last steps, fading: of the first pass of a tick, and of the later ones.
  std::array<Real, 2> pass_steps_m_{};
  Real tried_m_ = 0;                       ///< motion of the step that this pass tried last
  Real tick_motion_m_ = 0;                 ///< of the last ticks, fading
  double tick_start_m_ = 0;                ///< reading of the odometer where this tick began
  std::uint8_t grants_ = 0;                ///< Grant, of this tick
  bool waiting_ = false, waited_ = false;  ///< a pair waits for a search; one did in the last tick
  std::uint32_t behind_ticks_ = 0;
  /// The last pass was rejected: the next starts without its planes.
  bool choose_from_start_ = false;
  Real way_left_m_ = 0, turn_left_rad_ = 0;  ///< what p may move by in the rest of this tick
  Real came_m_ = 0, came_rad_ = 0;  ///< of it, what the goal has come since p_ was not behind
  std::uint64_t pass_ = 0;          ///< counts them, for ProxyPair::reached_in
  Real reach_m_ = 0;                ///< of this pass: pairs farther apart than this are not in it
  Real nearest_m_ = 0;              ///< no pair is nearer than this at p_
  Real close_m_ = 0;       ///< of a negative gap, what rows of this pass may ask to be closed
  bool may_close_ = true;  ///< in this tick: no pass that did was rejected
  Real worst_gap_m_ = 0;   ///< at p_, of the pairs in the list
  PoseError wish_;         ///< the step that the last program asked for
  /// With friction: what the goal has moved by in this tick and p_ not yet, and what p_ has moved
  /// by in the first pass of this tick, or of the last until it has ended.
  PoseError way_, came_;
  PoseError near_wish_;                ///< that of the last one without rows linearised at a step
  std::uint64_t chosen_planes_ = 0;    ///< a hash of those last chosen from the start
  std::uint32_t chosen_ago_ = 0;       ///< passes that have ended with them since
  GripPose goal_;                      ///< of the last tick
  std::uint32_t slow_ = 0;             ///< those that gained little, less the others
  std::uint32_t held_ = 0;             ///< ticks in a row with this goal, to the bit
  bool still_ = false;                 ///< with it, nothing moved
  bool choice_spent_ = false;          ///< nor did the budget suffice to choose the planes again
  bool settled_ = false;               ///< nor can with planes chosen from the start
  ProxyTick* settled_tick_ = nullptr;  ///< its account
  std::span<FeltContact> felt_;        ///< one
  BoundedList<QpRow> rows_;
  std::span<std::uint8_t> row_plane_;             ///< index of the imposed plane of each row
  BoundedList<FrictionCone> cones_, last_cones_;  ///< of this pass and of the one before
  std::uint32_t cone_programs_ = 0;               ///< of this pass, that cuts asked for
  std::uint32_t shift_programs_ = 0;              ///< and that shifts of cones did
  std::uint32_t bound_programs_ = 0;              ///< and that bounds of the way and turn did
  std::span<std::uint8_t> row_cone_;              ///< index of the cone of each row
  std::span<Real> lanes_;                         ///< A's vertices turned to p_
  std::span<std::size_t> lanes_begin_;
  std::span<std::uint64_t> lanes_version_;
  std::span<std::uint64_t> search_memory_;  ///< bounds of one full search
  ValidScratch valid_scratch_;
  ManifoldScratch manifold_scratch_;
  std::span<PlaneRegion> regions_;  ///< at p_, those asked for last
  std::uint32_t oldest_region_ = 0;
  NearScratch* near_scratch_ = nullptr;
  Spring secant_;  ///< whose energy the pass lowers
  QpResult last_qp_;
  bool longest_ = false;       ///< the step that this pass tried was as long as any among facets
  bool moved_little_ = false;  ///< the last pass of a tick whose goal moves
  bool list_cut_ = false;      ///< in this tick: a step went no farther than the list of near pairs
  bool whole_ = false;         ///< the step of this pass is all that its program asks for
  bool wedged_ = false;        ///< contact points with friction lie in planes that are not parallel
  bool has_wish_ = false;      ///< wish_ is that of a program of this pass
  bool keeps_active_ = false;  ///< this pass leaves the planes that hold p as they are
  std::uint32_t short_ways_ = 0;   ///< passes that have gone out of several pairs at once
  Vec3 way_out_w_ = Vec3::Zero();  ///< unit, out of all that p_ is inside of; zero: none chosen
  /// The last climb that led nowhere: of which pairs, from where, and the energy then and what it
  /// lacked.
  std::array<std::uint32_t, kMaxFeltPlanes> climbed_{};
  std::uint32_t climbed_count_ = 0;
  Vec3 climbed_x0_w_ = Vec3::Zero();
  Real climbed_v_j_ = 0, climbed_lacks_j_ = 0;
  double no_low_until_m_ = 0;  ///< reading of the odometer before which no face here can be low
  std::uint32_t climbing_ =
      0;                   ///< this pass is the second leg of a climb, the so-manieth of a tick
  bool short_ = false;     ///< the steps of this try are a few times the tolerance
  bool far_rows_ = false;  ///< rows linearised away from p_ are in the program
};

}  // namespace haptic
