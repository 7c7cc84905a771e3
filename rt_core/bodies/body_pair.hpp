// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two bodies that may touch, as a law of several bodies asks for them: the contact side of the
/// proxy, at the pose of A seen from B.
///
/// All that a pair of bodies knows of gaps, planes and friction depends on their relative pose
/// alone. So A moves in B's axes as the part of one proxy does in W, and every step is certified on
/// the way that is straight there: no two bodies pass through each other, however they turn
/// together. Against all that stands, B's axes are those of W.

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/bodies/block_program.hpp"
#include "rt_core/proxy/proxy_law.hpp"

namespace haptic {

/// In place of the number of a body: all that stands.
inline constexpr std::uint32_t kStanding = UINT32_MAX;

/// A body's motion: of its grip point, and its turn. W axes.
using BodyMotion = PoseError;

inline constexpr Real kUnbounded = std::numeric_limits<Real>::max();
[[nodiscard]] inline Real norm_of(const Vec3& v) noexcept { return std::sqrt(v.squaredNorm()); }

[[nodiscard]] inline Real root_of_squares(Real x, Real y) noexcept {
  return std::sqrt(x * x + y * y);
}

/// The motion that leads from where `carry` does to where `whole` does.
[[nodiscard]] BodyMotion beyond(const BodyMotion& whole, const BodyMotion& carry) noexcept;
/// First by `carry`, then by `more`.
[[nodiscard]] BodyMotion joined(const BodyMotion& carry, const BodyMotion& more) noexcept;

/// Pose of A's grip point in the mesh frame of B, which has its grip point at `grip_b_m`. The
/// orientation is normalised.
[[nodiscard]] GripPose seen_from(const GripPose& b, const Vec3& grip_b_m,
                                 const GripPose& a) noexcept;

/// The tick that begins.
struct BodyTickState {
  std::uint32_t held = 0;          ///< ticks in a row in which no goal has moved
  std::uint32_t behind_ticks = 0;  ///< in a row that have ended for want of budget
};

/// Not copyable once placed: it is a view of its arena.
class BodyPair {
 public:
  struct Parameters {
    std::uint32_t a = 0, b = kStanding;  ///< numbers of the bodies; `a` moves
    Vec3 grip_b_m = Vec3::Zero();        ///< of b, in its mesh frame
    ProxyScale scale;                    ///< the same for all pairs of a law
    Real epsilon_m = 0;
    std::uint32_t passes = kDefaultProxyPasses, work_units = kMostWorkUnits;
  };
  /// How a step was judged.
  struct Check {
    bool ok = true;
    Real lacking_m = 0;  ///< how far below the least allowed gap the worst pair of pieces is
    Real share = 1;      ///< the way is certified where the step is cut to this share, or less
    bool spent = false;  ///< the budget has ended before all were known
  };

  /// `scene`: in which A moves and B, alone, stands at its mesh frame; or all that stands does.
  void place(Arena& arena, const SceneView& scene) noexcept { proxy_.place(arena, scene); }
  /// Not for the servo loop.
  void read_scene(const SceneView& scene) noexcept;
  void configure(const Parameters& parameters) noexcept;

  [[nodiscard]] std::uint32_t a() const noexcept { return parameters_.a; }
  [[nodiscard]] std::uint32_t b() const noexcept { return parameters_.b; }
  [[nodiscard]] bool has_b() const noexcept { return parameters_.b != kStanding; }
  [[nodiscard]] Real radius_m() const noexcept { return radius_m_; }
  [[nodiscard]] const Vec3& grip_b_m() const noexcept { return parameters_.grip_b_m; }
  /// It is of these bodies from now on. `grip_b_m`: of b, in its mesh frame, where there is one.
  void set_bodies(std::uint32_t a, std::uint32_t b, const Vec3& grip_b_m) noexcept {
    parameters_.a = a;
    parameters_.b = b;
    parameters_.grip_b_m = grip_b_m;
  }

  /// Forgets all contacts; the bodies are at these poses. `b` counts where there is one.
  void reset(const GripPose& a, const GripPose& b) noexcept;

