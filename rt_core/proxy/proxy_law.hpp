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
#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/proxy/proxy_parts.hpp"
#include "rt_core/proxy/proxy_state.hpp"

namespace haptic {

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

  [[nodiscard]] const GripPose& pose() const noexcept { return part_.pose; }
  [[nodiscard]] bool started() const noexcept { return started_; }
  /// Of the pull's translation, what the planes of the last program hold.
  [[nodiscard]] Real held_m() const noexcept;
  /// Planes that hold the proxy: those with a multiplier in the last pass.
  [[nodiscard]] std::span<const ImposedPlane> active() const noexcept {
    return kept_.active.view();
  }
  /// Those of them that the proxy touches, at the end of the last tick.
  [[nodiscard]] const FeltContact& felt() const noexcept { return felt_[0]; }
  /// Appends the near set of pair `index` at the proxy to `near`, by a search without history that
  /// leaves the proxy as it is; for reports between ticks. `pose`: the pair's.
  [[nodiscard]] NearResult near_set_of(PairIndex index, NearScratch& scratch,
                                       BoundedList<NearNode>& near, PairPose& pose) noexcept;

 private:
  friend class BodyPair;  ///< asks for the contact side alone

  struct Step;
  struct Check;
  class StepCheck;
  class StepSearch;
  class PassTry;
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

