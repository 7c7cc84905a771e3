// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/body_pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/proxy/pass_numbers.hpp"
#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {

GripPose seen_from(const GripPose& b, const Vec3& grip_b_m, const GripPose& a) noexcept {
  GripPose seen;
  seen.x0_w = b.r_wa.transpose() * (a.x0_w - b.x0_w) + grip_b_m;
  seen.q_wa = (b.q_wa.conjugate() * a.q_wa).normalized();
  seen.r_wa = seen.q_wa.toRotationMatrix();
  return seen;
}

BodyMotion beyond(const BodyMotion& whole, const BodyMotion& carry) noexcept {
  BodyMotion more{whole.translation_m - carry.translation_m, whole.rotation_rad};
  if (!carry.rotation_rad.isZero(0)) {
    more.rotation_rad =
        so3_log((so3_exp(whole.rotation_rad) * so3_exp(-carry.rotation_rad)).normalized());
  }
  return more;
}

BodyMotion joined(const BodyMotion& carry, const BodyMotion& more) noexcept {
  BodyMotion whole{carry.translation_m + more.translation_m, more.rotation_rad};
  if (!carry.rotation_rad.isZero(0)) {
    whole.rotation_rad =
        so3_log((so3_exp(more.rotation_rad) * so3_exp(carry.rotation_rad)).normalized());
  }
  return whole;
}

void BodyPair::read_scene(const SceneView& scene) noexcept {
  proxy_.read_scene(scene);
  radius_m_ = scene_size(scene).radius_m;
}

void BodyPair::configure(const Parameters& parameters) noexcept {
  parameters_ = parameters;
  Proxy::Parameters p;
  // Rows are in units of motion: the law scales them.
  p.spring.k_t_n_per_m = p.spring.k_r_nm_per_rad = p.spring.length_m = 1;
  p.scale = parameters.scale;
  p.radius_m = radius_m_;
  p.passes = parameters.passes;
  p.work_units = parameters.work_units;
  p.epsilon_m = parameters.epsilon_m;
  proxy_.configure(p);
  proxy_.program_.secant = p.spring;
}

void BodyPair::reset(const GripPose& a, const GripPose& b) noexcept {
  proxy_.reset();
  proxy_.move_.way_left_m = proxy_.move_.turn_left_rad = kUnbounded;
  proxy_.part_.pose = has_b() ? seen_from(b, parameters_.grip_b_m, a) : a;
  proxy_.part_.version += 1;
  proxy_.started_ = proxy_.out_.led_out = true;
  proxy_.slip_.way = proxy_.slip_.came = PoseError{};
  carry_a_ = carry_b_ = BodyMotion{};
  r_wb_ = has_b() ? b.r_wa : Mat3(Mat3::Identity());
  between_w_ = has_b() ? Vec3(a.x0_w - b.x0_w) : Vec3(Vec3::Zero());
  stays_ = true;
  gap_m_ = 0;
}

BodyMotion BodyPair::relative(const BodyMotion& a, const BodyMotion& b) const noexcept {
  if (!has_b()) return a;
  const BodyMotion of_a = beyond(a, carry_a_), of_b = beyond(b, carry_b_);
  const Vec3 way_w = of_a.translation_m - of_b.translation_m - of_b.rotation_rad.cross(between_w_);
  return {r_wb_.transpose() * way_w, r_wb_.transpose() * (of_a.rotation_rad - of_b.rotation_rad)};
}

void BodyPair::set_carried(const Carried& a, const Carried& b) noexcept {
  carry_a_ = a.carry;
  carry_b_ = b.carry;
  if (has_b()) {
    r_wb_ = b.p.r_wa;
    between_w_ = a.p.x0_w - b.p.x0_w;
  }
  error_ = relative(a.error, b.error);
  spared_ = PoseError{};
}

void BodyPair::set_pull(const BodyMotion& a, const BodyMotion& b) noexcept {
  const BodyMotion pull = relative(a, b);
  spared_.translation_m = error_.translation_m - pull.translation_m;
  spared_.rotation_rad = error_.rotation_rad - pull.rotation_rad;
}

