// SPDX-License-Identifier: Apache-2.0
// How the proxy comes over steps that are lower than any that is made on purpose: where faces of
// parts do not meet to rounding.
//
// A face of height h in the way of a part that is pressed by F is a barrier of energy F h between
// two free regions that join over it, and passes that only descend do not see over it. A climb is a
// step of two legs: straight out by what the part is below the faces beyond, h or less, and from
// there on by a pass. Both legs are certified like any other step and the energy at the end is
// lower than at the start, so p is as free as ever and the energy of a tick still falls. The pull
// along the surface has to store what the first leg takes: sqrt(2 k F h) at the most, then p is
// over.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Planes whose normals have a cosine below this are not one plane. What one plane holds is pressed
/// on it; a step holds what is pressed on something else too.
constexpr Real kOtherPlane = 0.9_r;
/// A climb that led nowhere is not tried again within so many heights, nor before this share of
/// what it lacked has come in; where it lacked something else, this share of the energy.
constexpr Real kFarClimbs = 100;
constexpr Real kMoreShare = 0.5_r, kMoreOfAll = 0.01_r;
/// Rises of one climb: a step behind another, or beside it.
constexpr std::uint32_t kMostRises = 3;
/// Faces that p is below by no more than so many heights are looked at: where none of them is a low
/// one, none can be before p has gone by what the nearest lacks.
constexpr Real kRoomHeights = 16;
/// A rise is no longer than so many heights: out of two faces at once.
constexpr Real kMostHeights = 2;

/// Keeps a pair among the last ones.
void note(std::uint32_t pair, std::array<std::uint32_t, kMaxFeltPlanes>& pairs,
          std::uint32_t& count) noexcept {
  const auto end = pairs.begin() + count;
  if (std::find(pairs.begin(), end, pair) != end) return;
  if (count == pairs.size()) {
    std::copy(pairs.begin() + 1, pairs.end(), pairs.begin());
    count -= 1;
  }
  pairs[count++] = pair;
}

}  // namespace

/// The first leg of a climb.
struct Proxy::Rise {
  Vec3 way_m = Vec3::Zero();
  Real gain_j = 0;  ///< about what the energy falls by without the planes that hold p there
  Real room_m = 0;  ///< no motion below this makes a low face of one that is none
  /// Pairs whose faces p rises over: their planes do not hold it beyond.
  std::array<std::uint32_t, kMaxImposedPlanes> pairs{};
  std::uint32_t pair_count = 0;
};

/// What a climb that leads nowhere puts back. The order of the active planes is kept.
struct Proxy::ClimbStart {
  GripPose p;
  PoseError way;
  Real way_left_m = 0, turn_left_rad = 0;
  bool may_close = false, moved_little = false, limited = false;
  Real residual_n = 0;
  std::uint32_t active_count = 0;
  std::array<ImposedPlane, kMaxFeltPlanes> active;
  std::array<Real, kMostLeftOut> left_out_m{};
  double back_m = 0;  ///< how far p has gone since
};

Proxy::ClimbStart Proxy::climb_start(const ProxyTick& tick) const noexcept {
  ClimbStart start;
  start.p = part_.pose;
  start.way = slip_.way;
  start.way_left_m = move_.way_left_m;
  start.turn_left_rad = move_.turn_left_rad;
  start.may_close = move_.may_close;
  start.moved_little = move_.moved_little;
  start.limited = tick.limited;
  start.residual_n = tick.residual_n;
  start.active_count = kept_.active.size();
  std::copy(kept_.active.begin(), kept_.active.end(), start.active.begin());
  for (std::uint32_t k = 0; k < near_.list.left_out().size(); ++k) {
    start.left_out_m[k] = near_.list.left_out()[k].gap_m;
  }
  return start;
}

PlaneGap Proxy::gap_at_p(const ImposedPlane& plane, ProxyTick& tick) const noexcept {
  const ProxyPair& pair = near_.pairs[plane.pair];
  tick.work.plane_gaps += 1;
  return plane_gap(pair_at(pair, part_.pose), plane.id, plane.support);
}

/// True if the planes that hold p may be a low step, and no climb here has just led nowhere over
/// the same pairs.
bool Proxy::may_climb(ProxyTick& tick) noexcept {
  const Real climb_m = parameters_.scale.climb_m;
  if (!(climb_m > 0) || pass_.inside || kept_.active.size() < 2 || !has_budget(tick)) return false;
  const auto normal_of = [&](const ImposedPlane& plane) {
    ProxyPair& pair = near_.pairs[plane.pair];
    need_view(pair, tick);
    return plane_normal(pair_at(pair, part_.pose), plane.id);
  };
  const Vec3 first_w = normal_of(kept_.active[0]);
  bool cornered = false;
  for (std::uint32_t k = 1; k < kept_.active.size() && !cornered; ++k)
    cornered = normal_of(kept_.active[k]).dot(first_w) < kOtherPlane;
  if (!cornered) return false;
  const auto is_known = [&](const ImposedPlane& plane) {
    const auto end = climb_.pairs.begin() + climb_.pair_count;
    return std::find(climb_.pairs.begin(), end, plane.pair) != end;
  };
  return !std::all_of(kept_.active.begin(), kept_.active.end(), is_known);
}

