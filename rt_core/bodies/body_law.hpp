// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The law of several bodies that move at once: one god-object in SE(3)^n.
///
/// Every body has a free configuration and a spring to its goal. A pass moves all of them together
/// to the least sum of the springs' energies under the planes that the pairs of bodies impose: one
/// quadratic program over all blocks, in which a contact pushes both bodies alike. A step is
/// accepted only when every pair of bodies certifies it. After every pass all bodies are free, and
/// the sum of the energies has not risen. A body that is to push others and never to yield has a
/// spring many times as stiff.
///
/// A law may have more bodies than move in a tick. The first ones move; the others rest where they
/// are, as hard as what stands. Between ticks one that moves and one that rests may change places.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/bodies/block_program.hpp"
#include "rt_core/bodies/body_pair.hpp"
#include "rt_core/bodies/open_pairs.hpp"

namespace haptic {

/// Bodies that move at once, at most, and pairs of them with each other and with what stands.
inline constexpr std::uint32_t kMostMovingBodies = kMostBlocks;
inline constexpr std::uint32_t kMostBodyPairs = kMostMovingBodies * (kMostMovingBodies + 1) / 2;
/// Bodies of a law, those that rest among them.
inline constexpr std::uint32_t kMostBodies = 64;

/// Two bodies that may touch: a scene in which `a` moves and `b`, alone, stands at its mesh frame;
/// with `b` kStanding all that stands does, in W. Of solids or surfaces, for law proxy. Bounds of
/// ways grow with the radius of `a`: it should be the smaller one of two.
struct BodyPairScene {
  std::uint32_t a = 0, b = kStanding;
  const SceneView* scene = nullptr;
  bool is_open = true;  ///< false: a slot for any two bodies that have this scene (open_pair)
};

/// A body that moves.
struct MovingBody {
  Spring spring;               ///< to its goal
  Vec3 grip_m = Vec3::Zero();  ///< its grip point, in its mesh frame
  Real radius_m = 0;           ///< every vertex lies within it of the grip point
  /// It lets go of a pull over several ticks. False: it moves as far as its goal asks.
  bool is_held_back = true;
};

/// One tick of all bodies.
struct BodiesTick {
  /// Sums over the bodies. The end is no higher than the start but for rounding, as in ProxyTick.
  Real start_potential_j = 0, end_potential_j = 0;
  Real gap_m = 0;  ///< smallest known gap of any pair, a lower bound
  /// Pull that the planes of the last program leave and bodies that are held back have not
  /// followed, of the body that it is largest for.
  Real residual_n = 0;
  bool moved = false;       ///< a body is not where it was
  bool limited = false;     ///< a cap was met, or a residual is left
  bool spent = false;       ///< the tick has ended for want of budget
  bool recovering = false;  ///< bodies were in each other
  ProxyWork work;
};

class BodyLaw {
 public:
  struct Parameters {
    ProxyScale scale;  ///< of the smallest body that is to be felt, and the largest coordinate
    std::uint32_t passes = kDefaultProxyPasses;
    /// Units of work of a tick (METHOD section 13). Two bodies in contact need some hundreds, and
    /// several times that with friction: with fewer a tick ends with what it has.
    std::uint32_t work_units = kMostWorkUnits;
    Real epsilon_m = 0;
  };

  /// Places everything: `bodies` bodies, of which `moving` move. At most kMostOpenPairs pairs may
  /// be open at once.
  void place(Arena& arena, std::span<const BodyPairScene> pairs, std::uint32_t moving,
             std::uint32_t bodies) noexcept;
  /// Counts in `arena`, one that only counts, what place() takes.
  static void count_bytes(Arena& arena, std::span<const BodyPairScene> pairs, std::uint32_t moving,
                          std::uint32_t bodies) noexcept;
  /// Rounds of one pass, at most.
  [[nodiscard]] static std::uint32_t most_rounds(std::uint32_t bodies) noexcept;
  /// Reads the pieces of the same pairs. Their blobs must outlive the law. Not for the servo loop.
  void read_scenes(std::span<const BodyPairScene> pairs) noexcept;
  void configure(const Parameters& parameters, std::span<const BodyPairScene> pairs,
                 std::span<const MovingBody> bodies) noexcept;

  /// Forgets all contacts; the bodies are at `poses`, which must be free, with their goals there.
  void begin(std::span<const GripPose> poses) noexcept;
  /// The same, in the order that they had at first.
  void begin(std::span<const MovingBody> bodies, std::span<const GripPose> poses) noexcept;

