// SPDX-License-Identifier: Apache-2.0
// Coulomb friction of the proxy: the cone of every contact point by cutting planes, and which pairs
// stick.
//
// A point that moves by dp, by dp_t along the plane, keeps n.dp - mu |dp_t| >= -gap (Anitescu,
// Mathematical Programming 105, 2006): the forces of these half spaces, one for each direction t
// along the plane, are those of the cone of friction, and the force of a point that slides is
// against its slip. The program starts with five of the half spaces. Where its solution violates
// the cone of a point, that of the point's own slip is added and the program solved again. The cone
// is convex: the solution, the point of it that is closest to the origin, moves no farther than the
// goal does, so that tremor gives no more force than the spring makes of it.
//
// Such a cone lifts a point that slides by mu |dp_t|. Between two walls there is no room for that:
// so the cones are shifted by what the points slide (proxy_shift.cpp).
#include <algorithm>
#include <cmath>
#include <utility>

#include "rt_core/base/plane_point.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {
namespace {

/// Share of mu |dp_t| by which the rows may leave out a cone: 1 - cos of the angle between a slip
/// and the nearest half space, 0.045 rad.
constexpr Real kConeShare = 1.0e-3_r;
/// And no more than this share of the tolerance, which the point sinks by.
constexpr Real kLeftOut = 0.125_r;
/// Cosine of the angle below which planes count as parallel, 0.0014 rad.
constexpr Real kParallel = 1 - 1.0e-6_r;
/// Cosine and sine of the angle between a direction and those at its sides, 0.2 rad.
constexpr Real kAlong = 0.9800665778412416_r, kAside = 0.1986693307950612_r;
/// Cones of one program beyond these do without those, so that the rows suffice for planes at a
/// step.
constexpr std::uint32_t kFewCones = 8;
/// A pull at a point below this share of the region's height has no direction.
constexpr Real kLeastPull = 1.0e-3_r;
/// A way or slip of so many lengths of a move that ends the tick has a direction.
constexpr Real kOwnWay = 4;
/// Cosine of the angle below which two directions are one, 0.014 rad.
constexpr Real kOneDirection = 1 - 1.0e-4_r;
/// Slip of a tick that counts, over the length of a move that ends the tick.
constexpr Real kSlipShare = 4;

}  // namespace

void Proxy::begin_cones() noexcept {
  // A climb that is tried again goes on from the pass before it.
  if (climb_.leg <= 1) std::swap(program_.cones, slip_.last_cones);
  program_.cones.clear();
  program_.cone_programs = program_.shift_programs = 0;
  program_.has_wish = false;
  slip_.wedged =
      std::any_of(slip_.last_cones.begin(), slip_.last_cones.end(), [&](const FrictionCone& cone) {
        return cone.normal_w.dot(slip_.last_cones[0].normal_w) < kParallel;
      });
}