void BodyPair::begin_tick(const BodyMotion& goal_way_a, const BodyMotion& goal_way_b,
                          const BodyTickState& state, NearScratch& scratch,
                          ProxyTick& tick) noexcept {
  proxy_.scratch_.near = &scratch;
  proxy_.move_.grants = 0;
  proxy_.begin_lists();
  proxy_.near_.waited = proxy_.near_.waiting;
  proxy_.near_.waiting = false;
  proxy_.rest_.held = state.held;
  proxy_.move_.behind_ticks = state.behind_ticks;
  if (has_friction()) {
    const BodyMotion way = relative(goal_way_a, goal_way_b);
    if (state.behind_ticks == 0) proxy_.slip_.way = PoseError{};
    proxy_.slip_.way.translation_m += way.translation_m;
    proxy_.slip_.way.rotation_rad += way.rotation_rad;
  }
  const double odometer = proxy_.odometer_m();
  Real& motion_m = proxy_.near_.tick_motion_m;
  motion_m = std::max(motion_m / 2, static_cast<Real>(odometer - proxy_.near_.tick_start_m));
  proxy_.near_.tick_start_m = odometer;
  TickMove& move = proxy_.move_;
  move.longest = move.spent = move.list_cut = false;
  move.granted_lists = move.granted_planes = kGrantedScreenWork;
  proxy_.pass_.inside = proxy_.pass_.recovering = false;
  if (proxy_.has_screen()) proxy_.give_back(tick);
}

void BodyPair::end_tick(ProxyTick& tick) noexcept {
  tick.gap_m = gap_m_;
  proxy_.tell_gap(stays_ ? Proxy::PassEnd::kDone : Proxy::PassEnd::kMoved, tick);
  gap_m_ = tick.gap_m;
  proxy_.range_.pass_units = std::max(
      proxy_.range_.pass_units / 2, tick.work.units() - tick.work.list_visits / kListVisitsOfUnit);
  proxy_.settle_slip();
  proxy_.feel(tick);
  if (!is_inside() && !proxy_.near_.waiting && proxy_.unlisted_m() > 0) proxy_.out_.led_out = false;
}

void BodyPair::begin_pass(std::uint32_t number, Real pull_m, ProxyTick& tick) noexcept {
  proxy_.move_.pass_of_tick = number;
  proxy_.move_.spent = false;
  proxy_.gather({Vec3(pull_m, 0, 0), Vec3::Zero()}, tick);
  gap_m_ = tick.gap_m;
  stays_ = true;
  if (is_inside()) return;
  proxy_.out_.way_w.setZero();
  proxy_.out_.short_ways = 0;
  proxy_.begin_program();
}

void BodyPair::impose_last(Real close_m, bool choose_from_start, ProxyTick& tick) noexcept {
  proxy_.program_.close_m = close_m;
  proxy_.pass_.is_short = false;
  proxy_.rest_.choose_from_start = choose_from_start;
  proxy_.impose_last(error_, tick);
}

BlockRow BodyPair::row(std::uint32_t k) const noexcept {
  const QpRow& row = proxy_.program_.rows[k];
  const Vec3 w = r_wb_ * row.g.head<3>(), moment = r_wb_ * row.g.tail<3>();
  BlockRow on;
  on.h = row.h + row.g.head<3>().dot(spared_.translation_m) +
         row.g.tail<3>().dot(spared_.rotation_rad);
  on.a = static_cast<std::uint8_t>(a());
  for (int i = 0; i < 3; ++i) {
    on.g_a[static_cast<std::size_t>(i)] = w[i];
    on.g_a[static_cast<std::size_t>(3 + i)] = moment[i];
  }
  if (!has_b()) return on;
  // A common motion changes no gap: that tells B's half, about B's own point.
  const Vec3 moment_b = moment + between_w_.cross(w);
  on.b = static_cast<std::uint8_t>(b());
  for (int i = 0; i < 3; ++i) {
    on.g_b[static_cast<std::size_t>(i)] = -w[i];
    on.g_b[static_cast<std::size_t>(3 + i)] = -moment_b[i];
  }
  return on;
}

void BodyPair::add_active(std::uint32_t row, Real multiplier) noexcept {
  QpResult& found = proxy_.program_.found;
  // Rows that hold do not depend on each other, and all of them act on one relative motion.
  if (found.active_count >= found.active.size()) return;
  found.active[found.active_count] = static_cast<std::uint8_t>(row);
  found.multiplier[found.active_count++] = multiplier;
}

void BodyPair::end_found(const BodyMotion& a, const BodyMotion& b) noexcept {
  PassProgram& program = proxy_.program_;
  program.wish = relative(a, b);
  program.has_wish = true;
  program.found.z.head<3>() = program.wish.translation_m - error_.translation_m;
  program.found.z.tail<3>() = program.wish.rotation_rad - error_.rotation_rad;
}

bool BodyPair::cut_cones(Real tolerance_m) noexcept {
  return has_cones() && proxy_.cut_once(error_, tolerance_m) == Proxy::Cut::kSome;
}

bool BodyPair::shifts_fit(bool may_lift) const noexcept {
  return proxy_.shifts_fit(proxy_.program_.wish, may_lift);
}