  /// From the next tick on body `resting`, which must be one that rests, moves in place of body
  /// `moving`, which rests where it is: they change numbers, and their pairs follow them. Pairs of
  /// bodies that all rest must have been closed. Cost: O(open pairs).
  void exchange(std::uint32_t moving, std::uint32_t resting) noexcept;
  /// From the next tick on slot `pair` is asked, for these two bodies, of which one moves; `b` may
  /// be kStanding. False: too many are open. Cost: O(open pairs) and a reset.
  [[nodiscard]] bool open_pair(std::uint32_t pair, std::uint32_t a, std::uint32_t b) noexcept;
  void close_pair(std::uint32_t pair) noexcept;
  /// From the next tick on the body goes no farther in one than `most_m`, and turns no farther than
  /// that takes its radius.
  void limit_way(std::uint32_t body, Real most_m) noexcept { bodies_[body].most_m = most_m; }

  /// Moves the bodies towards their goals, one for each that moves. Cost: bounded by the caps of
  /// the proxy times the pairs of bodies; no heap.
  [[nodiscard]] BodiesTick tick(std::span<const GripPose> goals) noexcept;

  /// Those that move.
  [[nodiscard]] std::uint32_t body_count() const noexcept { return count_; }
  [[nodiscard]] const GripPose& pose(std::uint32_t body) const noexcept { return bodies_[body].p; }
  /// The one of the last tick.
  [[nodiscard]] const GripPose& goal(std::uint32_t body) const noexcept {
    return bodies_[body].goal;
  }
  [[nodiscard]] Real radius_m(std::uint32_t body) const noexcept {
    return bodies_[body].is.radius_m;
  }
  /// Energy of its spring at the end of the last tick [J]. Others may have raised it.
  [[nodiscard]] Real potential_j(std::uint32_t body) const noexcept {
    return bodies_[body].potential_j;
  }
  /// Part of the change of that energy in the last tick, after the goals had come to where they
  /// are: what the other bodies have given its spring, less what it has given them. Sums up to 0
  /// over the bodies; the rest of a fall is lost [J].
  [[nodiscard]] Real given_j(std::uint32_t body) const noexcept;
  [[nodiscard]] std::uint32_t behind_ticks() const noexcept { return behind_ticks_; }
  /// Sum of the contact forces on it, of the last program that had the budget to end: about its
  /// grip point, W axes.
  [[nodiscard]] Wrench contact_w(std::uint32_t body) const noexcept;
  /// Wrench of its spring on its owner: -K g.
  [[nodiscard]] Wrench spring_w(std::uint32_t body) const noexcept;
  /// Those that are open.
  [[nodiscard]] const OpenPairs& pairs() const noexcept { return pairs_; }
  [[nodiscard]] OpenPairs& pairs() noexcept { return pairs_; }
  /// A slot, open or not.
  [[nodiscard]] const BodyPair& slot(std::uint32_t pair) const noexcept { return slots_[pair]; }
  /// Poses of the bodies that move after each pass of the last tick that moved them: for judges.
  [[nodiscard]] std::uint32_t steps_of_tick() const noexcept { return steps_; }
  [[nodiscard]] std::span<const GripPose> after_step(std::uint32_t step) const noexcept {
    return way_.subspan(std::size_t{step} * count_, count_);
  }

 private:
  class PassTry;
  class StepSearch;

  /// A body between ticks, in a tick, and in a pass.
  struct Body {
    MovingBody is;
    GripPose p, goal;
    Real potential_j = 0, start_j = 0;  ///< at the end and the start of the tick, one goal

    Real came_m = 0, came_rad = 0;  ///< what its goal has come since the law was not behind
    Real most_m = kUnbounded;       ///< limit_way()
    Real way_left_m = 0, turn_left_rad = 0;  ///< what it may move by in the rest of the tick

    BodyMotion goal_way;      ///< of its goal in this tick
    BodyMotion error;         ///< of the goal against p
    BodyMotion carry;         ///< its part of the motion that all bodies mostly make in the pass
    BodyMotion pull;          ///< the part of the error that the program is for
    Real pull_share = 1;      ///< which that is
    Spring secant;            ///< whose energy the pass lowers
    Real weight = 1;          ///< root of its stiffness over that of the first body
    BodyMotion wish;          ///< the step that the last program asks for
    Real share = 1;           ///< of the wish, where its way is not certified
    bool is_touched = false;  ///< a row with a multiplier acts on it
    BodyMotion force_m;       ///< of its contacts, over the stiffness of the first body
  };
  /// Where the bodies that move go in a pass, and the ends of that.
  struct Step {
    std::array<BodyMotion, kMostMovingBodies> motion;
    std::array<GripPose, kMostMovingBodies> q;
  };
  /// How a step was judged by all pairs.
  struct Check {
    bool ok = true;
    Real lacking_m = 0;
    std::uint32_t worst = 0;  ///< the pair that lacks most
    bool spent = false;
  };
  enum class PassEnd : std::uint8_t { kMoved, kDone, kRejected, kSpent };

