// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/driven_motion.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "rt_core/base/step_flags.hpp"
#include "rt_core/proxy/free_motion.hpp"

namespace haptic {
namespace {

/// Body of the part that is held.
constexpr std::uint32_t kHeld = 0;
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

/// The part with all that stands, and with each driven part that it meets: bodies 1, 2 and so on.
std::uint32_t DrivenMotion::list_pairs(const DrivenScenes& scenes,
                                       std::array<BodyPairScene, kMostDriven + 1>& pairs) noexcept {
  std::uint32_t count = 0, body = kHeld;
  if (scenes.meets_standing) pairs[count++] = {kHeld, kStanding, scenes.held};
  for (const SceneView* with : scenes.with)
    if (with != nullptr) pairs[count++] = {kHeld, ++body, with};
  return count;
}

void DrivenMotion::place(Arena& arena, const DrivenScenes& scenes) noexcept {
  std::array<BodyPairScene, kMostDriven + 1> pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  met_count_ = 0;
  for (std::uint32_t k = 0; k < kMostDriven; ++k)
    if (scenes.with[k] != nullptr) met_[met_count_++] = k;
  arena.enter(StatePart::kLaw);
  law_.place(arena, std::span(pairs).first(count), met_count_ + 1);
}

void DrivenMotion::configure(const DrivenScenes& scenes) noexcept {
  std::array<BodyPairScene, kMostDriven + 1> pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  const SceneView& held = *scenes.held;
  const SceneParameters& p = held.parameters();
  std::array<MovingBody, kMostDriven + 1> bodies;
  MovingBody& part = bodies[kHeld];
  part.spring = held_spring_ = coupling_spring(p.coupling);
  part.grip_m = vec3_of(held.bodies()[0].reference_m);
  part.radius_m = scene_size(held).radius_m;
  for (std::uint32_t j = 0; j < met_count_; ++j) {
    const DrivenRecord& record = parts_->record(met_[j]);
    MovingBody& driven = bodies[j + 1];
    driven.spring = driven_spring(part.spring, record);
    driven.grip_m = vec3_of(record.middle_m);
    driven.radius_m = static_cast<Real>(record.radius_m);
    driven.is_held_back = false;
  }
  BodyLaw::Parameters parameters;
  parameters.scale = proxy_scale(held);
  parameters.passes = p.coupling.passes;
  parameters.work_units = p.work_units;
  parameters.epsilon_m = static_cast<Real>(p.epsilon_m);
  behind_m_ = kBehind_m * part.radius_m / kBehindFor_m;
  for (const BodyPairScene& pair : std::span(pairs).first(count)) {
    // Rounding is that of the largest coordinates.
    const ProxyScale scale = proxy_scale(*pair.scene);
    if (scale.tolerance_m > parameters.scale.tolerance_m) parameters.scale = scale;
  }
  bounds_ = bounds_of(scenes);
  const std::uint32_t blocks = met_count_ + 1;
  law_.read_scenes(std::span(pairs).first(count));
  law_.configure(parameters, std::span(pairs).first(count), std::span(bodies).first(blocks));
  if (scenes.meets_standing) over_standing = &law_.pairs()[0].proxy();
}

SceneCapacity DrivenMotion::bounds_of(const DrivenScenes& scenes) noexcept {
  const SceneParameters& p = scenes.held->parameters();
  SceneCapacity bounds = scenes.held->header().capacity;
  if (!scenes.meets_standing) {
    bounds.max_work_units = p.work_units;
    bounds.max_list_visits = bounds.max_full_searches = 0;
  }
  std::uint32_t blocks = 1;
  for (const SceneView* with : scenes.with) {
    if (with == nullptr) continue;
    const SceneCapacity& more = with->header().capacity;
    bounds.max_work_units = sum(bounds.max_work_units, more.max_work_units - p.work_units);
    bounds.max_list_visits = sum(bounds.max_list_visits, more.max_list_visits);
    bounds.max_full_searches = sum(bounds.max_full_searches, more.max_full_searches);
    blocks += 1;
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

std::size_t DrivenMotion::state_bytes(const DrivenScenes& scenes) noexcept {
  Arena counting;
  std::array<BodyPairScene, kMostDriven + 1> pairs;
  const std::uint32_t count = list_pairs(scenes, pairs);
  const auto met = std::count_if(scenes.with.begin(), scenes.with.end(),
                                 [](const SceneView* with) { return with != nullptr; });
  BodyLaw::count_bytes(counting, std::span(pairs).first(count),
                       static_cast<std::uint32_t>(met) + 1);
  return rounded(sizeof(DrivenMotion)) + rounded(counting.used());
}

RtStatus DrivenMotion::create(std::span<std::byte> memory, const DrivenScenes& scenes,
                              DrivenParts& parts, DrivenMotion*& motion) noexcept {
  motion = nullptr;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kLawAlignment != 0)
    return RtStatus::kMemoryMisaligned;
  if (memory.size() < state_bytes(scenes)) return RtStatus::kMemoryTooSmall;
  motion = ::new (static_cast<void*>(memory.data())) DrivenMotion(parts);  // placement, no heap
  Arena arena(memory.data() + rounded(sizeof(DrivenMotion)));
  motion->place(arena, scenes);
  motion->configure(scenes);
  return RtStatus::kOk;
}

/// Planes of all that holds the part, in W axes.
void DrivenMotion::feel() noexcept {
  felt = FeltContact{};
  for (const BodyPair& pair : law_.pairs()) {
    const FeltContact& own = pair.felt();
    if (own.plane_count > 0) {
      felt.situation = felt.plane_count > 0 ? ContactSituation::kSeveralPlanes : own.situation;
    }
    felt.point_count += own.point_count;
    for (std::uint32_t k = 0; k < own.plane_count && felt.plane_count < kMaxFeltPlanes; ++k) {
      FeltPlane& plane = felt.planes[felt.plane_count++];
      plane = own.planes[k];
      if (!pair.has_b()) continue;
      plane.normal_w = law_.pose(pair.b()).r_wa * plane.normal_w;
      plane.pair = kMovingPlanes + parts_->record(met_[pair.b() - 1]).part;
    }
  }
}

/// Where the driven parts have come to, and with what on them.
void DrivenMotion::lead_back() noexcept {
  for (std::uint32_t j = 0; j < met_count_; ++j) {
    const std::uint32_t body = j + 1, k = met_[j];
    const auto touches = [&](const BodyPair& pair) {
      return pair.b() == body && pair.felt().plane_count > 0;
    };
    const bool touched = std::any_of(law_.pairs().begin(), law_.pairs().end(), touches);
    const Wrench pushed_w = law_.contact_w(body);
    parts_->take(k, law_.pose(body), pushed_w, touched);
    const Real stretch_m = norm_of(pushed_w.force_w) / static_cast<Real>(parts_->record(k).ratio) /
                           held_spring_.k_t_n_per_m;
    if (parts_->states()[k].lag_m > std::max(behind_m_, kBehindForces * stretch_m))
      flags |= kFlagDrivenBehind;
  }
  for (std::uint32_t k = 0; k < parts_->count(); ++k) {
    const auto met = std::span(met_).first(met_count_);
    if (std::find(met.begin(), met.end(), k) == met.end()) parts_->pass(k);
  }
}

void DrivenMotion::tick(const GripPose& goal) noexcept {
  std::array<GripPose, kMostDriven + 1> goals;
  goals[kHeld] = goal;
  if (!started) {
    for (std::uint32_t j = 0; j < met_count_; ++j) goals[j + 1] = parts_->felt(met_[j]);
    law_.begin(std::span(goals).first(met_count_ + 1));
    started = true;
  }
  for (std::uint32_t j = 0; j < met_count_; ++j) goals[j + 1] = parts_->goal(met_[j]);
  const BodiesTick moved = law_.tick(std::span(goals).first(met_count_ + 1));

  flags = 0;
  pose = law_.pose(kHeld);
  told = ProxyTick{};
  told.error = pose_error(goal, pose);
  told.gap_m = moved.gap_m;
  told.start_potential_j = moved.start_potential_j;
  told.end_potential_j = law_.potential_j(kHeld);
  told.residual_n = moved.residual_n;
  told.behind_ticks = law_.behind_ticks();
  told.spent = moved.spent;
  told.moved = moved.moved;
  told.limited = moved.limited;
  told.recovering = moved.recovering;
  told.work = moved.work;
  given_j = static_cast<double>(law_.given_j(kHeld));
  held_m = norm_of(law_.contact_w(kHeld).force_w) / held_spring_.k_t_n_per_m;
  feel();
  lead_back();
}

}  // namespace haptic