/// Of the pair of an imposed plane, the face that p is least below, of those that it is below by no
/// more than the height of a climb: the plane itself or one that looks elsewhere. `room_m` becomes
/// no more than what the next one is too deep by.
bool Proxy::find_low_face(const ImposedPlane& imposed, const Vec3& normal_w, ValidPlane& low,
                          Real& room_m, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  const Real deepest_m = kRoomHeights * scale.climb_m;
  ProxyPair& pair = near_.pairs[imposed.pair];
  std::array<ValidPlane, kMaxValidPlanes> planes;
  const ValidResult found = find_valid_planes(pose_of(pair), pair.plane, pair.support, -deepest_m,
                                              scratch_.valid, planes);
  tick.work.valid_nodes += found.visited;
  if (found.cut) room_m = 0;
  bool any = false;
  for (std::uint32_t k = 0; k < found.count; ++k) {
    const ValidPlane& plane = planes[k];
    if (!(plane.gap_m < -scale.tolerance_m / 2) || (any && !(plane.gap_m > low.gap_m))) continue;
    if (!(plane.id == imposed.id)) {
      tick.work.plane_gaps += 1;
      if (plane_normal(pair_at(pair, part_.pose), plane.id).dot(normal_w) > kOtherPlane) continue;
    }
    const Real too_deep_m = -plane.gap_m - scale.climb_m;
    if (k < found.exposed && !(too_deep_m > 0)) {
      low = plane;
      any = true;
    } else {  // its features may come to meet
      room_m = std::min(room_m, std::max(too_deep_m, Real{0}));
    }
  }
  return any;
}

/// The shortest way straight out over the faces that p is below by no more than a low step, of the
/// pairs that the last pass imposed planes of, and along the others; false: there is none.
bool Proxy::find_rise(Rise& rise, ProxyTick& tick) noexcept {
  const ProxyScale& scale = parameters_.scale;
  // What the rows of the last program hold back, by pair.
  std::array<QpVector, kQpSize> pull;
  std::array<std::uint32_t, kQpSize> pull_pair{};
  std::uint32_t pulls = 0;
  for (std::uint32_t k = 0; k < program_.found.active_count; ++k) {
    const std::uint32_t row = program_.found.active[k];
    if (row >= program_.rows.size() || program_.row_plane[row] >= program_.imposed.size()) continue;
    pull[pulls] = program_.found.multiplier[k] * program_.rows[row].g;
    pull_pair[pulls++] = program_.imposed[program_.row_plane[row]].pair;
  }
  QpVector held_back = QpVector::Zero();
  Real room_m = (kRoomHeights - 1) * scale.climb_m;
  rise.pair_count = 0;
  program_.rows.clear();
  const auto push = [&](const Vec3& normal_w, Real gap_m) {
    QpRow row;
    row.g.head<3>() = normal_w;
    row.h = std::max(-gap_m, Real{0});
    return program_.rows.push(row);
  };
  for (std::uint32_t at = 0; at < program_.imposed.size(); ++at) {
    const ImposedPlane& imposed = program_.imposed[at];
    const PlaneGap held = gap_at_p(imposed, tick);
    if (!held.defined) continue;
    const bool is_above = !(held.gap_m < -scale.tolerance_m / 2);
    if (is_above && held.gap_m < scale.climb_m && !push(held.normal_w, held.gap_m)) return false;
    const auto is_same = [&](const ImposedPlane& other) { return other.pair == imposed.pair; };
    if (std::any_of(program_.imposed.begin(), program_.imposed.begin() + at, is_same)) continue;
    if (!has_budget(tick)) return false;
    ValidPlane low;
    if (!find_low_face(imposed, held.normal_w, low, room_m, tick)) continue;
    const ImposedPlane face{imposed.pair, low.id, low.support};
    if (!push(gap_at_p(face, tick).normal_w, low.gap_m)) return false;
    for (std::uint32_t k = 0; k < pulls; ++k) {
      if (pull_pair[k] == imposed.pair) held_back += pull[k];
    }
    rise.pairs[rise.pair_count++] = imposed.pair;
  }
  if (rise.pair_count == 0) {
    rise.room_m = room_m;
    return false;
  }
  rise.gain_j = program_.secant.k_t_n_per_m / 2 * held_back.squaredNorm();
  rise.way_m = solve_rows(1.0e-4_r * scale.tolerance_m, tick).z.head<3>();
  const Real most_m = kMostHeights * scale.climb_m;
  return rise.way_m.squaredNorm() <= most_m * most_m;
}

/// True if the part rubs on planes that look elsewhere than each other, beside those that it would
/// rise over: in a thread a rise would let go of what holds it.
bool Proxy::is_wedged_beside(const Rise& rise) const noexcept {
  const FrictionCone* first = nullptr;
  const auto end = rise.pairs.begin() + rise.pair_count;
  for (const FrictionCone& cone : program_.cones) {
    if (std::find(rise.pairs.begin(), end, cone.pair) != end) continue;
    if (first == nullptr) first = &cone;
    if (cone.normal_w.dot(first->normal_w) < kOtherPlane) return true;
  }
  return false;
}

