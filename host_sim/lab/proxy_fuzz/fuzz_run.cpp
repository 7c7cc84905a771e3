// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"

#include <algorithm>

#include "host_sim/session/counters_check.hpp"

namespace haptic::sim {
namespace {

/// A run without a move may be this long though a move is possible.
constexpr std::uint64_t kLongestStall = 10;
/// From here on ticks without a move are looked at; shorter runs are not counted.
constexpr std::uint64_t kFirstLook = 6;
/// Smaller moves do not count, for a part of 50 mm.
constexpr Wide kStill_m = 1e-9L, kRadius_m = 0.05L;
/// Energy below which the proxy counts as at its goal [J].
constexpr Wide kAtGoal_j = 1e-9L;

/// A part arrives within this many ticks of the device's standing still.
constexpr std::uint64_t kLongestArrival = 20000;

}  // namespace

void draw_start(const FuzzScene& scene, ProxyJudge& judge, Seeded& random, Vector& p, Rotation& q) {
  constexpr int kTrials = 60;
  const double clear_m = static_cast<double>(1000 * judge.tolerance_m());
  for (int k = 0; k < kTrials; ++k) {
    for (int i = 0; i < 3; ++i) {
      p[i] = scene.home[i] + 1.2 * random.uniform(-scene.range[i], scene.range[i]);
    }
    q = Rotation(
        Eigen::AngleAxisd(random.uniform(-scene.tilt_rad, scene.tilt_rad), random.direction()));
    if (judge.free_gap_m(wide_pose(pose_at(p, q)), clear_m) >= clear_m) return;
  }
  p = scene.start;
  q = Rotation::Identity();
}

/// What one tick was given and returned, with the poses in long double.
struct FuzzRun::Tick {
  std::uint64_t number = 0;
  Pose device;
  StepResult result;
  WidePose before, after, goal;
  Wide start_j = 0, end_j = 0;
};

FuzzRun::FuzzRun(const FuzzScene& scene, double friction, std::span<const std::byte> blob,
                 std::optional<ProxyFault> fault, bool to_rest)
    : scene_(scene),
      friction_(friction),
      session_(blob, scene.name),
      judge_(scene, session_.view()),
      to_rest_(to_rest) {
  if (fault) damage(session_, *fault);
}

ProxyFuzzTotals FuzzRun::run(FuzzMotionKind kind, std::uint64_t ticks, std::uint64_t seed) {
  ProxyFuzzTotals totals;
  Seeded random(seed);
  Vector p;
  Rotation q;
  draw_start(scene_, judge_, random, p, q);
  FuzzMotion motion(scene_, kind, p, q, random.below(1u << 30));
  HapticCore& core = session_.core();
  core.reset();
  goals_.clear();
  still_ = possible_ = rejected_ = 0;
  turned_ = false;
  label_ = scene_.name + ", friction " + number_text(widen(friction_)) + ", " + to_text(kind) +
           ", seed " + std::to_string(seed);
  const std::uint32_t passes = session_.view().parameters().coupling.passes;
  label_ += ", " + std::to_string(passes) + (passes == 1 ? " pass" : " passes");
  Tick tick;
  StepInput input;
  if (to_rest_) label_ += ", " + std::to_string(session_.view().parameters().work_units) + " units";
  resting_ = 0;
  bool rests = false;
  for (std::uint64_t t = 0; t < ticks || (to_rest_ && !rests); ++t) {
    tick.number = t;
    if (t < ticks) tick.device = t == 0 ? pose_at(p, q) : motion.next();
    input.pose_wa = tick.device;
    ++input.sequence;
    tick.result = core.step(input);
    tick.goal = wide_pose(tick.result.goal_pose_wa);
    tick.before = t == 0 ? tick.goal : tick.after;
    tick.after = wide_pose(tick.result.proxy_pose_wa);
    tick.start_j = judge_.potential_j(wide_error(tick.goal, tick.before));
    tick.end_j = judge_.potential_j(wide_error(tick.goal, tick.after));
    ++totals.ticks;
    if (tick.end_j > kAtGoal_j) ++totals.held;
    check_free(tick, totals);
    if (passes == 1) check_path(tick, totals);
    check_energy(tick, totals);
    check_output(tick, totals);
    check_caps(tick, totals);
    check_still(tick, totals);
    if (t >= ticks) rests = check_rest(tick, totals);
  }
  return totals;
}

void FuzzRun::fail(const Tick& tick, const char* kind, const std::string& what,
                   std::uint64_t& count, ProxyFuzzTotals& totals) const {
  ++count;
  totals.failures.add(kind, tick_failure_text(label_, tick.number, tick.result.proxy_pose_wa,
                                              tick.result.goal_pose_wa, what));
}

void FuzzRun::check_free(const Tick& tick, ProxyFuzzTotals& totals) {
  const Wide share = judge_.radius_m() / kRadius_m;
  const Wide allowed = judge_.allowed_depth_m();
  // Deeper than seen so far: then it is worth the search for the distance itself.
  const Wide worst = std::max(totals.worst_gap_m * share, -allowed);
  const Wide gap = judge_.end_gap_m(tick.after, worst);
  if (gap < totals.worst_gap_m * share) totals.worst_gap_m = gap / share;
  if (gap < -allowed) {
    fail(tick, "not free", "gap " + number_text(gap) + " m", totals.deep, totals);
  }
  if (judge_.crossed(tick.before, tick.after)) {
    fail(tick, "through the plate", "a point of the part", totals.crossings, totals);
  }
}

void FuzzRun::check_path(const Tick& tick, ProxyFuzzTotals& totals) {
  const Wide share = judge_.radius_m() / kRadius_m;
  const Wide gap = judge_.path_gap_m(tick.before, tick.after);
  ++totals.paths;
  totals.worst_path_m = std::min(totals.worst_path_m, gap / share);
  if (gap < -judge_.allowed_depth_m()) {
    fail(tick, "on the way", "gap " + number_text(gap) + " m", totals.dips, totals);
  }
}

void FuzzRun::check_energy(const Tick& tick, ProxyFuzzTotals& totals) {
  const Wide rise = tick.end_j - tick.start_j;
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  const Wide rounding = 64 * roundoff * (tick.start_j + 1e-6L);
  // One pass may end at its own bound, short of that.
  const bool whole = session_.view().parameters().coupling.passes == kDefaultProxyPasses;
  if (whole && tick.end_j > kAtGoal_j && tick.result.behind_ticks == 0) {
    const Wide unhindered = judge_.unhindered_j(tick.goal, tick.before);
    if (tick.end_j > unhindered + rounding && !judge_.moves(tick.before, tick.after)) {
      fail(tick, "invisible wall",
           number_text(tick.end_j) + " J is left, " + number_text(unhindered) +
               " J after a tenth of a millimetre straight to the goal, and nothing is there",
           totals.walls, totals);
    }
  }
  totals.largest_rise_j = std::max(totals.largest_rise_j, rise);
  totals.largest_rise_share = std::max(totals.largest_rise_share, rise / rounding);
  if (rise > rounding) {
    fail(tick, "energy rises", "by " + number_text(rise) + " J from " + number_text(tick.start_j),
         totals.rises, totals);
  }
}

void FuzzRun::check_output(const Tick& tick, ProxyFuzzTotals& totals) {
  const StepResult& r = tick.result;
  if ((r.flags & kFlagRecovery) != 0) fail(tick, "recovery", "", totals.recoveries, totals);
  const Wide error =
      judge_.wrench_error(r.wrench_w, (r.flags & kFlagHeld) != 0, tick.goal, tick.after);
  constexpr std::uint32_t kRamped = kFlagRecovery | kFlagRamping | kFlagClutched;
  if ((r.flags & kRamped) == 0) {
    totals.largest_wrench_error = std::max(totals.largest_wrench_error, error);
    if (!(error <= 1)) {
      fail(tick, "wrench", "off by " + number_text(error) + " of rounding", totals.wrenches,
           totals);
    }
  }
  const Wide turn = norm(wide_error(tick.goal, tick.before).rotation_rad);
  constexpr Wide limit = 2.8L;
  const WideError offset = wide_error(tick.goal, wide_pose(tick.device));
  const Wide rounding = 64 * widen(std::numeric_limits<Real>::epsilon());
  const bool anchored = turn >= limit - rounding;
  turned_ = turned_ || anchored;
  if (anchored) ++totals.anchored;
  const bool in_place = norm(offset.translation_m) <= rounding;
  const bool as_given = turned_ || norm(offset.rotation_rad) <= rounding;
  if (!in_place || !as_given || turn > limit + rounding) {
    fail(tick, "goal",
         "off the device by " + number_text(norm(offset.translation_m)) + " m, " +
             number_text(norm(offset.rotation_rad)) + " rad, off the proxy by " +
             number_text(turn) + " rad",
         totals.goals, totals);
  }
}

void FuzzRun::check_caps(const Tick& tick, ProxyFuzzTotals& totals) {
  const StepCounters& c = tick.result.counters;
  for (const CounterBound& bound : counter_bounds(c, session_.view().header().capacity)) {
    if (bound.held()) continue;
    fail(tick, "cap", std::string(bound.name) + " " + std::to_string(bound.peak), totals.over_caps,
         totals);
  }
  raise_peaks(c, totals.peaks);
  totals.rejected_passes += c.proxy_rejected;
  if ((tick.result.flags & kFlagProxyLimited) != 0) ++totals.limited;
  if (tick.result.behind_ticks > 0) ++totals.behind;
  totals.longest_behind = std::max<std::uint64_t>(totals.longest_behind, tick.result.behind_ticks);
}

/// Whether a device that stands still has its part at rest: nothing moved, and not for want of
/// budget.
bool FuzzRun::check_rest(const Tick& tick, ProxyFuzzTotals& totals) {
  ++resting_;
  const bool still = tick.result.behind_ticks == 0 && !judge_.moves(tick.before, tick.after);
  if (still) {
    totals.longest_arrival = std::max(totals.longest_arrival, resting_);
  } else if (resting_ > kLongestArrival) {
    fail(tick, "does not arrive", std::to_string(resting_) + " ticks", totals.stuck, totals);
    return true;
  }
  return still;
}

/// Runs of ticks in which the proxy stays where it is: whether it could have followed is asked of
/// each tick of a long run, with the goals that it had. With friction it may rightly stick; then
/// only ticks count of which every pass was rejected.
void FuzzRun::check_still(const Tick& tick, ProxyFuzzTotals& totals) {
  const Wide share = judge_.radius_m() / kRadius_m;
  const WideError move = wide_error(tick.after, tick.before);
  // What waits for budget is another matter: it must arrive where the device rests.
  const bool held = tick.end_j > kAtGoal_j && tick.result.behind_ticks == 0;
  const bool rejected = tick.result.counters.proxy_rejected > 0 &&
                        tick.result.counters.proxy_rejected == tick.result.counters.proxy_passes;
  rejected_ = rejected && held ? rejected_ + 1 : 0;
  totals.longest_rejected = std::max(totals.longest_rejected, rejected_);
  const bool still =
      norm(move.translation_m) + judge_.radius_m() * norm(move.rotation_rad) < 2 * kStill_m * share;
  if (!held || !still) {
    goals_.clear();
    still_ = possible_ = 0;
    return;
  }
  ++still_;
  totals.longest_still = std::max(totals.longest_still, still_);
  if (friction_ > 0) {
    possible_ = rejected_;
  } else {
    goals_.push_back(tick.goal);
    if (still_ < kFirstLook) return;
    for (const WidePose& goal : goals_) {
      possible_ = judge_.could_follow(goal, tick.after) ? possible_ + 1 : 0;
    }
    goals_.clear();
  }
  totals.longest_stall = std::max(totals.longest_stall, possible_);
  if (possible_ > kLongestStall) {
    fail(tick, "stall", std::to_string(possible_) + " ticks", totals.stalls, totals);
  }
}

}  // namespace haptic::sim