void BodyPair::shift_cones(bool back) noexcept {
  proxy_.shift_cones(back ? PoseError{} : proxy_.program_.wish);
}

void BodyPair::set_step(const GripPose& a, const GripPose& b, const BodyMotion& motion_a,
                        const BodyMotion& motion_b) noexcept {
  const auto is_none = [](const BodyMotion& m) {
    return m.translation_m.isZero(0) && m.rotation_rad.isZero(0);
  };
  stays_ = is_none(motion_a) && (!has_b() || is_none(motion_b));
  linear_ = relative(motion_a, motion_b);
  if (!has_b()) {
    step_q_ = a;
    step_ = motion_a;
    return;
  }
  step_q_ = seen_from(b, parameters_.grip_b_m, a);
  const GripPose& p = proxy_.part_.pose;
  step_.translation_m = step_q_.x0_w - p.x0_w;
  step_.rotation_rad = so3_log((step_q_.q_wa * p.q_wa.conjugate()).normalized());
  step_r_wb_ = b.r_wa;
  step_between_w_ = a.x0_w - b.x0_w;
}

BodyPair::Check BodyPair::check(Real least_m, bool knows_last, ProxyTick& tick) noexcept {
  if (stays_) return {};
  const Proxy::Step step{step_q_, step_.translation_m, step_.rotation_rad};
  const Proxy::Step before{before_q_, before_.translation_m, before_.rotation_rad};
  tick.gap_m = gap_m_;
  const Proxy::Check found =
      proxy_.check(step, least_m, tick, knows_last && knows_before_ ? &before : nullptr);
  gap_m_ = tick.gap_m;
  before_q_ = step_q_;
  before_ = step_;
  knows_before_ = true;
  worst_ = found.worst;
  return {found.ok, found.lacking_m, found.share, proxy_.move_.spent};
}

bool BodyPair::impose_lacking(Real least_m, Real taken, Real least_share, Real& share,
                              ProxyTick& tick) noexcept {
  const Proxy::Step step{step_q_, step_.translation_m, step_.rotation_rad};
  Proxy::Check found;
  found.worst = worst_;
  const PassState& pass = proxy_.pass_;
  const std::uint32_t met = proxy_.worst_that_meets(found, step, least_m, tick);
  const ReachedPair& lacking = pass.reached[worst_];
  const bool has_room = proxy_.near_.pairs[lacking.pair].view->has_facet() &&
                        lacking.gap_m > parameters_.scale.tolerance_m;
  share = 1;
  if (met == pass.reached.size() && has_room) {
    const Real moved_m = std::sqrt(step_.translation_m.squaredNorm()) +
                         std::sqrt(step_.rotation_rad.squaredNorm()) * radius_m_;
    share = std::max(kRoomShare * std::min<Real>(lacking.gap_m / moved_m, 1), least_share);
    return true;
  }
  PassProgram& program = proxy_.program_;
  const std::uint32_t rows = program.rows.size(), cones = program.cones.size();
  const bool had_far_rows = program.far_rows;
  program.far_rows = false;
  const bool fits = proxy_.impose(met < pass.reached.size() ? met : worst_, step, error_, tick);
  if (program.far_rows) straighten(rows, cones, taken);
  program.far_rows = program.far_rows || had_far_rows;
  return fits;
}

/// Rows at a step ask for what is missing there by its true motion. They are to be kept by its
/// motion to first order, and by the share of it that is taken.
void BodyPair::straighten(std::uint32_t rows, std::uint32_t cones, Real taken) noexcept {
  if (!has_b() || !(taken > 0)) return;
  PassProgram& program = proxy_.program_;
  const Vec3 way = (linear_.translation_m - step_.translation_m) / taken;
  const Vec3 turn = (linear_.rotation_rad - step_.rotation_rad) / taken;
  for (std::uint32_t k = rows; k < program.rows.size(); ++k) {
    QpRow& row = program.rows[k];
    row.h += row.g.head<3>().dot(way) + row.g.tail<3>().dot(turn);
  }
  for (std::uint32_t k = cones; k < program.cones.size(); ++k) {
    FrictionCone& cone = program.cones[k];
    cone.least_m += cone.normal_w.dot(way) + turned_m(cone.arm, cone.normal_w, turn);
  }
}

void BodyPair::begin_retry(bool from_start, bool is_short, ProxyTick& tick) noexcept {
  PassProgram& program = proxy_.program_;
  proxy_.pass_.is_short = is_short;
  program.far_rows = false;
  program.rows.clear();
  program.cones.clear();
  if (from_start) program.imposed.clear();
  for (std::uint32_t k = 0; k < program.imposed.size(); ++k) {
    program.imposed[k].times = 0;
    program.imposed[k].at_step = false;
    if (!proxy_.add_rows_at_p(k, error_, tick)) break;
  }
}