  /// The goals have come by these ways since the last tick. `scratch` is lent until end_tick().
  void begin_tick(const BodyMotion& goal_way_a, const BodyMotion& goal_way_b,
                  const BodyTickState& state, NearScratch& scratch, ProxyTick& tick) noexcept;
  void end_tick(ProxyTick& tick) noexcept;
  /// A tick in which nothing is computed: what has long been still comes to stick.
  void rest_tick() noexcept { proxy_.settle_slip(); }

  /// Gathers what the bodies can meet in a pass, the `number`-th of its tick, if they move against
  /// each other by `pull_m`, and takes the rows of the planes that held them last into the program.
  void begin_pass(std::uint32_t number, Real pull_m, ProxyTick& tick) noexcept;
  void impose_last(Real close_m, bool choose_from_start, ProxyTick& tick) noexcept;
  /// The pieces of both are in each other.
  [[nodiscard]] bool is_inside() const noexcept { return proxy_.pass_.inside; }
  [[nodiscard]] bool is_recovering() const noexcept { return proxy_.pass_.recovering; }
  /// No two pieces are nearer than this.
  [[nodiscard]] Real nearest_m() const noexcept { return proxy_.pass_.nearest_m; }
  [[nodiscard]] Real worst_gap_m() const noexcept { return proxy_.pass_.worst_gap_m; }
  [[nodiscard]] bool has_facets() const noexcept { return proxy_.has_facets(); }
  [[nodiscard]] bool has_friction() const noexcept { return proxy_.has_friction(); }

  /// How far motions of both move A in B's axes, to first order in what they differ by from the
  /// pass's common motion; against what stands, A's motion.
  [[nodiscard]] BodyMotion relative(const BodyMotion& a, const BodyMotion& b) const noexcept;
  /// In this pass the bodies mostly move by these parts of one rigid motion, from these poses; the
  /// rows are made for the errors.
  struct Carried {
    GripPose p;        ///< where the body is carried to
    BodyMotion carry;  ///< by this
    BodyMotion error;  ///< of its goal, from where it is now
  };
  void set_carried(const Carried& a, const Carried& b) noexcept;

  [[nodiscard]] std::uint32_t row_count() const noexcept { return proxy_.program_.rows.size(); }
  /// From now on the rows are for these parts of the errors: what may be gone in one step.
  void set_pull(const BodyMotion& a, const BodyMotion& b) noexcept;
  /// Row k on the blocks of both bodies, in units of motion: to be scaled by the weights.
  [[nodiscard]] BlockRow row(std::uint32_t k) const noexcept;
  /// Takes over the solution of the program.
  void begin_found() noexcept { proxy_.program_.found = QpResult{}; }
  void add_active(std::uint32_t row, Real multiplier) noexcept;
  void end_found(const BodyMotion& a, const BodyMotion& b) noexcept;
  [[nodiscard]] std::span<const std::uint8_t> active_rows() const noexcept {
    return {proxy_.program_.found.active.data(), proxy_.program_.found.active_count};
  }

  /// Cones of friction, of the solution that was taken over last.
  [[nodiscard]] bool has_cones() const noexcept { return !proxy_.program_.cones.empty(); }
  /// Adds the half spaces that it violates; true: there are some.
  [[nodiscard]] bool cut_cones(Real tolerance_m) noexcept;
  [[nodiscard]] bool shifts_fit(bool may_lift) const noexcept;
  /// Shifts the cones by the slip of the solution, or back.
  void shift_cones(bool back) noexcept;
  [[nodiscard]] bool rests_on_friction() const noexcept { return proxy_.rests_on_friction(); }
  [[nodiscard]] bool sticks() const noexcept { return proxy_.sticks(); }

  /// The step to these ends, by these motions, is the one that the next calls are about.
  void set_step(const GripPose& a, const GripPose& b, const BodyMotion& motion_a,
                const BodyMotion& motion_b) noexcept;
  [[nodiscard]] bool stays() const noexcept { return stays_; }
  [[nodiscard]] Check check(Real least_m, bool knows_last, ProxyTick& tick) noexcept;
  /// Adds the plane that comes closest to certifying what the last check found to lack most; false:
  /// no room. `share` < 1: no plane is in the way there, and that share of the step is to be tried,
  /// at least `least_share`.
  /// The step is the share `taken` of what the program asks for.
  [[nodiscard]] bool impose_lacking(Real least_m, Real taken, Real least_share, Real& share,
                                    ProxyTick& tick) noexcept;
  /// Rows of the planes imposed, at p alone; `from_start`: without any plane.
  void begin_retry(bool from_start, bool is_short, ProxyTick& tick) noexcept;
  /// Visits rows that move A out of what the step violates, without a turn: `visit(normal_w, gap)`;
  /// false: one did not fit.
  template <typename Visit>
  [[nodiscard]] bool for_each_lacking(ProxyTick& tick, const Visit& visit) noexcept;

