// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/awake_set.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"

namespace haptic {
namespace {

/// Two are asked about where they are nearer than this share of the smaller one's radius and so
/// many times what goals go in a tick, until they are twice as far apart; and one moves where
/// another is nearer that moves.
constexpr Real kNearShare = 0.25_r, kNearWays = 4;
constexpr Real kWakeShare = 0.03_r, kWakeWays = 2;
/// A body that has not gone farther than the tolerance for so many ticks rests.
constexpr std::uint32_t kRestTicks = 40;
/// Bodies that change places in one tick, and pairs that are asked for the first time, at most.
constexpr std::uint32_t kMostExchanges = 2, kMostOpened = 12;
/// Pairs of loose parts that are asked at once, at most: the rest is for those that always move.
constexpr std::size_t kMostLoosePairs = kMostOpenPairs / 2;
/// Share of the room between two that neither may go in a tick, with its turn: half of it for each,
/// half of that for its way.
constexpr Real kWayShare = 0.25_r;

std::size_t slot_count(const JointScenes& scenes) noexcept {
  std::size_t count = 0;
  for (std::uint32_t k = 0; k < scenes.kind_count(); ++k)
    count += scenes.shared_slots(static_cast<std::uint8_t>(k));
  return count;
}

/// Distance of a ball's middle from a box, in the axes of the box.
Real distance_m(const Vec3& point, const Vec3& middle_m, const Vec3& half_m) noexcept {
  const Vec3 out = ((point - middle_m).cwiseAbs() - half_m).cwiseMax(Real{0});
  return std::sqrt(out.squaredNorm());
}

}  // namespace

void AwakeSet::place(Arena& arena, const JointScenes& scenes) noexcept {
  const std::size_t members = scenes.count();
  slot_of_ = arena.take<std::uint16_t>(members * members);
  is_taken_ = arena.take<std::uint8_t>(slot_count(scenes));
}

void AwakeSet::count_bytes(Arena& arena, const JointScenes& scenes) noexcept {
  const std::size_t members = scenes.count();
  static_cast<void>(arena.take<std::uint16_t>(members * members));
  static_cast<void>(arena.take<std::uint8_t>(slot_count(scenes)));
}

/// Body 0 is about its grip point; any other stands at its mesh frame, about a point of reference.
AwakeSet::Box AwakeSet::box_of(const SceneView& scene, std::uint32_t body,
                               const Vec3& grip_m) noexcept {
  Vec3 low = Vec3::Constant(kUnbounded), high = Vec3::Constant(-kUnbounded);
  const BodyRecord& record = scene.bodies()[body];
  for (std::uint32_t k = 0; k < record.piece_count; ++k) {
    const PieceView piece = scene.piece(record.piece_begin + k);
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      low = low.cwiseMin(piece.vertex(v));
      high = high.cwiseMax(piece.vertex(v));
    }
  }
  Vec3 middle = (low + high) / 2;
  for (int k = 0; k < 3 && body > 0; ++k)
    middle[k] += static_cast<Real>(record.reference_m[k]) - grip_m[k];
  return {middle, (high - low) / 2};
}

/// From a scene that it is in.
AwakeSet::Box AwakeSet::box_of(std::uint32_t member) const noexcept {
  for (std::uint32_t other = 0; other <= count_; ++other) {
    const std::uint8_t own = scenes_->kind(member, other == count_ ? kStanding : other);
    if (own != JointScenes::kNone) return box_of(scenes_->scene(own), 0, Vec3::Zero());
    if (other == count_) break;
    const std::uint8_t with = scenes_->kind(other, member);
    if (with != JointScenes::kNone) return box_of(scenes_->scene(with), 1, members_[member].grip_m);
  }
  return {Vec3::Zero(), Vec3::Constant(members_[member].radius_m)};
}