/// The cone of a contact point with five of its half spaces, one against its slip or pull, and that
/// of the last cut.
bool Proxy::add_cone(std::uint32_t imposed, const RowArm& arm, const Vec3& normal_w, Real least_m,
                     const PoseError& error) noexcept {
  FrictionCone cone;
  cone.pair = program_.imposed[imposed].pair;
  const ProxyPair& pair = near_.pairs[cone.pair];
  cone.arm = arm;
  cone.normal_w = normal_w;
  cone.least_m = least_m;
  cone.friction = pair.slips ? pair.friction : std::max(pair.friction, pair.friction_static);
  cone.imposed = static_cast<std::uint8_t>(imposed);
  for (const FrictionCone& other : program_.cones) {
    if (other.pair == cone.pair) cone.number = static_cast<std::uint8_t>(other.number + 1);
  }
  Vec3 kept = Vec3::Zero();
  for (const FrictionCone& last : slip_.last_cones) {
    if (last.pair != cone.pair || last.number != cone.number) continue;
    kept = last.direction_w - normal_w * normal_w.dot(last.direction_w);
    break;
  }
  // A point that slid goes on as it did, and one that comes to the others as they do.
  // What has stopped with the goal begins at rest: where both agree with the pull it stays.
  if (program_.has_wish) {
    cone.shift_m = wanted_shift_m(cone, program_.wish);
  } else if (is_first_pass() && rest_.held == 0 && pair.slips && !hardly_slides(cone, slip_.came)) {
    cone.shift_m = wanted_shift_m(cone, slip_.came);
  }
  // Against the slip of the last tick or the pull. On planes that are not parallel the pull at a
  // point is mostly into the others: there against the way that the goal has come and the part has
  // not. Of a point with hardly any pull the last direction stays: tremor gives it none.
  const auto is_way = [&](const Vec3& way) {
    return way.squaredNorm() >
           kOwnWay * kOwnWay * parameters_.scale.last_m * parameters_.scale.last_m;
  };
  Vec3 pull = slip_of(cone, slip_.came);
  if (slip_.wedged && !is_way(pull)) pull = slip_of(cone, slip_.way);
  if (!is_way(pull)) pull = slip_of(cone, error);
  Vec3 t = -pull;
  if (pull.squaredNorm() <
      kLeastPull * kLeastPull * parameters_.scale.manifold_m * parameters_.scale.manifold_m) {
    t = kept;
  }
  const Real length = std::sqrt(t.squaredNorm());
  t = length > parameters_.scale.still_m ? Vec3(t / length) : plane_basis(normal_w).e1;
  cone.direction_w = t;
  if (!program_.cones.push(cone)) return false;
  if (kept.squaredNorm() > 0.5_r) {
    program_.cones[program_.cones.size() - 1].direction_w = kept;
    if (kept.dot(t) < kOneDirection && !push_cone_row(program_.cones.size() - 1, kept, error))
      return false;
  }
  const Vec3 b = normal_w.cross(t);
  const Vec3 aside = kAside * b;
  const Vec3 across = 0.8660254037844386_r * b;
  for (const Vec3& side : {t, Vec3(across - t / 2), Vec3(-across - t / 2)}) {
    if (!push_cone_row(program_.cones.size() - 1, side, error)) return false;
  }
  if (program_.cones.size() > kFewCones) return true;
  return push_cone_row(program_.cones.size() - 1, kAlong * t + aside, error) &&
         push_cone_row(program_.cones.size() - 1, kAlong * t - aside, error);
}

/// What a motion of the part moves a point by along its plane.
[[gnu::noinline]] Vec3 Proxy::slip_of(const FrictionCone& cone,
                                      const PoseError& motion) const noexcept {
  const Vec3 dp = is_locked()
                      ? motion.translation_m
                      : Vec3(motion.translation_m + motion.rotation_rad.cross(cone.arm.app_w));
  return dp - cone.normal_w * cone.normal_w.dot(dp);
}

/// And out of it.
Real Proxy::rise_of(const FrictionCone& cone, const PoseError& motion) const noexcept {
  const Real rise_m = cone.normal_w.dot(motion.translation_m);
  return is_locked() ? rise_m : rise_m + turned_m(cone.arm, cone.normal_w, motion.rotation_rad);
}

/// Adds half spaces where the solution violates a cone.
///
/// The force of a cone is against its slip, so both have one direction, which f - slip has as well,
/// with the force f of the rows so far as a length. Where a point hardly slides its slip alone says
/// little: an error of f's direction comes back in it times the ratio of pull and slip.
Proxy::Cut Proxy::cut_once(const PoseError& error, Real tolerance_m) noexcept {
  const PoseError motion = asked(program_.found.z, error);
  const auto against = [&](std::uint32_t k, const Vec3& slip) {
    Vec3 t = -slip;
    for (std::uint32_t i = 0; i < program_.found.active_count; ++i) {
      const std::uint32_t row = program_.found.active[i];
      if (program_.row_cone[row] != k) continue;
      t += program_.found.multiplier[i] *
           (Vec3(program_.rows[row].g.head<3>()) - program_.cones[k].normal_w);
    }
    return t;
  };
  Cut cut = Cut::kNone;
  for (std::uint32_t k = 0; k < program_.cones.size(); ++k) {
    FrictionCone& cone = program_.cones[k];
    const Vec3 slip = slip_of(cone, motion);
    const Real length = std::sqrt(slip.squaredNorm());
    const Real some_m =
        std::min(kConeShare * cone.friction * length, kLeftOut * parameters_.scale.tolerance_m);
    const Real leave = std::max(some_m, tolerance_m);
    const Real room = rise_of(cone, motion) - cone.least_m + cone.friction * cone.shift_m;
    if (!(cone.friction * length - room > leave)) continue;
    Vec3 t = against(k, slip);
    const Real size = std::sqrt(t.squaredNorm());
    t /= size;
    if (!(cone.friction * -t.dot(slip) - room > leave)) t = -slip / length;
    if (!push_cone_row(k, t, error)) return Cut::kNoRoom;
    cone.direction_w = t;
    cut = Cut::kSome;
  }
  return cut;
}

