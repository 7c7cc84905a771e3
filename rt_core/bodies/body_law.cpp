// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/body_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/scene/formed_pairs.hpp"

namespace haptic {
namespace {

/// In place of kOnItsWay: what one body gains may be little of the energy of all.
constexpr Real kSomeOnTheirWay = 0.002_r;

/// Passes of a tick that may go no farther than a few times the tolerance.
constexpr std::uint32_t kMostShortSteps = 2;

bool is_same(const GripPose& one, const GripPose& other) noexcept {
  return one.x0_w == other.x0_w && one.q_wa.coeffs() == other.q_wa.coeffs();
}

/// A turn is at most this.
Real turn_between_rad(const Quat& one, const Quat& other) noexcept {
  const Real chord2 = std::min((one.coeffs() - other.coeffs()).squaredNorm(),
                               (one.coeffs() + other.coeffs()).squaredNorm());
  return kTurnOfChord * std::sqrt(chord2);
}

}  // namespace

std::span<BodyPair> BodyLaw::place_pairs(Arena& arena, std::span<const BodyPairScene> pairs,
                                         NearScratch& scratch) noexcept {
  const std::span<BodyPair> placed = arena.take<BodyPair>(pairs.size());
  NearScratch::Size size;
  BodyPair counted;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const SceneView& scene = *pairs[k].scene;
    const std::uint32_t moving = scene.bodies()[0].piece_count;
    size.fit(largest_counts(scene.pieces().first(moving)),
             largest_counts(scene.pieces().subspan(moving)));
    (placed.empty() ? counted : placed[k]).place(arena, scene);
  }
  scratch.place(arena, size);
  return placed;
}

std::span<GripPose> BodyLaw::place_rest(Arena& arena, std::uint32_t moving,
                                        BlockProgram& program) noexcept {
  program.place(arena, moving, kMostBlockRows);
  return arena.take<GripPose>(std::size_t{kMaxProxyPasses} * moving);
}

void BodyLaw::place(Arena& arena, std::span<const BodyPairScene> pairs, std::uint32_t moving,
                    std::uint32_t bodies) noexcept {
  count_ = std::min(moving, kMostMovingBodies);
  bodies_ = arena.take<Body>(std::clamp(bodies, count_, kMostBodies));
  slots_ = place_pairs(arena, pairs, scratch_);
  way_ = place_rest(arena, count_, program_);
}

// It takes most of the stack that a function may: a frame of its own.
[[gnu::noinline]] void BodyLaw::count_bytes(Arena& arena, std::span<const BodyPairScene> pairs,
                                            std::uint32_t moving, std::uint32_t bodies) noexcept {
  NearScratch scratch;
  BlockProgram program;
  moving = std::min(moving, kMostMovingBodies);
  static_cast<void>(arena.take<Body>(std::clamp(bodies, moving, kMostBodies)));
  static_cast<void>(place_pairs(arena, pairs, scratch));
  static_cast<void>(place_rest(arena, moving, program));
}

void BodyLaw::read_scenes(std::span<const BodyPairScene> pairs) noexcept {
  for (std::size_t k = 0; k < slots_.size(); ++k) slots_[k].read_scene(*pairs[k].scene);
}

void BodyLaw::configure(const Parameters& parameters, std::span<const BodyPairScene> pairs,
                        std::span<const MovingBody> bodies) noexcept {
  parameters_ = parameters;
  parameters_.passes = std::min(parameters.passes, kMaxProxyPasses);
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].is = bodies[i];
  pairs_.clear();
  for (std::size_t k = 0; k < slots_.size(); ++k) {
    BodyPair::Parameters p;
    p.a = pairs[k].a;
    p.b = pairs[k].b;
    if (p.b != kStanding) p.grip_b_m = bodies[p.b].grip_m;
    p.scale = parameters.scale;
    p.epsilon_m = parameters.epsilon_m;
    p.passes = parameters_.passes;
    p.work_units = parameters.work_units;
    slots_[k].configure(p);
    if (pairs[k].is_open) static_cast<void>(pairs_.insert(slots_[k]));
  }
}

void BodyLaw::begin(std::span<const GripPose> poses) noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    const MovingBody is = body.is;
    body = Body{};
    body.is = is;
    body.p = body.goal = poses[i];
  }
  for (BodyPair& pair : pairs_) pair.reset(bodies_[pair.a()].p, of_b(pair).p);
  steps_ = 0;
  held_ = slow_ = behind_ticks_ = 0;
  still_ = settled_ = choose_from_start_ = false;
  last_ = BodiesTick{};
}

void BodyLaw::begin(std::span<const MovingBody> bodies, std::span<const GripPose> poses) noexcept {
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].is = bodies[i];
  begin(poses);
}