void AwakeSet::configure(const JointScenes& scenes, std::span<const BodyPairScene> slots,
                         std::span<const Member> members, Real tolerance_m) noexcept {
  scenes_ = &scenes;
  count_ = scenes.count();
  moving_ = scenes.moving_count();
  always_ = 0;
  while (always_ < count_ && !scenes.is_loose(always_)) ++always_;
  tolerance_m_ = tolerance_m;
  std::copy(members.begin(), members.end(), members_.begin());
  auto next = static_cast<std::uint16_t>(slots.size() - is_taken_.size());
  for (std::uint32_t k = 0; k < scenes.kind_count(); ++k) {
    first_slot_[k] = next;
    next = static_cast<std::uint16_t>(next + scenes.shared_slots(static_cast<std::uint8_t>(k)));
  }
  first_slot_[scenes.kind_count()] = next;
  for (std::uint32_t m = 0; m < count_; ++m) boxes_[m] = box_of(m);
}

void AwakeSet::begin(BodyLaw& law, std::span<const GripPose> poses) noexcept {
  for (std::size_t k = 0; k < is_taken_.size(); ++k)
    if (is_taken_[k] != 0) law.close_pair(first_slot_[0] + static_cast<std::uint32_t>(k));
  std::fill(is_taken_.begin(), is_taken_.end(), std::uint8_t{0});
  std::fill(slot_of_.begin(), slot_of_.end(), kNoSlot);
  for (std::uint32_t m = 0; m < count_; ++m) {
    member_at_[m] = static_cast<std::uint8_t>(m);
    rests_[m] = {poses[m], members_[m].sinks ? 0 : kRestTicks, !members_[m].sinks};
  }
  is_crowded_ = false;
  clear_m_.fill(kUnbounded);
}

std::uint16_t& AwakeSet::slot_of(std::uint32_t one, std::uint32_t other) noexcept {
  const std::uint32_t m = member_at_[one];
  const std::uint32_t n = other == kStanding ? m : member_at_[other];
  return slot_of_[std::size_t{std::min(m, n)} * count_ + std::max(m, n)];
}

/// The scene of two bodies; they are changed if it is B that moves in it.
std::uint8_t AwakeSet::kind_of(std::uint32_t& a, std::uint32_t& b) const noexcept {
  const std::uint32_t m = member_at_[a];
  if (b == kStanding) return scenes_->kind(m, kStanding);
  const std::uint8_t kind = scenes_->kind(m, member_at_[b]);
  if (kind != JointScenes::kNone) return kind;
  std::swap(a, b);
  return scenes_->kind(member_at_[a], m);
}

/// It moves, or may in this tick.
bool AwakeSet::is_lively(std::uint32_t body) const noexcept {
  return body < always_ || (moves(body) && rests_[member_at_[body]].ticks < kRestTicks);
}

Real AwakeSet::wake_m(std::uint32_t one, std::uint32_t other) const noexcept {
  const Real radius_m =
      std::min(members_[member_at_[one]].radius_m, members_[member_at_[other]].radius_m);
  return kWakeShare * radius_m + kWakeWays * ahead_m_ + 4 * tolerance_m_;
}

/// No two points of the bodies are nearer; below 0: they may be. Where it is more than `enough_m`
/// it need not be all of that.
Real AwakeSet::apart_m(const BodyLaw& law, std::uint32_t one, std::uint32_t other,
                       Real enough_m) const noexcept {
  const GripPose &a = law.pose(one), &b = law.pose(other);
  const std::uint32_t m = member_at_[one], n = member_at_[other];
  const Vec3 between_w = b.x0_w - a.x0_w;
  const Real of_balls =
      std::sqrt(between_w.squaredNorm()) - members_[m].radius_m - members_[n].radius_m;
  if (of_balls > enough_m) return of_balls;
  const auto of_box = [](const Box& box, const Vec3& point_m, Real radius_m) {
    return distance_m(point_m, box.middle_m, box.half_m) - radius_m;
  };
  const Real of_a = of_box(boxes_[m], a.r_wa.transpose() * between_w, members_[n].radius_m);
  const Real of_b = of_box(boxes_[n], -(b.r_wa.transpose() * between_w), members_[m].radius_m);
  const Real of_box_and_ball = std::max(of_a, of_b);
  if (of_box_and_ball > enough_m) return of_box_and_ball;
  // Two boxes, along the axes of both.
  const Vec3 middle_w = between_w + b.r_wa * boxes_[n].middle_m - a.r_wa * boxes_[m].middle_m;
  const Mat3 turn = a.r_wa.transpose() * b.r_wa;
  const Mat3 size = turn.cwiseAbs();
  const Vec3 on_a =
      (a.r_wa.transpose() * middle_w).cwiseAbs() - boxes_[m].half_m - size * boxes_[n].half_m;
  const Vec3 on_b = (b.r_wa.transpose() * middle_w).cwiseAbs() - boxes_[n].half_m -
                    size.transpose() * boxes_[m].half_m;
  return std::max({of_box_and_ball, on_a.maxCoeff(), on_b.maxCoeff()});
}