/// The same until it keeps all of them.
void Proxy::cut_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept {
  if (!kSceneTraits.friction || program_.cones.empty()) return;
  for (; program_.cone_programs < kMaxConePrograms; ++program_.cone_programs) {
    if (cut_once(error, tolerance_m) != Cut::kSome) return;
    if (!has_budget(tick) && program_.cone_programs >= kGrantedConePrograms) {
      tick.limited = true;
      return;
    }
    const QpResult last = program_.found;
    program_.found = solve_rows(tolerance_m, tick, std::span(last.active).first(last.active_count));
  }
}

/// The half space of one direction along the plane.
bool Proxy::push_cone_row(std::uint32_t at, const Vec3& direction_w,
                          const PoseError& error) noexcept {
  const FrictionCone& cone = program_.cones[at];
  const Vec3 w = cone.normal_w + cone.friction * direction_w;
  const Real least_m = cone.least_m - cone.friction * cone.shift_m;
  if (!push_row(cone.imposed, cone.arm, w, least_m, error, kMaxQpRows)) {
    return false;
  }
  program_.row_cone[program_.rows.size() - 1] = static_cast<std::uint8_t>(at);
  return true;
}

/// Where rows run out: of the first so many rows and cones those stay that hold the last program,
/// or hardly leave room. A point that comes back is imposed again. False: all of them do.
bool Proxy::make_room(std::uint32_t rows, std::uint32_t cones, const PoseError& error) noexcept {
  if (!has_friction()) return false;
  constexpr std::uint8_t kDropped = UINT8_MAX;
  const PoseError motion = asked(program_.found.z, error);
  std::array<std::uint8_t, kMaxFrictionCones> cone_now;
  std::uint32_t kept = 0;
  for (std::uint32_t c = 0; c < cones; ++c) {
    bool stays = !(rise_of(program_.cones[c], motion) - program_.cones[c].least_m >
                   parameters_.scale.tolerance_m);
    for (std::uint32_t k = 0; k < program_.found.active_count && !stays; ++k) {
      stays = program_.row_cone[program_.found.active[k]] == c;
    }
    cone_now[c] = stays ? static_cast<std::uint8_t>(kept) : kDropped;
    if (stays) program_.cones[kept++] = program_.cones[c];
  }
  if (kept == cones) return false;
  program_.cones.truncate(kept);
  std::uint32_t to = 0;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint8_t cone = program_.row_cone[row];
    const bool is_of_cone = cone < kMaxFrictionCones;
    if (is_of_cone && cone_now[cone] == kDropped) continue;
    for (std::uint32_t k = 0; k < program_.found.active_count; ++k) {
      if (program_.found.active[k] == row) program_.found.active[k] = static_cast<std::uint8_t>(to);
    }
    program_.rows[to] = program_.rows[row];
    program_.row_plane[to] = program_.row_plane[row];
    program_.row_cone[to] = is_of_cone ? cone_now[cone] : cone;
    ++to;
  }
  program_.rows.truncate(to);
  return true;
}

/// Pairs that a step lets slide do so from the next pass on.
void Proxy::note_slip(const Step& step) noexcept {
  const Real least = kSlipShare * parameters_.scale.still_m;
  for (FrictionCone& cone : program_.cones) {
    const Vec3 slip = slip_of(cone, {step.dx_m, step.dtheta_rad});
    const Real length = std::sqrt(slip.squaredNorm());
    if (length <= least) continue;
    near_.pairs[cone.pair].slips = true;
    near_.pairs[cone.pair].quiet_ticks = 0;
  }
}

/// True if planes with friction hold the part: it rests where they were when it came, not where
/// others would let it go.
bool Proxy::sticks() const noexcept {
  if (!has_friction()) return false;
  for (const ImposedPlane& plane : kept_.active) {
    if (rubs(near_.pairs[plane.pair])) return true;
  }
  return false;
}

/// The same of the last program.
bool Proxy::rests_on_friction() const noexcept {
  if (program_.cones.empty()) return false;
  for (std::uint32_t i = 0; i < program_.found.active_count; ++i) {
    if (program_.row_cone[program_.found.active[i]] < program_.cones.size()) return true;
  }
  return false;
}

/// At the end of a tick: pairs that have long been still stick.
void Proxy::settle_slip() noexcept {
  if (program_.cones.capacity() == 0) return;
  for (ProxyPair& pair : near_.pairs) {
    if (!pair.slips) continue;
    pair.quiet_ticks += 1;
    pair.slips = pair.quiet_ticks <= kStickTicks;
  }
}

}  // namespace haptic