void BodyLaw::exchange(std::uint32_t moving, std::uint32_t resting) noexcept {
  std::swap(bodies_[moving], bodies_[resting]);
  // It is where it is, in each way that the pairs ask for that.
  Body& rests = bodies_[resting];
  rests.goal_way = rests.error = rests.carry = rests.pull = rests.wish = BodyMotion{};
  rests.pull_share = rests.share = rests.weight = 1;
  rests.came_m = rests.came_rad = 0;
  rests.is_touched = false;
  const auto other = [&](std::uint32_t body) {
    return body == moving ? resting : body == resting ? moving : body;
  };
  for (BodyPair& pair : pairs_) {
    const std::uint32_t a = other(pair.a()), b = pair.has_b() ? other(pair.b()) : kStanding;
    pair.set_bodies(a, b, pair.grip_b_m());
  }
  held_ = 0;
  settled_ = still_ = false;
}

bool BodyLaw::open_pair(std::uint32_t pair, std::uint32_t a, std::uint32_t b) noexcept {
  BodyPair& slot = slots_[pair];
  if (!pairs_.insert(slot)) return false;
  slot.set_bodies(a, b, b != kStanding ? bodies_[b].is.grip_m : Vec3(Vec3::Zero()));
  slot.reset(bodies_[a].p, of_b(slot).p);
  settled_ = false;
  return true;
}

void BodyLaw::close_pair(std::uint32_t pair) noexcept { pairs_.remove(slots_[pair]); }

bool BodyLaw::has_friction() const noexcept {
  return std::any_of(pairs_.begin(), pairs_.end(),
                     [](const BodyPair& pair) { return pair.has_friction(); });
}

bool BodyLaw::sticks() const noexcept {
  return std::any_of(pairs_.begin(), pairs_.end(),
                     [](const BodyPair& pair) { return pair.sticks(); });
}

bool BodyLaw::may_move() const noexcept {
  const ProxyScale& scale = parameters_.scale;
  return std::all_of(bodies().begin(), bodies().end(), [&](const Body& body) {
    return !(body.most_m > 0) ||
           (body.way_left_m > scale.still_m && body.turn_left_rad > scale.still_rad);
  });
}

/// Compares the goals with the last ones; true: nothing is computed any more until one moves.
bool BodyLaw::begin_rest(std::span<const GripPose> goals) noexcept {
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (is_same(goals[i], bodies_[i].goal)) continue;
    held_ = 0;
    settled_ = false;
    return false;
  }
  if (settled_) return true;
  held_ += held_ < UINT32_MAX ? 1 : 0;
  if (behind_ticks_ == 0 && !sticks() && (still_ || held_ % kChoicePeriod == 0))
    choose_from_start_ = true;
  return false;
}

/// How far each body may move in this tick: as far as its goal has, what lets go of its pull over
/// several ticks, and as far as another one may take it.
void BodyLaw::bound_moves(std::span<const GripPose> goals) noexcept {
  for (std::uint32_t i = 0; i < count_; ++i) {
    Body& body = bodies_[i];
    if (behind_ticks_ == 0) body.came_m = body.came_rad = 0;
    body.came_m += norm_of(goals[i].x0_w - body.goal.x0_w);
    body.came_rad += turn_between_rad(goals[i].q_wa, body.goal.q_wa);
    body.error = pose_error(goals[i], body.p);
    body.start_j = haptic::potential_j(body.is.spring, body.error);
  }
  for (Body& body : bodies()) {
    body.way_left_m = body.turn_left_rad = kUnbounded;
    if (!body.is.is_held_back) continue;
    const Spring& spring = body.is.spring;
    Real others_m = 0, others_rad = 0;
    for (const Body& other : bodies()) {
      if (&other == &body) continue;
      const bool is_free = !other.is.is_held_back;
      const Real far_m = is_free ? norm_of(other.error.translation_m) : other.came_m;
      const Real turn_rad = is_free ? norm_of(other.error.rotation_rad) : other.came_rad;
      const Real lever_m = norm_of(other.p.x0_w - body.p.x0_w) + body.is.radius_m;
      others_m = std::max(others_m, far_m + turn_rad * lever_m);
      others_rad = std::max(others_rad, turn_rad + far_m / body.is.radius_m);
    }
    body.way_left_m = body.came_m + others_m +
                      std::max(kRelease_n / spring.k_t_n_per_m,
                               kReleaseShare * norm_of(body.error.translation_m));
    body.turn_left_rad = body.came_rad + others_rad +
                         std::max(kReleaseTurn_n * body.is.radius_m / spring.k_r_nm_per_rad,
                                  kReleaseShare * norm_of(body.error.rotation_rad));
  }
  for (Body& body : bodies()) {
    body.way_left_m = std::min(body.way_left_m, body.most_m);
    body.turn_left_rad = std::min(body.turn_left_rad, body.most_m / body.is.radius_m);
  }
}