/// The same, as far as their pair knows it.
Real AwakeSet::gap_m(const BodyLaw& law, std::uint32_t one, std::uint32_t other,
                     Real enough_m) noexcept {
  const std::uint16_t slot = slot_of(one, other);
  const Real known = slot == kNoSlot ? -kUnbounded : law.slot(slot).gap_m();
  return known > enough_m ? known : std::max(known, apart_m(law, one, other, enough_m));
}

bool AwakeSet::open(BodyLaw& law, std::uint32_t one, std::uint32_t other) noexcept {
  const bool is_always = one < always_ || (other != kStanding && other < always_);
  if (!is_always && law.pairs().size() >= kMostLoosePairs) return false;
  std::uint16_t& of = slot_of(one, other);
  std::uint32_t a = one, b = other;
  const std::uint8_t kind = kind_of(a, b);
  for (std::uint16_t slot = first_slot_[kind]; slot < first_slot_[kind + 1u]; ++slot) {
    std::uint8_t& is_taken = is_taken_[static_cast<std::size_t>(slot - first_slot_[0])];
    if (is_taken != 0) continue;
    if (!law.open_pair(slot, a, b)) return false;
    opened_ += 1;
    is_taken = 1;
    of = slot;
    return true;
  }
  return false;
}

void AwakeSet::close(BodyLaw& law, std::uint32_t one, std::uint32_t other) noexcept {
  std::uint16_t& of = slot_of(one, other);
  if (of == kNoSlot) return;
  law.close_pair(of);
  is_taken_[static_cast<std::size_t>(of - first_slot_[0])] = 0;
  of = kNoSlot;
}

void AwakeSet::follow_rest(const BodyLaw& law) noexcept {
  for (std::uint32_t body = always_; body < moving_; ++body) {
    const std::uint32_t m = member_at_[body];
    Rest& rest = rests_[m];
    const PoseError way = pose_error(law.pose(body), rest.from);
    const Real far_m = std::sqrt(way.translation_m.squaredNorm()) +
                       members_[m].radius_m * std::sqrt(way.rotation_rad.squaredNorm());
    // One that may not move says nothing by not moving.
    const bool is_free = clear_m_[body] > 0;
    if (far_m > tolerance_m_ || !is_free) {
      rest = {law.pose(body), 0, !members_[m].sinks};
    } else if (rest.ticks < kRestTicks) {
      rest.ticks += 1;
      if (rest.ticks == kRestTicks) rest.has_settled = true;
    }
  }
}

/// Which bodies a moving one may meet, and what room it has to those that are not asked about.
void AwakeSet::follow_near(BodyLaw& law, std::uint32_t body) noexcept {
  const std::uint32_t m = member_at_[body];
  if (body >= always_ && slot_of(body, kStanding) == kNoSlot &&
      scenes_->kind(m, kStanding) != JointScenes::kNone && !open(law, body, kStanding)) {
    clear_m_[body] = 0;
  }
  for (std::uint32_t other = 0; other < count_; ++other) {
    if (other == body || (body < always_ && other < always_)) continue;
    std::uint32_t a = body, b = other;
    if (kind_of(a, b) == JointScenes::kNone) continue;
    const std::uint32_t n = member_at_[other];
    const Real near_m =
        kNearShare * std::min(members_[m].radius_m, members_[n].radius_m) + kNearWays * ahead_m_;
    const Real apart = apart_m(law, body, other, 2 * near_m);
    const std::uint16_t slot = slot_of(body, other);
    if (slot != kNoSlot) {
      if (apart <= 2 * near_m || law.slot(slot).felt().plane_count > 0) continue;
      close(law, body, other);
    } else if (apart < near_m) {
      const bool has_time = opened_ < kMostOpened;
      if (has_time && open(law, body, other)) continue;
      is_crowded_ = is_crowded_ || has_time;
    }
    const Real room_m = std::max(apart, Real{0});
    clear_m_[body] = std::min(clear_m_[body], room_m);
    if (moves(other)) clear_m_[other] = std::min(clear_m_[other], room_m);
  }
}