Real BodyPair::trusted_m(Real share, const BodyMotion& relative, ProxyTick& tick) noexcept {
  Real trust_m = proxy_.range_.trust_m;
  if (!has_facets()) return trust_m;
  trust_m = std::max(trust_m, nearest_m());
  const Real far_m = std::sqrt(relative.translation_m.squaredNorm());
  const Real turn_rad = std::sqrt(relative.rotation_rad.squaredNorm());
  const Real motion_m = far_m + turn_rad * radius_m_;
  if (!proxy_.has_long_lists() || !(motion_m > 0)) return trust_m;
  const auto listed_m = [&] {
    return kListShare * proxy_.unlisted_m() * motion_m / proxy_.list_motion_m(far_m, turn_rad);
  };
  const Real step_m = std::min(share * motion_m, trust_m);
  const bool widens = proxy_.has_screen() && proxy_.move_.behind_ticks == 0 &&
                      step_m > listed_m() && proxy_.has_budget(tick);
  if (widens) proxy_.widen(step_m, tick);
  return std::min(trust_m, listed_m());
}

void BodyPair::end_pass(bool moved, bool rejected, Real tried_m) noexcept {
  const bool first = proxy_.move_.pass_of_tick == 0;
  if (first && (!moved || stays_)) proxy_.slip_.came = PoseError{};
  proxy_.kept_.pending.clear();
  proxy_.pass_.tried_m = tried_m;
  proxy_.adapt_trust(moved      ? Proxy::PassEnd::kMoved
                     : rejected ? Proxy::PassEnd::kRejected
                                : Proxy::PassEnd::kDone);
  knows_before_ = false;
}

PlaneGap BodyPair::gap_at_step(const ReachedPair& reached, ProxyTick& tick) const noexcept {
  tick.work.plane_gaps += 1;
  const PairAt at = pair_at(proxy_.near_.pairs[reached.pair], step_q_);
  return plane_gap(at, reached.plane, reached.support);
}

void BodyPair::accept() noexcept {
  if (stays_) return;
  proxy_.accept({step_q_, step_.translation_m, step_.rotation_rad});
  arrive();
}

void BodyPair::carry() noexcept {
  if (stays_) return;
  const Real far_m = std::sqrt(step_.translation_m.squaredNorm());
  const Real turn_rad = std::sqrt(step_.rotation_rad.squaredNorm());
  PlacedPart& part = proxy_.part_;
  part.pose = step_q_;
  part.version += 1;
  part.path_m = (part.path_m + static_cast<double>(far_m) * kOdometerUp) * (1 + 0x1p-52);
  part.turn_rad = (part.turn_rad + static_cast<double>(turn_rad) * kOdometerUp) * (1 + 0x1p-52);
  proxy_.near_.list.follow(step_.translation_m, step_.rotation_rad);
  if (proxy_.has_screen()) proxy_.near_.screen->accept(part.pose, far_m, turn_rad);
  for (ReachedPair& reached : proxy_.pass_.reached)
    reached.gap_q_m = proxy_.clear_m(proxy_.near_.pairs[reached.pair]);
  proxy_.kept_.active.clear();
  proxy_.kept_.pending.clear();
  proxy_.program_.imposed.clear();
  proxy_.program_.cones.clear();
  proxy_.slip_.last_cones.clear();
  proxy_.program_.found = QpResult{};
  arrive();
}

void BodyPair::arrive() noexcept {
  carry_a_ = carry_b_ = BodyMotion{};
  if (!has_b()) return;
  r_wb_ = step_r_wb_;
  between_w_ = step_between_w_;
}

Vec3 BodyPair::way_out_w(ProxyTick& tick) noexcept { return r_wb_ * proxy_.next_way_out(tick); }

void BodyPair::add_forces(Real share, BodyMotion& on_a, BodyMotion& on_b) const noexcept {
  const PassProgram& program = proxy_.program_;
  for (std::uint32_t k = 0; k < program.found.active_count; ++k) {
    const QpRow& row = program.rows[program.found.active[k]];
    const Vec3 force_w = share * program.found.multiplier[k] * (r_wb_ * row.g.head<3>());
    const Vec3 moment_w = share * program.found.multiplier[k] * (r_wb_ * row.g.tail<3>());
    on_a.translation_m += force_w;
    on_a.rotation_rad += moment_w;
    if (!has_b()) continue;
    on_b.translation_m -= force_w;
    on_b.rotation_rad -= moment_w + between_w_.cross(force_w);
  }
}

}  // namespace haptic
