// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "rt_core/base/step_flags.hpp"
#include "rt_core/proxy/free_motion.hpp"

namespace haptic {
namespace {

/// In place of the number of a body: the mover is none.
constexpr std::uint32_t kNoBody = kStanding - 1;
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

/// Another part that moves may meet it, or it is loose.
bool JointMotion::meets(const JointScenes& scenes, std::uint32_t mover) noexcept {
  const JointScenes::OfMover& own = scenes.movers[mover];
  const auto is_there = [](const SceneView* scene) { return scene != nullptr; };
  bool meets = own.standing != nullptr ||
               std::any_of(own.with_hand.begin(), own.with_hand.end(), is_there) ||
               std::any_of(own.with.begin(), own.with.end(), is_there);
  for (std::uint32_t hand = 0; hand < scenes.hands; ++hand)
    meets = meets || scenes.of[hand].with[mover] != nullptr;
  for (const JointScenes::OfMover& other : scenes.movers)
    meets = meets || other.with[mover] != nullptr;
  return meets;
}

std::uint32_t JointMotion::body_count(const JointScenes& scenes) noexcept {
  std::uint32_t count = scenes.hands;
  for (std::uint32_t k = 0; k < kMostDriven; ++k) count += meets(scenes, k) ? 1u : 0u;
  return std::min(count, kMostMovingBodies);
}

/// The pairs in which a mover is A.
void JointMotion::list_mover(const JointScenes& scenes, std::uint32_t mover,
                             const std::array<std::uint32_t, kMostDriven>& bodies, Pairs& pairs,
                             std::uint32_t& count) noexcept {
  const JointScenes::OfMover& own = scenes.movers[mover];
  const auto add = [&](std::uint32_t b, const SceneView* scene) {
    if (scene != nullptr && b != kNoBody && count < pairs.size())
      pairs[count++] = {bodies[mover], b, scene};
  };
  add(kStanding, own.standing);
  for (std::uint32_t hand = 0; hand < scenes.hands; ++hand) add(hand, own.with_hand[hand]);
  for (std::uint32_t other = 0; other < kMostDriven; ++other) add(bodies[other], own.with[other]);
}

/// The hands' parts are the first bodies, and the movers that may meet one of them, or that are
/// loose, the next. First each hand's part with all that stands there, then with each other, then
/// with the movers, and these with what they may meet.
std::uint32_t JointMotion::list_pairs(const JointScenes& scenes, Pairs& pairs) noexcept {
  std::uint32_t count = 0;
  for (std::uint32_t hand = 0; hand < scenes.hands; ++hand)
    if (scenes.of[hand].meets_standing) pairs[count++] = {hand, kStanding, scenes.of[hand].held};
  const std::uint32_t a = scenes.between_a;
  if (scenes.between != nullptr) pairs[count++] = {a, 1 - a, scenes.between};
  std::uint32_t next = scenes.hands;
  std::array<std::uint32_t, kMostDriven> bodies;
  bodies.fill(kNoBody);
  for (std::uint32_t k = 0; k < kMostDriven; ++k) {
    if (!meets(scenes, k) || next == kMostMovingBodies) continue;
    bodies[k] = next++;
    for (std::uint32_t hand = 0; hand < scenes.hands; ++hand) {
      const SceneView* const with = scenes.of[hand].with[k];
      if (with != nullptr) pairs[count++] = {hand, bodies[k], with};
    }
  }
  for (std::uint32_t k = 0; k < kMostDriven; ++k)
    if (bodies[k] != kNoBody) list_mover(scenes, k, bodies, pairs, count);
  return count;
}

void JointMotion::place(Arena& arena, const JointScenes& scenes) noexcept {
  Pairs pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  hands_ = scenes.hands;
  met_count_ = 0;
  for (std::uint32_t k = 0; k < kMostDriven; ++k)
    if (meets(scenes, k) && hands_ + met_count_ < kMostMovingBodies) met_[met_count_++] = k;
  arena.enter(StatePart::kLaw);
  law_.place(arena, std::span(pairs).first(count), hands_ + met_count_);
}

void JointMotion::configure(const JointScenes& scenes) noexcept {
  Pairs pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  const SceneParameters& p = scenes.of[0].held->parameters();
  std::array<MovingBody, kMostMovingBodies> bodies;
  Real least_m = 0;
  for (std::uint32_t hand = 0; hand < hands_; ++hand) {
    const SceneView& held = *scenes.of[hand].held;
    MovingBody& part = bodies[hand];
    part.spring = held_spring_[hand] = coupling_spring(held.parameters().coupling);
    part.grip_m = vec3_of(held.bodies()[0].reference_m);
    part.radius_m = scene_size(held).radius_m;
    least_m = hand == 0 ? part.radius_m : std::min(least_m, part.radius_m);
  }
  for (std::uint32_t j = 0; j < met_count_; ++j) {
    const DrivenRecord& record = parts_->record(met_[j]);
    MovingBody& driven = bodies[hands_ + j];
    driven.spring = driven_spring(bodies[0].spring, record);
    driven.grip_m = vec3_of(record.middle_m);
    driven.radius_m = static_cast<Real>(record.radius_m);
    driven.is_held_back = false;
  }
  BodyLaw::Parameters parameters;
  parameters.scale = proxy_scale(*scenes.of[0].held);
  parameters.passes = p.coupling.passes;
  parameters.work_units = p.work_units;
  parameters.epsilon_m = static_cast<Real>(p.epsilon_m);
  behind_m_ = kBehind_m * least_m / kBehindFor_m;
  for (const BodyPairScene& pair : std::span(pairs).first(count)) {
    // Rounding is that of the largest coordinates.
    const ProxyScale scale = proxy_scale(*pair.scene);
    if (scale.tolerance_m > parameters.scale.tolerance_m) parameters.scale = scale;
  }
  bounds_ = bounds_of(scenes);
  law_.read_scenes(std::span(pairs).first(count));
  law_.configure(parameters, std::span(pairs).first(count),
                 std::span(bodies).first(hands_ + met_count_));
  for (BodyPair& pair : law_.pairs())
    if (!pair.has_b() && pair.a() < hands_) told_[pair.a()].over_standing = &pair.proxy();
}

SceneCapacity JointMotion::bounds_of(const JointScenes& scenes) noexcept {
  const JointScenes::OfHand& first = scenes.of[0];
  const SceneParameters& p = first.held->parameters();
  SceneCapacity bounds = first.held->header().capacity;
  if (!first.meets_standing) {
    bounds.max_work_units = p.work_units;
    bounds.max_list_visits = bounds.max_full_searches = 0;
  }
  Pairs pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  const std::uint32_t blocks = body_count(scenes);
  for (const BodyPairScene& pair : std::span(pairs).first(count)) {
    if (pair.a == 0 && pair.b == kStanding) continue;  // in it already
    const SceneCapacity& more = pair.scene->header().capacity;
    bounds.max_work_units = sum(bounds.max_work_units, more.max_work_units - p.work_units);
    bounds.max_list_visits = sum(bounds.max_list_visits, more.max_list_visits);
    bounds.max_full_searches = sum(bounds.max_full_searches, more.max_full_searches);
  }
  bounds.max_proxy_passes = bounds.max_proxy_rejected = p.coupling.passes;
  bounds.max_proxy_rounds = BodyLaw::most_rounds(blocks);
  bounds.max_qp_rows = kMostBlockRows;
  bounds.max_qp_iterations = times(kMaxBlockIterations, blocks);
  // Islands are programs of their own, and a step is shortened by bodies.
  bounds.max_qp_programs = times(bounds.max_qp_programs, 2 * blocks);
  bounds.max_qp_steps = times(bounds.max_qp_programs, bounds.max_qp_iterations);
  return bounds;
}

std::size_t JointMotion::state_bytes(const JointScenes& scenes) noexcept {
  Arena counting;
  Pairs pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  BodyLaw::count_bytes(counting, std::span(pairs).first(count), body_count(scenes));
  return rounded(sizeof(JointMotion)) + rounded(counting.used());
}

RtStatus JointMotion::create(std::span<std::byte> memory, const JointScenes& scenes,
                             DrivenParts& parts, JointMotion*& motion) noexcept {
  motion = nullptr;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kLawAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  if (memory.size() < state_bytes(scenes)) return RtStatus::kMemoryTooSmall;
  motion = ::new (static_cast<void*>(memory.data())) JointMotion(parts);  // placement, no heap
  Arena arena(memory.data() + rounded(sizeof(JointMotion)));
  motion->place(arena, scenes);
  motion->configure(scenes);
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
      plane.pair =
          kMovingPlanes + (other < hands_ ? other : parts_->record(met_[other - hands_]).part);
    }
  }
}

