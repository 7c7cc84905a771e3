// SPDX-License-Identifier: Apache-2.0
// Forces between bodies, their springs, and whether bodies come to rest where nothing holds them.
#include <algorithm>
#include <cmath>

#include "host_sim/lab/bodies_fuzz/bodies_run.hpp"

namespace haptic::sim {
namespace {

/// Bodies stand still in this many ticks of those in which the goals do, in a row.
constexpr std::uint64_t kStillTicks = 50, kLeastRest = 300, kMostRest = 3000;
/// A loose part that a hand presses on gives way by a hundredth of the force that its anchor cannot
/// hold in every tick, and behind a lever by less: that force falls by a factor of e in 100 to 1000
/// ticks, ten times until the part moves too little to count.
constexpr std::uint64_t kMostRestOfLoose = 12000;
/// So far is looked for what is nearest to one that is not.
constexpr Wide kLookedFor_m = 0.01L;
/// At rest off its goal a body is within so many tolerances of what holds it.
constexpr Wide kTouchingTolerances = 20;
constexpr Wide kAtGoal_j = 1e-9L;
/// Contact forces cancel to this share of the largest.
constexpr Wide kSumShare = 1e-9L, kReactionFault = 1e-2L;
/// A pull that contacts need not hold at rest, without a flag.
constexpr Wide kRestResidual_n = 0.01L;
constexpr Wide kSpringRoundings = 64;

WideVec wide_of(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

}  // namespace

Wrench BodiesRun::contact_w(std::size_t body) const {
  Wrench contact = session_.law().contact_w(static_cast<std::uint32_t>(body));
  if (fault_ == BodiesFault::kReaction && body == 0)
    contact.force_w *= 1 + static_cast<Real>(kReactionFault);
  return contact;
}

/// The law's own wrenches and energies of the springs are those of the true springs.
void BodiesRun::check_springs(const Tick& tick, BodiesTotals& totals) {
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
    const Spring& spring = session_.bodies()[k].spring;
    const WidePull pull = wide_pull(
        spring, wide_error(tick.wide_goals[k],
                           wide_pose(pose_of(session_.law().pose(static_cast<std::uint32_t>(k))))));
    const auto number = static_cast<std::uint32_t>(k);
    const Wrench told = session_.law().spring_w(number);
    // The error is a difference of rounded coordinates, and of rounded quaternions.
    const Wide of_force = kSpringRoundings * roundoff *
                          (widen(spring.k_t_n_per_m) * judge_.extent_m() + norm(pull.force));
    const Wide of_torque =
        kSpringRoundings * roundoff * (widen(spring.k_r_nm_per_rad) + norm(pull.torque));
    const Wide force = norm(wide_of(told.force_w) + pull.force);
    const Wide torque = norm(wide_of(told.torque_w) + pull.torque);
    const Wide energy = std::abs(widen(session_.law().potential_j(number)) - pull.energy_j);
    const Wide of_energy = kSpringRoundings * roundoff *
                           (pull.energy_j + norm(pull.force) * judge_.extent_m() +
                            norm(pull.torque) + widen(spring.k_t_n_per_m) * roundoff);
    if (force <= of_force && torque <= of_torque && energy <= of_energy) continue;
    fail(tick, "spring",
         scene_.bodies[k].name + ", off by " + number_text(force) + " N, " + number_text(torque) +
             " N m, " + number_text(energy) + " J",
         totals.springs, totals);
  }
}

/// Action and reaction: the forces of all bodies cancel where nothing that stands pushes, and so do
/// their torques about the origin, but for the levers: the last program may have seen the bodies
/// anywhere on the ways of this tick.
void BodiesRun::check_sums(const Tick& tick, BodiesTotals& totals) {
  if (tick.told.spent) return;  // its forces are those of an earlier program
  for (const BodyPair& pair : session_.law().pairs()) {
    if (!pair.has_b() && !pair.active_rows().empty()) return;
  }
  WideVec force;
  Wide largest_n = 0, largest_nm = 0, way_m = 0;
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
    const Wrench contact = contact_w(k);
    const WideVec f = wide_of(contact.force_w);
    force = force + f;
    largest_n = std::max(largest_n, norm(f));
    largest_nm =
        std::max(largest_nm, norm(wide_of(contact.torque_w)) + judge_.extent_m() * norm(f));
    way_m += norm(tick.wide_goals[k].p - tick.goals_before[k].p) +
             norm(tick.after[k].p - tick.before[k].p);
  }
  if (!(largest_n > 0)) return;
  Wide torque_nm = torque_sum_nm(tick.before);
  for (const std::vector<WidePose>& poses : tick.steps)
    torque_nm = std::min(torque_nm, torque_sum_nm(poses));
  ++totals.summed;
  totals.largest_sum_n = std::max(totals.largest_sum_n, norm(force));
  totals.largest_lever_m = std::max(totals.largest_lever_m, torque_nm / largest_n);
  if (norm(force) <= kSumShare * largest_n &&
      torque_nm <= kSumShare * largest_nm + largest_n * way_m) {
    return;
  }
  fail(tick, "forces do not cancel",
       number_text(norm(force)) + " N of " + number_text(largest_n) + " N, " +
           number_text(torque_nm) + " N m of " + number_text(largest_nm) + " N m",
       totals.sums, totals);
}