  [[nodiscard]] static std::span<BodyPair> place_pairs(Arena& arena,
                                                       std::span<const BodyPairScene> pairs,
                                                       NearScratch& scratch) noexcept;
  [[nodiscard]] static std::span<GripPose> place_rest(Arena& arena, std::uint32_t moving,
                                                      BlockProgram& program) noexcept;
  /// Those that move.
  [[nodiscard]] std::span<Body> bodies() noexcept { return bodies_.first(count_); }
  [[nodiscard]] std::span<const Body> bodies() const noexcept { return bodies_.first(count_); }
  [[nodiscard]] bool moves(std::uint32_t body) const noexcept { return body < count_; }
  /// The one of the pair's bodies that moves; A where both do.
  [[nodiscard]] std::uint32_t mover_of(const BodyPair& pair) const noexcept {
    return moves(pair.a()) ? pair.a() : pair.b();
  }
  /// The same as a block of the program, and B's; kNoBlock: what rests or stands.
  [[nodiscard]] BlockRow on_blocks(const BodyPair& pair, BlockRow row) const noexcept;
  void set_step(BodyPair& pair, const Step& step) const noexcept;
  [[nodiscard]] const Body& of_b(const BodyPair& pair) const noexcept {
    return bodies_[pair.has_b() ? pair.b() : pair.a()];
  }
  [[nodiscard]] bool begin_rest(std::span<const GripPose> goals) noexcept;
  void bound_moves(std::span<const GripPose> goals) noexcept;
  [[nodiscard]] bool may_move() const noexcept;
  [[nodiscard]] bool sticks() const noexcept;
  [[nodiscard]] bool has_friction() const noexcept;
  [[nodiscard]] bool has_budget(const ProxyTick& tick) const noexcept {
    return tick.work.units() < parameters_.work_units;
  }
  [[nodiscard]] Real left_over_n(const Step* step) const noexcept;
  [[nodiscard]] Real sum_j() const noexcept;
  [[nodiscard]] Real sum_j(const Step& step) const noexcept;
  [[nodiscard]] PassEnd make_passes(BodiesTick& told, ProxyTick& tick) noexcept;
  [[nodiscard]] PassEnd pass(std::uint32_t number, BodiesTick& told, ProxyTick& tick) noexcept;
  void begin_pass(std::uint32_t number, ProxyTick& tick) noexcept;
  void carry_all(std::uint32_t number) noexcept;
  void lead_out(ProxyTick& tick) noexcept;
  [[nodiscard]] Step step_by(
      const std::array<BodyMotion, kMostMovingBodies>& motion) const noexcept;
  [[nodiscard]] bool is_still(const Step& step) const noexcept;
  [[nodiscard]] bool gains_nothing(const Step& step) const noexcept;
  [[nodiscard]] Check check(const Step& step, Real least_m, bool knows_last,
                            ProxyTick& tick) noexcept;
  /// Bodies of a pair whose way is not certified go this share of it.
  void shorten(const BodyPair& pair, Real share) noexcept;
  [[nodiscard]] bool correct(Step& step, ProxyTick& tick) noexcept;
  void accept(const Step& step, bool is_certified) noexcept;
  void remember_active() noexcept;

  Parameters parameters_;
  std::uint32_t count_ = 0;  ///< bodies that move: the first ones
  std::span<Body> bodies_;
  std::span<BodyPair> slots_;
  OpenPairs pairs_;
  BlockProgram program_;
  NearScratch scratch_;
  std::span<GripPose> way_;
  std::uint32_t steps_ = 0;
  std::array<Real, kMostOpenPairs> tried_m_{};  ///< relative motion of the step tried last, by pair

  // Between ticks: is there nothing more to do?
  std::uint32_t held_ = 0;          ///< ticks in a row with these goals
  std::uint32_t slow_ = 0;          ///< of them those that gained little, less the others
  std::uint32_t behind_ticks_ = 0;  ///< in a row that have ended for want of budget
  bool still_ = false;              ///< nothing moved in the last tick
  bool settled_ = false;            ///< nor can, with planes chosen from the start
  bool choose_from_start_ = false;  ///< the next pass starts without the planes of the last one
  bool may_close_ = true;           ///< no pass of this tick that closed a gap was rejected
  bool moved_little_ = false;       ///< the last step was short
  bool is_short_ = false;           ///< the steps of this try are a few times the tolerance
  std::uint32_t round_grants_ = 0;  ///< rounds begun in this tick
  Real close_m_ = 0;                ///< of a negative gap, what rows may ask to be closed
  BodiesTick last_;                 ///< of the last tick
};

}  // namespace haptic
