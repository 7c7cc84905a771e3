// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "rt_core/base/step_flags.hpp"
#include "rt_core/proxy/free_motion.hpp"

namespace haptic {
namespace {

/// The radius at which a turn of a driven part counts like a displacement, in radii of it.
constexpr Real kTurnShare = 0.5_r;

constexpr std::size_t rounded(std::size_t bytes) noexcept {
  return (bytes + kLawAlignment - 1) / kLawAlignment * kLawAlignment;
}

Vec3 vec3_of(const double (&v)[3]) noexcept {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

Spring driven_spring(const Spring& hand, const DrivenRecord& record) noexcept {
  Spring spring;
  spring.k_t_n_per_m = static_cast<Real>(record.ratio) * hand.k_t_n_per_m;
  spring.length_m = kTurnShare * static_cast<Real>(record.radius_m);
  spring.k_r_nm_per_rad = spring.k_t_n_per_m * spring.length_m * spring.length_m;
  // An anchor gives way instead, and a weight is no more than it is.
  if (record.lead != Lead::kOwner) return spring;
  spring.soft_translation_m = static_cast<Real>(record.push_n) / spring.k_t_n_per_m;
  spring.soft_rotation_rad = spring.soft_translation_m / spring.length_m;
  return spring;
}

std::uint32_t sum(std::uint32_t one, std::uint32_t other) noexcept {
  return other > UINT32_MAX - one ? UINT32_MAX : one + other;
}

std::uint32_t times(std::uint32_t one, std::uint32_t many) noexcept {
  return one > UINT32_MAX / many ? UINT32_MAX : one * many;
}

}  // namespace

void JointMotion::count_rooms(Arena& arena, JointScenes::Counts counts) noexcept {
  static_cast<void>(arena.take<SceneView>(counts.views));
  static_cast<void>(arena.take<std::uint8_t>(counts.kinds));
}

std::size_t JointMotion::state_bytes(const PartScenes& parts, const JointScenes& scenes,
                                     std::span<const BodyPairScene> slots) noexcept {
  Arena counting;
  count_rooms(counting, JointScenes::count(parts, scenes.held()));
  static_cast<void>(counting.take<BodyPairScene>(slots.size()));
  if (scenes.takes_turns()) {
    static_cast<void>(counting.take<AwakeSet>(1));
    AwakeSet::count_bytes(counting, scenes);
  }
  if (scenes.is_needed())
    BodyLaw::count_bytes(counting, slots, scenes.moving_count(), scenes.count());
  static_cast<void>(counting.take<MovingBody>(scenes.count()));
  static_cast<void>(counting.take<GripPose>(scenes.count()));
  return rounded(sizeof(JointMotion)) + rounded(counting.used());
}

/// As state_bytes() counts it; each room is taken once it is known to fit into `bytes`.
RtStatus JointMotion::place(Arena& arena, std::size_t bytes, const PartScenes& parts,
                            const PartsInHands& held) noexcept {
  const JointScenes::Counts counts = JointScenes::count(parts, held);
  Arena counting;
  count_rooms(counting, counts);
  if (counting.used() > bytes) return RtStatus::kMemoryTooSmall;
  arena.enter(StatePart::kLaw);
  const std::span<SceneView> views = arena.take<SceneView>(counts.views);
  const std::span<std::uint8_t> kinds = arena.take<std::uint8_t>(counts.kinds);
  const RtStatus status = scenes_.open(parts, held, views, kinds);
  if (status != RtStatus::kOk || !scenes_.is_needed()) return status;
  const std::uint32_t slots = scenes_.list({});
  static_cast<void>(counting.take<BodyPairScene>(slots));
  if (counting.used() > bytes) return RtStatus::kMemoryTooSmall;
  slots_ = arena.take<BodyPairScene>(slots);
  static_cast<void>(scenes_.list(slots_));
  if (state_bytes(parts, scenes_, slots_) > rounded(sizeof(JointMotion)) + bytes)
    return RtStatus::kMemoryTooSmall;
  if (scenes_.takes_turns()) {
    turns_ = arena.take<AwakeSet>(1).data();
    turns_->place(arena, scenes_);
  }
  law_.place(arena, slots_, scenes_.moving_count(), scenes_.count());
  bodies_ = arena.take<MovingBody>(scenes_.count());
  starts_ = arena.take<GripPose>(scenes_.count());
  return RtStatus::kOk;
}

MovingBody JointMotion::body_of(std::uint32_t member) const noexcept {
  MovingBody body;
  if (member < hands()) {
    const SceneView& held = *scenes_.held().scene[member];
    body.spring = held_spring_[member];
    body.grip_m = vec3_of(held.bodies()[0].reference_m);
    body.radius_m = scene_size(held).radius_m;
    return body;
  }
  const DrivenRecord& record = parts_->record(scenes_.mover_of(member));
  body.spring = driven_spring(held_spring_[0], record);
  body.grip_m = vec3_of(record.middle_m);
  body.radius_m = static_cast<Real>(record.radius_m);
  body.is_held_back = false;
  return body;
}

void JointMotion::configure_turns(Real tolerance_m) noexcept {
  std::array<AwakeSet::Member, kMostBodies> members;
  for (std::uint32_t m = 0; m < bodies_.size(); ++m) {
    members[m] = {bodies_[m].grip_m, bodies_[m].radius_m, false};
    if (m >= hands()) members[m].sinks = parts_->record(scenes_.mover_of(m)).lead == Lead::kWeight;
  }
  turns_->configure(scenes_, slots_, std::span(members).first(bodies_.size()), tolerance_m);
}

void JointMotion::configure() noexcept {
  const SceneParameters& p = scenes_.held().scene[0]->parameters();
  Real least_m = 0;
  for (std::uint32_t hand = 0; hand < hands(); ++hand)
    held_spring_[hand] = coupling_spring(scenes_.held().scene[hand]->parameters().coupling);
  met_ = 0;
  for (std::uint32_t m = 0; m < scenes_.count(); ++m) {
    bodies_[m] = body_of(m);
    if (m >= hands())
      met_ |= std::uint64_t{1} << scenes_.mover_of(m);
    else
      least_m = m == 0 ? bodies_[m].radius_m : std::min(least_m, bodies_[m].radius_m);
  }
  BodyLaw::Parameters parameters;
  parameters.scale = proxy_scale(*scenes_.held().scene[0]);
  parameters.passes = p.coupling.passes;
  parameters.work_units = p.work_units;
  parameters.epsilon_m = static_cast<Real>(p.epsilon_m);
  behind_m_ = kBehind_m * least_m / kBehindFor_m;
  for (std::uint32_t k = 0; k < scenes_.kind_count(); ++k) {
    // Rounding is that of the largest coordinates.
    const ProxyScale scale = proxy_scale(scenes_.scene(static_cast<std::uint8_t>(k)));
    if (scale.tolerance_m > parameters.scale.tolerance_m) parameters.scale = scale;
  }
  bounds_ = bounds_of_tick();
  law_.read_scenes(slots_);
  law_.configure(parameters, slots_, bodies_);
  if (turns_ != nullptr) configure_turns(parameters.scale.tolerance_m);
  for (BodyPair& pair : law_.pairs())
    if (!pair.has_b() && pair.a() < hands()) told_[pair.a()].over_standing = &pair.proxy();
}

SceneCapacity JointMotion::bounds_of_tick() const noexcept {
  const SceneView& first = *scenes_.held().scene[0];
  const SceneParameters& p = first.parameters();
  SceneCapacity bounds = first.header().capacity;
  if (scenes_.kind(0, kStanding) == JointScenes::kNone) {
    bounds.max_work_units = p.work_units;
    bounds.max_list_visits = bounds.max_full_searches = 0;
  }
  const std::uint32_t blocks = scenes_.moving_count();
  for (const BodyPairScene& pair : slots_) {
    if (pair.is_open && pair.a == 0 && pair.b == kStanding) continue;  // in it already
    const SceneCapacity& more = pair.scene->header().capacity;
    bounds.max_work_units =
        sum(bounds.max_work_units, more.max_work_units - pair.scene->parameters().work_units);
    bounds.max_list_visits = sum(bounds.max_list_visits, more.max_list_visits);
    bounds.max_full_searches = sum(bounds.max_full_searches, more.max_full_searches);
  }
  if (scenes_.takes_turns()) bounds.max_work_units = sum(bounds.max_work_units, kTurnUnits);
  bounds.max_proxy_passes = bounds.max_proxy_rejected = p.coupling.passes;
  bounds.max_proxy_rounds = BodyLaw::most_rounds(blocks);
  bounds.max_qp_rows = kMostBlockRows;
  bounds.max_qp_iterations = times(kMaxBlockIterations, blocks);
  // Islands are programs of their own, and a step is shortened by bodies.
  bounds.max_qp_programs = times(bounds.max_qp_programs, 2 * blocks);
  bounds.max_qp_steps = times(bounds.max_qp_programs, bounds.max_qp_iterations);
  return bounds;
}

RtStatus JointMotion::create(std::span<std::byte> memory, const PartScenes& parts,
                             const PartsInHands& held, DrivenParts& movers,
                             JointMotion*& motion) noexcept {
  motion = nullptr;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kLawAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  constexpr std::size_t kOwn = rounded(sizeof(JointMotion));
  if (memory.size() < kOwn) return RtStatus::kMemoryTooSmall;
  JointMotion* const made =
      ::new (static_cast<void*>(memory.data())) JointMotion(movers);  // placement, no heap
  Arena arena(memory.data() + kOwn);
  const RtStatus status = made->place(arena, memory.size() - kOwn, parts, held);
  if (status != RtStatus::kOk || !made->scenes_.is_needed()) return status;
  made->configure();
  motion = made;
  return RtStatus::kOk;
}

/// Planes of all that holds a hand's part, in W axes.
void JointMotion::feel(std::uint32_t hand) noexcept {
  FeltContact& felt = told_[hand].felt;
  felt = FeltContact{};
  for (const BodyPair& pair : law_.pairs()) {
    const bool is_a = pair.a() == hand;
    if (!is_a && !(pair.has_b() && pair.b() == hand)) continue;
    const FeltContact& own = pair.felt();
    if (own.plane_count > 0) {
      felt.situation = felt.plane_count > 0 ? ContactSituation::kSeveralPlanes : own.situation;
    }
    felt.point_count += own.point_count;
    for (std::uint32_t k = 0; k < own.plane_count && felt.plane_count < kMaxFeltPlanes; ++k) {
      FeltPlane& plane = felt.planes[felt.plane_count++];
      plane = own.planes[k];
      if (!pair.has_b()) continue;
      const std::uint32_t other = is_a ? pair.b() : pair.a();
      const Vec3 normal_w = law_.pose(pair.b()).r_wa * plane.normal_w;
      plane.normal_w = is_a ? normal_w : -normal_w;
      plane.pair = kMovingPlanes + scenes_.part_of(member_at(other));
    }
  }
}

/// The hand, as a bit, whose part a pair has beside `body`; 0: none.
std::uint32_t JointMotion::hands_in(const BodyPair& pair, std::uint32_t body) const noexcept {
  if (!pair.has_b()) return 0;
  if (pair.b() == body && pair.a() < hands()) return 1u << pair.a();
  return pair.a() == body && pair.b() < hands() ? 1u << pair.b() : 0;
}

/// Where a mover has come to, and with what on it.
void JointMotion::lead_back(std::uint32_t body) noexcept {
  const std::uint32_t k = mover_at(body);
  std::uint32_t touched_by = 0;
  for (const BodyPair& pair : law_.pairs())
    if (pair.felt().plane_count > 0) touched_by |= hands_in(pair, body);
  const Wrench pushed_w = law_.contact_w(body);
  parts_->take(k, law_.pose(body), pushed_w, touched_by);
  const DrivenRecord& record = parts_->record(k);
  const Real k_n_per_m = static_cast<Real>(record.ratio) * held_spring_[0].k_t_n_per_m;
  if (record.lead != Lead::kOwner) {
    const Real most_m = static_cast<Real>(record.push_n) / k_n_per_m;
    const Real length_m = kTurnShare * static_cast<Real>(record.radius_m);
    parts_->give_way(k, most_m, most_m / length_m);
    return;
  }
  const Real stretch_m = norm_of(pushed_w.force_w) / k_n_per_m;
  if (parts_->states()[k].lag_m > std::max(behind_m_, kBehindForces * stretch_m))
    for (SharedMotion& hand : told_) hand.flags |= kFlagDrivenBehind;
}

void JointMotion::lead_back() noexcept {
  for (std::uint32_t body = hands(); body < law_.body_count(); ++body) lead_back(body);
  for (std::uint32_t body = law_.body_count(); body < scenes_.count(); ++body)
    parts_->rest(mover_at(body));
  for (std::uint32_t k = 0; k < parts_->count(); ++k)
    if ((met_ >> k & 1) == 0) parts_->pass(k);
}

/// The part of one hand that begins is at its goal. Those of two are there at first; after that the
/// law goes on, for a hand that begins again is no reason that the other feels anything.
void JointMotion::begin() noexcept {
  for (SharedMotion& hand : told_) hand.started = true;
  if (has_begun_ && hands() > 1) return;
  std::copy_n(goals_.begin(), hands(), starts_.begin());
  for (std::uint32_t m = hands(); m < scenes_.count(); ++m)
    starts_[m] = parts_->felt(scenes_.mover_of(m));
  if (turns_ != nullptr) turns_->begin(law_, starts_);
  law_.begin(bodies_, starts_);
  has_begun_ = true;
}

/// A hand's part is in another, and comes out.
bool JointMotion::is_inside(std::uint32_t hand) const noexcept {
  const OpenPairs& pairs = law_.pairs();
  return std::any_of(pairs.begin(), pairs.end(), [&](const BodyPair& pair) {
    const bool has_hand = pair.a() == hand || (pair.has_b() && pair.b() == hand);
    return has_hand && pair.is_recovering();
  });
}

/// Where the last tick has left a hand's part.
void JointMotion::tell(std::uint32_t hand, const BodiesTick& moved, const GripPose& goal) noexcept {
  SharedMotion& of = told_[hand];
  of.flags = 0;
  of.pose = law_.pose(hand);
  of.told = ProxyTick{};
  of.told.error = pose_error(goal, of.pose);
  of.told.gap_m = moved.gap_m;
  of.told.start_potential_j = moved.start_potential_j;
  of.told.end_potential_j = law_.potential_j(hand);
  of.told.residual_n = moved.residual_n;
  of.told.behind_ticks = law_.behind_ticks();
  of.told.spent = moved.spent;
  of.told.moved = moved.moved;
  of.told.limited = moved.limited;
  of.told.recovering = moved.recovering && is_inside(hand);
  of.told.work = moved.work;
  of.given_j += static_cast<double>(law_.given_j(hand));
  of.held_m = norm_of(law_.contact_w(hand).force_w) / held_spring_[hand].k_t_n_per_m;
  feel(hand);
}

GripPose JointMotion::goal_of(std::uint32_t body) const noexcept {
  return body < hands() ? goals_[body] : parts_->goal(mover_at(body));
}

/// Which of the loose parts move in this tick.
void JointMotion::take_turns() noexcept {
  Real ahead_m = 0;
  for (std::uint32_t body = 0; body < law_.body_count(); ++body) {
    if (scenes_.is_loose(member_at(body))) continue;
    const PoseError way = pose_error(goal_of(body), law_.goal(body));
    ahead_m = std::max(
        ahead_m, norm_of(way.translation_m) + law_.radius_m(body) * norm_of(way.rotation_rad));
  }
  turns_->choose(law_, ahead_m);
}

void JointMotion::tick() noexcept {
  const bool started = std::all_of(told_.begin(), told_.begin() + hands(),
                                   [](const SharedMotion& hand) { return hand.started; });
  if (!started) begin();
  if (turns_ != nullptr) take_turns();
  std::array<GripPose, kMostMovingBodies> goals;
  for (std::uint32_t body = 0; body < law_.body_count(); ++body) goals[body] = goal_of(body);
  BodiesTick moved = law_.tick(std::span(goals).first(law_.body_count()));
  if (turns_ != nullptr) {
    moved.limited = moved.limited || turns_->is_crowded();
    moved.work.search_work += kTurnUnits;
  }
  for (std::uint32_t hand = 0; hand < hands(); ++hand) tell(hand, moved, goals[hand]);
  lead_back();
}

}  // namespace haptic