Wide BodiesRun::torque_sum_nm(std::span<const WidePose> poses) const {
  WideVec torque;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Wrench contact = contact_w(k);
    torque = torque + wide_of(contact.torque_w) + cross(poses[k].p, wide_of(contact.force_w));
  }
  return norm(torque);
}

void BodiesRun::note_work(const Tick& tick, BodiesTotals& totals) {
  const BodiesTick& told = tick.told;
  if (told.recovering) fail(tick, "recovery", "", totals.recoveries, totals);
  if (told.work.rejected > 0) ++totals.rejected_ticks;
  if (told.limited) ++totals.limited_ticks;
  if (told.spent) ++totals.spent_ticks;
  rejected_ = !told.moved && told.work.rejected > 0 ? rejected_ + 1 : 0;
  const auto raise = [](std::uint64_t& peak, std::uint64_t value) { peak = std::max(peak, value); };
  raise(totals.longest_rejected, rejected_);
  raise(totals.peak_units, told.work.units());
  raise(totals.peak_ns, tick.ns);
  const std::uint64_t bound = fault_ == BodiesFault::kBound ? 0 : session_.units_bound();
  raise(totals.units_bound, bound);
  if (told.work.units() > bound) {
    fail(tick, "over its bound",
         std::to_string(told.work.units()) + " units of " + std::to_string(bound), totals.over,
         totals);
  }
  raise(totals.peak_rows, told.work.rows);
  raise(totals.peak_rounds, told.work.rounds);
  raise(totals.peak_steps, told.work.qp_steps);
}

/// More than a move that may be the last one of a tick.
bool BodiesRun::moves(const Tick& tick) const {
  const ProxyScale& scale = session_.scale();
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
    if (scene_.bodies[k].sink_m > 0) continue;  // as long as nothing holds it
    const WideError way = wide_error(tick.after[k], tick.before[k]);
    if (norm(way.translation_m) > widen(scale.last_m) ||
        norm(way.rotation_rad) > widen(scale.last_rad)) {
      return true;
    }
  }
  return false;
}

/// True when the run may end: all bodies have come to rest, or do not.
bool BodiesRun::check_rest(const Tick& tick, BodiesTotals& totals) {
  ++resting_;
  still_ = moves(tick) || tick.told.spent ? 0 : still_ + 1;
  const bool rests = still_ >= kStillTicks;
  if (!rests && resting_ > (has_loose_ ? kMostRestOfLoose : kMostRest)) {
    fail(tick, "does not stop", std::to_string(resting_) + " ticks after its goals", totals.stuck,
         totals);
    return true;
  }
  if (!rests || resting_ < kLeastRest) return false;
  ++totals.rests;
  totals.longest_arrival = std::max(totals.longest_arrival, resting_ - still_);
  check_arrived(tick, totals);
  return true;
}

/// A body at rest off its goal touches what holds it, and that holds its spring's pull.
void BodiesRun::check_arrived(const Tick& tick, BodiesTotals& totals) {
  const Wide near = kTouchingTolerances * judge_.tolerance_m() + judge_.allowed_depth_m();
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
    const WidePull pull = pull_of(k, tick);
    if (pull.energy_j > kAtGoal_j) {
      const Wide clear = judge_.clear_m(k, tick.after, near);
      if (clear >= near) {
        fail(tick, "does not arrive",
             scene_.bodies[k].name + ", " + number_text(pull.energy_j) +
                 " J, and nothing is within " + number_text(near) + " m, but at " +
                 number_text(judge_.clear_m(k, tick.after, kLookedFor_m)) + " m",
             totals.stuck, totals);
      }
    }
    if (scene_.bodies[k].role == BodyRole::kDriver) continue;
    const Wrench contact = contact_w(k);
    const Wide length = widen(session_.bodies()[k].spring.length_m);
    const Wide left_n = std::max(norm(wide_of(contact.force_w) + pull.force),
                                 norm(wide_of(contact.torque_w) + pull.torque) / length);
    const bool flagged = tick.told.limited || tick.told.residual_n > kResidual_n;
    if (flagged) continue;
    totals.largest_rest_n = std::max(totals.largest_rest_n, left_n);
    if (left_n <= kRestResidual_n) continue;
    fail(tick, "not balanced",
         scene_.bodies[k].name + ", " + number_text(left_n) + " N of " +
             number_text(norm(pull.force)),
         totals.unbalanced, totals);
  }
}

}  // namespace haptic::sim