/// The passes of a tick, until one ends it; @return how the last one ended.
BodyLaw::PassEnd BodyLaw::make_passes(BodiesTick& told, ProxyTick& tick) noexcept {
  PassEnd end = PassEnd::kMoved;
  std::uint32_t short_passes = 0;
  for (std::uint32_t k = 0; k < parameters_.passes; ++k) {
    end = pass(k, told, tick);
    tick.work.passes += 1;
    told.moved = told.moved || end == PassEnd::kMoved;
    if (end == PassEnd::kSpent) {
      told.spent = true;
      for (BodyPair& pair : pairs_) pair.keep_found();
      break;
    }
    for (std::size_t p = 0; p < pairs_.size(); ++p)
      pairs_[p].end_pass(end == PassEnd::kMoved, end == PassEnd::kRejected, tried_m_[p]);
    if (end == PassEnd::kDone || !may_move()) break;
    if (end == PassEnd::kMoved && held_ == 0 && moved_little_) break;
    if (is_short_ && ++short_passes == kMostShortSteps) break;
    if (!has_budget(tick)) {
      told.spent = end == PassEnd::kMoved;
      break;
    }
  }
  return end;
}

BodiesTick BodyLaw::tick(std::span<const GripPose> goals) noexcept {
  steps_ = 0;
  if (begin_rest(goals)) {
    for (BodyPair& pair : pairs_) pair.rest_tick();
    for (Body& body : bodies()) body.start_j = body.potential_j;
    return last_;
  }
  const bool chosen = choose_from_start_ || sticks();
  bound_moves(goals);
  ProxyTick tick;
  for (std::uint32_t i = 0; i < count_; ++i) {
    bodies_[i].goal_way = pose_error(goals[i], bodies_[i].goal);
    bodies_[i].goal = goals[i];
  }
  for (BodyPair& pair : pairs_) {
    pair.begin_tick(bodies_[pair.a()].goal_way, of_b(pair).goal_way, {held_, behind_ticks_},
                    scratch_, tick);
  }
  may_close_ = true;
  is_short_ = false;
  round_grants_ = 0;
  BodiesTick told;
  told.start_potential_j = told.end_potential_j = sum_j();
  const PassEnd end = make_passes(told, tick);
  behind_ticks_ = told.spent ? behind_ticks_ + 1 : 0;
  told.gap_m = kUnbounded;
  for (BodyPair& pair : pairs_) {
    pair.end_tick(tick);
    told.gap_m = std::min(told.gap_m, pair.gap_m());
  }
  for (Body& body : bodies())
    body.potential_j = haptic::potential_j(body.is.spring, pose_error(body.goal, body.p));
  told.limited = tick.limited || told.residual_n > kResidual_n;
  told.work = tick.work;
  // Bodies that are on their way, however long that takes, do not look for their place.
  const bool gains =
      !may_move() || told.end_potential_j < (1 - kSomeOnTheirWay) * told.start_potential_j;
  slow_ = held_ == 0 ? 0 : gains ? slow_ - (slow_ > 0) : std::min(slow_ + 1, kMostHeld);
  still_ = !told.moved && !told.recovering && !told.spent &&
           (end == PassEnd::kDone || held_ >= kLeastHeld);
  settled_ = still_ && chosen;
  last_ = told;
  last_.moved = false;
  last_.work = ProxyWork{};
  return told;
}

Real BodyLaw::given_j(std::uint32_t body) const noexcept {
  Real risen = 0, fallen = 0;
  for (const Body& one : bodies()) {
    const Real change = one.potential_j - one.start_j;
    (change > 0 ? risen : fallen) += change;
  }
  const Real own = bodies_[body].potential_j - bodies_[body].start_j;
  if (own >= 0) return own;
  return -own * (risen / std::min(fallen, -risen));
}

Wrench BodyLaw::contact_w(std::uint32_t body) const noexcept {
  const Real k_n_per_m = bodies_[0].is.spring.k_t_n_per_m;
  const BodyMotion& force_m = bodies_[body].force_m;
  return {k_n_per_m * force_m.translation_m, k_n_per_m * force_m.rotation_rad};
}

Wrench BodyLaw::spring_w(std::uint32_t body) const noexcept {
  const Body& of = bodies_[body];
  return spring_wrench(of.is.spring, pose_error(of.goal, of.p));
}

}  // namespace haptic