/// p as it was, which is as free as it was.
void Proxy::step_back(const ClimbStart& start, ProxyTick& tick) noexcept {
  if (start.back_m > 0) {
    part_.pose = start.p;
    part_.version += 1;
    part_.path_m = (part_.path_m + start.back_m * kOdometerUp) * (1 + 0x1p-52);
    if (has_screen())
      near_.screen->accept(part_.pose, static_cast<Real>(start.back_m) * (1 + kRealEpsilon), 0);
    slip_.way = start.way;
    move_.way_left_m = start.way_left_m;
    move_.turn_left_rad = start.turn_left_rad;
    move_.may_close = start.may_close;
    move_.moved_little = start.moved_little;
    tick.limited = start.limited;
    tick.residual_n = start.residual_n;
    std::swap(program_.cones, slip_.last_cones);
    for (std::uint32_t k = 0; k < near_.list.left_out().size(); ++k) {
      near_.list.left_out()[k].gap_m = start.left_out_m[k];
    }
    kept_.active.clear();
    for (std::uint32_t k = 0; k < start.active_count; ++k) {
      static_cast<void>(kept_.active.push(start.active[k]));
    }
    kept_.pending.clear();
  }
  // What the check of a step that was not made has left, and what a way there and back makes of the
  // bounds, is no gap of p.
  for (ReachedPair& reached : pass_.reached) {
    ProxyPair& pair = near_.pairs[reached.pair];
    reached.gap_m = pair.gap_version == part_.version ? pair.gap_m : clear_m(pair);
    if (!(reached.gap_m > parameters_.scale.tolerance_m) && pair.gap_version != part_.version) {
      reached.unsure = !measure(pair, tick);
      if (!reached.unsure) reached.gap_m = pair.gap_m;
    }
    reached.gap_q_m = reached.gap_m;
  }
}

/// Where a low step holds the part: up first, then on. True: p has moved.
bool Proxy::climb(const GripPose& goal, ProxyTick& tick) noexcept {
  const Real far_m = kFarClimbs * parameters_.scale.climb_m;
  const bool is_far = (part_.pose.x0_w - climb_.x0_w).squaredNorm() >= far_m * far_m;
  const bool is_pulled_more = tick.end_potential_j > climb_.v_j + climb_.lacks_j;
  if (is_far || (is_pulled_more && odometer_m() >= climb_.no_low_until_m)) climb_.pair_count = 0;
  if (!may_climb(tick)) return false;
  if (climb_.pair_count == 0) {
    climb_.x0_w = part_.pose.x0_w;
    climb_.v_j = tick.end_potential_j;
    climb_.lacks_j = kMoreOfAll * climb_.v_j;
    climb_.no_low_until_m = std::numeric_limits<double>::max();
  }
  for (const ImposedPlane& plane : kept_.active) note(plane.pair, climb_.pairs, climb_.pair_count);
  ClimbStart start = climb_start(tick);
  const PoseError came = slip_.came;
  const bool was_spent = move_.spent;
  bool over = false;
  for (std::uint32_t k = 1; k <= kMostRises && !over; ++k) {
    Rise rise;
    const bool found = find_rise(rise, tick);
    climb_.no_low_until_m =
        std::min(climb_.no_low_until_m, odometer_m() + static_cast<double>(rise.room_m));
    if (!found || is_wedged_beside(rise)) break;
    const Step up = step_by(rise.way_m, Vec3::Zero());
    const Real up_j = potential_j(parameters_.spring, error_of(goal, up.q));
    const Real lacks_j = std::max(up_j - tick.end_potential_j, Real{0});
    if (k == 1 && rise.gain_j < lacks_j) {  // not yet
      climb_.lacks_j = std::min(climb_.lacks_j, kMoreShare * lacks_j);
      break;
    }
    // The pairs that the last pass has reached are known where it began, not where it has gone.
    if (found_.sets_version != part_.version) gather(error_of(goal, part_.pose), tick);
    if (pass_.inside || !check(up, -parameters_.scale.tolerance_m / 2, tick).ok) break;
    start.back_m += static_cast<double>(std::sqrt(up.dx_m.squaredNorm()));
    accept(up);
    // What p is pressed on beside holds it up here too.
    std::uint32_t kept = 0;
    for (const ImposedPlane& plane : kept_.active) {
      const auto end = rise.pairs.begin() + rise.pair_count;
      if (std::find(rise.pairs.begin(), end, plane.pair) == end) kept_.active[kept++] = plane;
    }
    kept_.active.truncate(kept);
    rest_.choose_from_start = false;
    climb_.leg = k;
    // Its limit is the energy at the start, not that up here.
    over = pass(goal, tick) == PassEnd::kMoved;
    climb_.leg = 0;
    if (move_.spent) break;
  }
  if (over) {
    move_.spent = was_spent;
    tick.work.passes += 1;
    climb_.pair_count = 0;
  } else {
    step_back(start, tick);
  }
  slip_.came = came;
  return over;
}

}  // namespace haptic
