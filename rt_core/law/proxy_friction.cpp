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
// A cone lifts a point that slides by mu |dp_t|, and the next pass lets it down again. Where the
// planes are not parallel, as in a thread, it slides down them then, and its friction would be
// against that alone. There slip is that of the whole tick: with the slip s of its earlier passes
// a cone is n.dp - mu (|s + dp_t| - |s|) >= -gap.
#include <algorithm>
#include <cmath>
#include <utility>

#include "rt_core/base/plane_point.hpp"
#include "rt_core/law/proxy_step.hpp"

namespace haptic {
namespace {

/// Share of mu |dp_t| by which the rows may leave out a cone: 1 - cos of the angle between a slip
/// and the nearest half space, 0.014 rad.
constexpr Real kConeShare = 1.0e-3_r;
/// The same as a share of the whole pull, for a pair that has slid in this tick: what later passes
/// let it slide is the rest of what the first one lifted it by, and short.
constexpr Real kForceShare = 1.0e-4_r;
/// Cosine of the angle below which planes count as parallel, 0.0014 rad.
constexpr Real kParallel = 1 - 1.0e-6_r;
/// Cosine and sine of the angle between a direction and those at its sides, 0.2 rad.
constexpr Real kAlong = 0.9800665778412416_r, kAside = 0.1986693307950612_r;
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
  if (climbing_ <= 1) std::swap(cones_, last_cones_);
  cones_.clear();
  cone_programs_ = 0;
  wedged_ = std::any_of(last_cones_.begin(), last_cones_.end(), [&](const FrictionCone& cone) {
    return cone.normal_w.dot(last_cones_[0].normal_w) < kParallel;
  });
}

/// The cone of a contact point with five of its half spaces, one against its slip or pull, and that
/// of the last cut.
bool Proxy::add_cone(std::uint32_t imposed, const RowArm& arm, const Vec3& normal_w, Real least_m,
                     const PoseError& error) noexcept {
  FrictionCone cone;
  cone.pair = imposed_[imposed].pair;
  const ProxyPair& pair = pairs_[cone.pair];
  cone.arm = arm;
  cone.normal_w = normal_w;
  cone.least_m = least_m;
  cone.friction = pair.slips ? pair.friction : std::max(pair.friction, pair.friction_static);
  cone.imposed = static_cast<std::uint8_t>(imposed);
  for (const FrictionCone& other : cones_) {
    if (other.pair == cone.pair) cone.number = static_cast<std::uint8_t>(other.number + 1);
  }
  Vec3 kept = Vec3::Zero();
  for (const FrictionCone& last : last_cones_) {
    if (last.pair != cone.pair || last.number != cone.number) continue;
    kept = last.direction_w - normal_w * normal_w.dot(last.direction_w);
    break;
  }
  // Against the pull. On planes that are not parallel the pull at a point is mostly into the
  // others: there against the slip of the tick so far, or the way that the goal has come and the
  // part has not. Of a point with hardly any pull the last direction stays: tremor gives it none.
  if (wedged_) cone.slid_w = slip_of(cone, slid_.translation_m, slid_.rotation_rad);
  cone.slid_m = std::sqrt(cone.slid_w.squaredNorm());
  const auto is_way = [&](const Vec3& way) {
    return way.squaredNorm() >
           kOwnWay * kOwnWay * parameters_.scale.last_m * parameters_.scale.last_m;
  };
  Vec3 pull = cone.slid_w;
  if (wedged_ && !is_way(pull)) pull = slip_of(cone, way_.translation_m, way_.rotation_rad);
  if (!is_way(pull)) pull = slip_of(cone, error.translation_m, error.rotation_rad);
  Vec3 t = -pull;
  if (pull.squaredNorm() <
      kLeastPull * kLeastPull * parameters_.scale.manifold_m * parameters_.scale.manifold_m) {
    t = kept;
  }
  const Real length = std::sqrt(t.squaredNorm());
  t = length > parameters_.scale.still_m ? Vec3(t / length) : plane_basis(normal_w).e1;
  cone.direction_w = t;
  if (!cones_.push(cone)) return false;
  if (kept.squaredNorm() > 0.5_r) {
    cones_[cones_.size() - 1].direction_w = kept;
    if (kept.dot(t) < kOneDirection && !push_cone_row(cones_.size() - 1, kept, error)) return false;
  }
  const Vec3 b = normal_w.cross(t);
  const Vec3 aside = kAside * b;
  const Vec3 across = 0.8660254037844386_r * b;
  for (const Vec3& side : {t, Vec3(kAlong * t + aside), Vec3(kAlong * t - aside),
                           Vec3(across - t / 2), Vec3(-across - t / 2)}) {
    if (!push_cone_row(cones_.size() - 1, side, error)) return false;
  }
  // The way back is free of lift and would let the point sink.
  return !(cone.slid_m > 0) || push_row(imposed, arm, normal_w, least_m, error, kMaxQpRows);
}

/// What a motion of the part moves a point by along its plane.
Vec3 Proxy::slip_of(const FrictionCone& cone, const Vec3& dx_m,
                    const Vec3& dtheta_rad) const noexcept {
  const Vec3 dp = is_fixed() ? dx_m : Vec3(dx_m + dtheta_rad.cross(cone.arm.app_w));
  return dp - cone.normal_w * cone.normal_w.dot(dp);
}

/// Adds half spaces where the solution violates a cone, until it keeps all of them.
///
/// The force of a cone is against its slip, so both have one direction, which f - slip has as well,
/// with the force f of the rows so far as a length. Where a point hardly slides its slip alone says
/// little: an error of f's direction comes back in it times the ratio of pull and slip.
void Proxy::cut_cones(const PoseError& error, Real tolerance_m, ProxyTick& tick) noexcept {
  if (cones_.empty()) return;
  for (; cone_programs_ < kMaxConePrograms; ++cone_programs_) {
    const auto [dx, dtheta] = asked(error);
    const Real pulled = std::sqrt(last_qp_.z.squaredNorm());
    const auto against = [&](std::uint32_t k, const Vec3& slip) {
      Vec3 t = -(cones_[k].slid_w + slip);
      for (std::uint32_t i = 0; i < last_qp_.active_count; ++i) {
        const std::uint32_t row = last_qp_.active[i];
        if (row_cone_[row] != k) continue;
        t += last_qp_.multiplier[i] * (Vec3(rows_[row].g.head<3>()) - cones_[k].normal_w);
      }
      return t;
    };
    bool cut = false;
    for (std::uint32_t k = 0; k < cones_.size(); ++k) {
      FrictionCone& cone = cones_[k];
      const Vec3 slip = slip_of(cone, dx, dtheta);
      const Real length = std::sqrt((cone.slid_w + slip).squaredNorm());
      const Real slides = length - cone.slid_m;
      Real rise = cone.normal_w.dot(dx);
      if (!is_fixed()) rise += turned_m(cone.arm, cone.normal_w, dtheta);
      const ProxyPair& pair = pairs_[cone.pair];
      const Real force_m = !wedged_ && pair.slips && pair.quiet_ticks == 0 ? pulled : Real{0};
      const Real leave = std::max({kConeShare * cone.friction * std::sqrt(slip.squaredNorm()),
                                   kForceShare * force_m, tolerance_m});
      const Real room = rise - cone.least_m;
      if (!(cone.friction * slides - room > leave)) continue;
      Vec3 t = against(k, slip);
      const Real size = std::sqrt(t.squaredNorm());
      t /= size;
      const Real along = -t.dot(cone.slid_w + slip) - cone.slid_m;
      if (!(cone.friction * along - room > leave)) t = -(cone.slid_w + slip) / length;
      if (!push_cone_row(k, t, error)) return;
      cone.direction_w = t;
      cut = true;
    }
    if (!cut) return;
    if (!has_budget(tick) && cone_programs_ >= kGrantedConePrograms) {
      tick.limited = true;
      return;
    }
    const QpResult last = last_qp_;
    last_qp_ = solve_rows(tolerance_m, tick, std::span(last.active).first(last.active_count));
  }
}

/// The half space of one direction along the plane.
bool Proxy::push_cone_row(std::uint32_t at, const Vec3& direction_w,
                          const PoseError& error) noexcept {
  const FrictionCone& cone = cones_[at];
  const Real lifted_m = cone.slid_m + direction_w.dot(cone.slid_w);
  const Vec3 w = cone.normal_w + cone.friction * direction_w;
  if (!push_row(cone.imposed, cone.arm, w, cone.least_m - cone.friction * lifted_m, error,
                kMaxQpRows)) {
    return false;
  }
  row_cone_[rows_.size() - 1] = static_cast<std::uint8_t>(at);
  return true;
}

/// Pairs that a step lets slide do so from the next pass on.
void Proxy::note_slip(const Step& step) noexcept {
  const Real least = kSlipShare * parameters_.scale.still_m;
  for (FrictionCone& cone : cones_) {
    const Vec3 slip = slip_of(cone, step.dx_m, step.dtheta_rad);
    const Real length = std::sqrt(slip.squaredNorm());
    if (length <= least) continue;
    pairs_[cone.pair].slips = true;
    pairs_[cone.pair].quiet_ticks = 0;
  }
}

/// At the end of a tick: pairs that have long been still stick.
void Proxy::settle_slip() noexcept {
  if (cones_.capacity() == 0) return;
  for (ProxyPair& pair : pairs_) {
    if (!pair.slips) continue;
    pair.quiet_ticks += 1;
    pair.slips = pair.quiet_ticks <= kStickTicks;
  }
}

}  // namespace haptic