/// The hand, as a bit, whose part a pair has beside `body`; 0: none.
std::uint32_t JointMotion::hands_in(const BodyPair& pair, std::uint32_t body) const noexcept {
  if (!pair.has_b()) return 0;
  if (pair.b() == body && pair.a() < hands_) return 1u << pair.a();
  return pair.a() == body && pair.b() < hands_ ? 1u << pair.b() : 0;
}

/// Where a mover has come to, and with what on it.
void JointMotion::lead_back(std::uint32_t body) noexcept {
  const std::uint32_t k = met_[body - hands_];
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
  for (std::uint32_t j = 0; j < met_count_; ++j) lead_back(hands_ + j);
  const auto met = std::span(met_).first(met_count_);
  for (std::uint32_t k = 0; k < parts_->count(); ++k)
    if (std::find(met.begin(), met.end(), k) == met.end()) parts_->pass(k);
}

/// The part of one hand that begins is at its goal. Those of two are there at first; after that the
/// law goes on, for a hand that begins again is no reason that the other feels anything.
void JointMotion::begin() noexcept {
  for (SharedMotion& hand : told_) hand.started = true;
  if (has_begun_ && hands_ > 1) return;
  std::array<GripPose, kMostMovingBodies> poses;
  std::copy_n(goals_.begin(), hands_, poses.begin());
  for (std::uint32_t j = 0; j < met_count_; ++j) poses[hands_ + j] = parts_->felt(met_[j]);
  law_.begin(std::span(poses).first(hands_ + met_count_));
  has_begun_ = true;
}

/// A hand's part is in another, and comes out.
bool JointMotion::is_inside(std::uint32_t hand) const noexcept {
  const std::span<const BodyPair> pairs = law_.pairs();
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

void JointMotion::tick() noexcept {
  const bool started = std::all_of(told_.begin(), told_.begin() + hands_,
                                   [](const SharedMotion& hand) { return hand.started; });
  if (!started) begin();
  std::array<GripPose, kMostMovingBodies> goals;
  std::copy_n(goals_.begin(), hands_, goals.begin());
  for (std::uint32_t j = 0; j < met_count_; ++j) goals[hands_ + j] = parts_->goal(met_[j]);
  const BodiesTick moved = law_.tick(std::span(goals).first(hands_ + met_count_));
  for (std::uint32_t hand = 0; hand < hands_; ++hand) tell(hand, moved, goals[hand]);
  lead_back();
}

}  // namespace haptic