  void begin_lists() noexcept;
  [[nodiscard]] bool begin_rest(const GripPose& goal) noexcept;
  [[nodiscard]] ProxyTick begin_tick(const GripPose& goal) noexcept;
  [[nodiscard]] PassEnd make_passes(const GripPose& goal, ProxyTick& tick) noexcept;
  void tell_gap(PassEnd end, ProxyTick& tick) noexcept;
  void end_rest(PassEnd end, bool chosen, const ProxyTick& tick) noexcept;
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
    if (near_.hot.capacity() == 0) return std::numeric_limits<Real>::max();
    return static_cast<Real>(near_.hot_until_m - odometer_m());
  }
  /// What a motion may be, as list_motion_m() has it, that meets no pair which is not in the list.
  [[nodiscard]] Real unlisted_m() const noexcept {
    if (has_screen()) return near_.screen->clear_m() - skin_m();
    return near_.list.unlisted_m(list_odometer_m(near_.list.least_share())) -
           skin_m() / near_.list.least_share();
  }
  /// A motion by the odometer of the list.
  [[nodiscard]] Real list_motion_m(Real far_m, Real turn_rad) const noexcept {
    return far_m / near_.list.least_share() + turn_rad * parameters_.radius_m;
  }
  /// True if the scene has more pairs than slots, of pieces whose faces are asked then.
  [[nodiscard]] bool has_left_out() const noexcept { return near_.list.may_leave_out(); }
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
    return kSceneTraits.many_pairs && !near_.view_of.empty();
  }
  /// The slots of the pairs within reach that have no seat.
  [[nodiscard]] std::span<std::uint32_t> beside() noexcept {
    return takes_turns() ? std::span{pass_.beside.begin(), pass_.beside.size()}
                         : std::span<std::uint32_t>{};
  }
  void need_view(ProxyPair& pair, ProxyTick& tick) noexcept {
    if (pair.view == nullptr) form_view(pair, tick);
  }
  void form_view(ProxyPair& pair, ProxyTick& tick) noexcept;
  void keep_view(std::uint32_t slot, bool keep) noexcept;
  void forget(std::uint32_t slot) noexcept;

  /// Facets screened in bulk (proxy_screen.cpp).
  [[nodiscard]] bool has_screen() const noexcept {
    return kSceneTraits.facets && near_.screen != nullptr;
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
    return tick.work.units() < parameters_.work_units;
  }
  [[nodiscard]] bool may_begin(Grant grant, ProxyTick& tick) noexcept;
  [[nodiscard]] bool may_search(ProxyPair& pair, ProxyTick& tick) noexcept;
  void keep_plane(const ReachedPair& reached) noexcept;
  void keep_found() noexcept;
  void adapt_trust(PassEnd end) noexcept;
  [[nodiscard]] Real most_trust_m() const noexcept;
  /// Some piece is a facet.
  [[nodiscard]] bool has_facets() const noexcept { return kSceneTraits.facets && near_.has_facets; }
  /// True if there are facets, and so many pairs that a list of those near takes long.
  [[nodiscard]] bool has_long_lists() const noexcept {
    return has_facets() && range_.visits_of_tick >= kListVisitsOfTick;
  }
  [[nodiscard]] std::size_t step_place() const noexcept {
    return std::min<std::size_t>(move_.pass_of_tick, near_.pass_steps_m.size() - 1);
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
  [[nodiscard]] Vec3 next_way_out(ProxyTick& tick) noexcept;
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
  [[nodiscard]] ClimbStart climb_start(const ProxyTick& tick) const noexcept;
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
  void begin_program() noexcept;
  void begin_cones() noexcept;
  [[nodiscard]] bool add_cone(std::uint32_t imposed, const RowArm& arm, const Vec3& normal_w,
                              Real least_m, const PoseError& error) noexcept;
  [[nodiscard]] bool push_cone_row(std::uint32_t at, const Vec3& direction_w,
                                   const PoseError& error) noexcept;
  enum class Cut : std::uint8_t { kNone, kSome, kNoRoom };
  [[nodiscard]] Cut cut_once(const PoseError& error, Real tolerance_m) noexcept;
  void cut_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept;
  [[nodiscard]] Vec3 slip_of(const FrictionCone& cone, const PoseError& motion) const noexcept;
  [[nodiscard]] Real rise_of(const FrictionCone& cone, const PoseError& motion) const noexcept;
  void note_slip(const Step& step) noexcept;
  void settle_slip() noexcept;
  [[nodiscard]] bool sticks() const noexcept;
  [[nodiscard]] bool rests_on_friction() const noexcept;
  [[nodiscard]] bool rests(const PoseError& error, const ProxyTick& tick) const noexcept;
  /// Of a tick, and no leg of a climb.
  [[nodiscard]] bool is_first_pass() const noexcept {
    return move_.pass_of_tick == 0 && climb_.leg == 0;
  }
  /// True if something of the scene rubs.
  [[nodiscard]] bool has_friction() const noexcept {
    return kSceneTraits.friction && program_.cones.capacity() > 0;
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
  [[nodiscard]] Real try_plane(ReachedPair& reached, const ValidPlane& plane, bool first,
                               const Step& step, Real least_m, Real worth,
                               ProxyTick& tick) const noexcept;
  [[nodiscard]] bool certify_by_face(ReachedPair& reached, const Step& step, Real least_m,
                                     Real& worth, ProxyTick& tick) const noexcept;
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
    return part_.path_m + part_.turn_rad * static_cast<double>(pair.reach_a_m);
  }
  /// That of the whole part.
  [[nodiscard]] double odometer_m() const noexcept { return list_odometer_m(1); }
  /// And of a list of near pairs with this least share.
  [[nodiscard]] double list_odometer_m(Real least_share) const noexcept {
    return (part_.path_m / static_cast<double>(least_share) +
            part_.turn_rad * static_cast<double>(parameters_.radius_m)) *
           (1 + kOdometerRounding);
  }

  Parameters parameters_;
  bool started_ = false;
  PlacedPart part_;
  RestWatch rest_;
  NearSlots near_;
  TrustedRange range_;
  FoundPlanes found_;
  KeptPlanes kept_;
  SlipWatch slip_;
  ClimbWatch climb_;
  WayOut out_;
  std::span<FeltContact> felt_;  ///< one, of the last tick
  TickMove move_;
  PassState pass_;
  PassProgram program_;
  ProxyScratch scratch_;
};

}  // namespace haptic