/// The body that rests and is nearest to one that moves; else the first that has not come to rest.
AwakeSet::Candidate AwakeSet::candidate(const BodyLaw& law) noexcept {
  Candidate best;
  for (std::uint32_t body = 0; body < moving_; ++body) {
    if (!is_lively(body)) continue;
    for (std::uint32_t other = moving_; other < count_; ++other) {
      if (slot_of(body, other) == kNoSlot) continue;
      const Real wake = wake_m(body, other);
      const Real gap = gap_m(law, body, other, wake);
      if (!(gap < wake)) continue;
      // Others may take its place now, and what held it go away.
      Rest& rest = rests_[member_at_[other]];
      rest.has_settled = rest.has_settled && !members_[member_at_[other]].sinks;
      if (best.body == kStanding || gap < best.gap_m) best = {other, body, gap};
    }
  }
  for (std::uint32_t other = moving_; other < count_ && best.body == kStanding; ++other)
    if (!rests_[member_at_[other]].has_settled) best.body = other;
  return best;
}

/// The moving body that is to rest for it: the one that is farthest from all that moves.
std::uint32_t AwakeSet::place_for(const BodyLaw& law, const Candidate& candidate) noexcept {
  std::uint32_t found = kStanding;
  Real farthest_m = 0;
  for (std::uint32_t body = always_; body < moving_; ++body) {
    if (body == candidate.near) continue;
    Real far_m = kUnbounded;
    bool may_rest = candidate.near != kStanding || !is_lively(body);
    for (std::uint32_t other = 0; other < moving_; ++other) {
      if (other == body || !is_lively(other) || slot_of(body, other) == kNoSlot) continue;
      const Real gap = gap_m(law, body, other, kUnbounded);
      far_m = std::min(far_m, gap);
      may_rest = may_rest && gap > candidate.gap_m + wake_m(body, other);
    }
    if (!may_rest || (found != kStanding && far_m <= farthest_m)) continue;
    found = body;
    farthest_m = far_m;
  }
  return found;
}

void AwakeSet::exchange(BodyLaw& law, std::uint32_t moving, std::uint32_t resting) noexcept {
  close(law, moving, kStanding);
  for (std::uint32_t other = moving_; other < count_; ++other)
    if (other != resting) close(law, moving, other);
  // One of the two moves, before and after.
  law.exchange(moving, resting);
  std::swap(member_at_[moving], member_at_[resting]);
  rests_[member_at_[moving]] = {law.pose(moving), 0, rests_[member_at_[moving]].has_settled};
}

void AwakeSet::choose(BodyLaw& law, Real ahead_m) noexcept {
  ahead_m_ = ahead_m;
  is_crowded_ = false;
  opened_ = 0;
  follow_rest(law);
  clear_m_.fill(kUnbounded);
  for (std::uint32_t k = 0; k < kMostExchanges; ++k) {
    const Candidate next = candidate(law);
    if (next.body == kStanding) break;
    const std::uint32_t place = place_for(law, next);
    is_crowded_ = is_crowded_ || (place == kStanding && next.near != kStanding);
    if (place == kStanding) break;
    exchange(law, place, next.body);
  }
  for (std::uint32_t body = 0; body < moving_; ++body) follow_near(law, body);
  for (std::uint32_t body = 0; body < moving_; ++body)
    law.limit_way(body, clear_m_[body] < kUnbounded ? kWayShare * clear_m_[body] : kUnbounded);
}

}  // namespace haptic