  /// Rows linearised away from p are in the program.
  [[nodiscard]] bool has_far_rows() const noexcept { return proxy_.program_.far_rows; }
  [[nodiscard]] bool is_crowded() const noexcept { return proxy_.crowded(); }
  [[nodiscard]] bool choice_is_due() noexcept { return proxy_.choice_is_due(); }
  void remember_active() noexcept { proxy_.remember_active(); }
  /// The pass has ended for want of budget: the next one goes on with what it has found.
  void keep_found() noexcept { proxy_.keep_found(); }
  /// The longest relative motion that is trusted, where this share of `relative` is asked for [m].
  [[nodiscard]] Real trusted_m(Real share, const BodyMotion& relative, ProxyTick& tick) noexcept;
  /// `tried_m`: relative motion of the step that was tried last.
  void end_pass(bool moved, bool rejected, Real tried_m) noexcept;

  /// Moves to the end of the step, which the last check has certified.
  void accept() noexcept;
  /// Moves there without a certificate: a way out.
  void carry() noexcept;
  /// The next way out of what A is inside of, in W axes [m].
  [[nodiscard]] Vec3 way_out_w(ProxyTick& tick) noexcept;

  /// Smallest gap known at the end of a tick, a lower bound of the distance [m].
  [[nodiscard]] Real gap_m() const noexcept { return gap_m_; }
  /// Planes that hold the bodies; normals in B's axes.
  [[nodiscard]] const FeltContact& felt() const noexcept { return proxy_.felt(); }
  /// The contact side: of A in B's axes.
  [[nodiscard]] Proxy& proxy() noexcept { return proxy_; }
  /// Adds `share` times the forces of the rows that hold, before the step is taken: about the grip
  /// point of each body, in W axes, over the reference stiffness [m].
  void add_forces(Real share, BodyMotion& on_a, BodyMotion& on_b) const noexcept;

 private:
  void arrive() noexcept;
  void straighten(std::uint32_t rows, std::uint32_t cones, Real taken) noexcept;
  [[nodiscard]] PlaneGap gap_at_step(const ReachedPair& reached, ProxyTick& tick) const noexcept;

  Proxy proxy_;
  Parameters parameters_;
  Real radius_m_ = 0;
  BodyMotion carry_a_, carry_b_;
  Mat3 r_wb_ = Mat3::Identity();       ///< of B, carried
  Vec3 between_w_ = Vec3::Zero();      ///< from B's grip point to A's, carried
  Mat3 step_r_wb_ = Mat3::Identity();  ///< the same at the end of the step
  Vec3 step_between_w_ = Vec3::Zero();
  PoseError error_;             ///< relative, as rows see it
  PoseError spared_;            ///< the part of it that the program leaves
  GripPose step_q_, before_q_;  ///< ends of the step and of the one that was checked before
  BodyMotion step_, before_;    ///< relative: the straight ways there
  BodyMotion linear_;           ///< of the step, as rows see it
  bool stays_ = true;           ///< neither body moves in the step
  bool knows_before_ = false;
  std::uint32_t worst_ = 0;  ///< number of what the last check found to lack most
  Real gap_m_ = 0;
};

template <typename Visit>
bool BodyPair::for_each_lacking(ProxyTick& tick, const Visit& visit) noexcept {
  for (const ReachedPair& reached : proxy_.pass_.reached) {
    if (!reached.exact_q || reached.open || reached.gap_q_m > parameters_.scale.step_m) continue;
    const PlaneGap gap = gap_at_step(reached, tick);
    if (gap.defined && !visit(has_b() ? Vec3(step_r_wb_ * gap.normal_w) : gap.normal_w, gap.gap_m))
      return false;
  }
  return true;
}

}  // namespace haptic
