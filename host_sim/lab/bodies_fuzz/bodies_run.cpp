// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "host_sim/report/shard_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Bodies start this many tolerances apart.
constexpr Wide kClearTolerances = 1000;
constexpr int kStartTrials = 60;
/// Energy below which a hand counts as at its goal [J].
constexpr Wide kAtGoalOfHand_j = 1e-9L;
constexpr Wide kRestlessShift_m = 2e-6L;
/// A run that has been too deep so often ends: to judge deep ways takes long.
constexpr std::uint64_t kMostDeep = 100;
/// Roundings that the sum of the energies may rise by.
constexpr Wide kEnergyRoundings = 64, kPullRoundings = 16;

const Wide kRoundoff = widen(std::numeric_limits<Real>::epsilon());

std::vector<WidePose> wide_poses(std::span<const GripPose> poses) {
  std::vector<WidePose> wide;
  for (const GripPose& pose : poses) wide.push_back(wide_pose(pose_of(pose)));
  return wide;
}

bool is_same(const WidePose& one, const WidePose& other) {
  return norm(one.p - other.p) == 0 && std::ranges::equal(one.q_wxyz, other.q_wxyz);
}

GripPose as_grip_pose(const BodyPlace& place) { return grip_pose_at(place.p, place.q); }

}  // namespace

void BodiesTotals::add(const BodiesTotals& other) {
  using T = BodiesTotals;
  for (const auto field :
       {&T::ticks,   &T::held,     &T::deep,           &T::dips,          &T::rises,
        &T::springs, &T::sums,     &T::unbalanced,     &T::stuck,         &T::recoveries,
        &T::over,    &T::infinite, &T::hand_ticks,     &T::refused,       &T::ways,
        &T::summed,  &T::rests,    &T::rejected_ticks, &T::limited_ticks, &T::spent_ticks}) {
    this->*field += other.*field;
  }
  for (const auto field : {&T::longest_rejected, &T::longest_arrival, &T::peak_units, &T::peak_rows,
                           &T::peak_rounds, &T::peak_steps, &T::units_bound, &T::peak_ns}) {
    this->*field = std::max(this->*field, other.*field);
  }
  for (const auto field : {&T::worst_gap_m, &T::worst_way_m}) {
    this->*field = std::min(this->*field, other.*field);
  }
  for (const auto field : {&T::largest_rise_j, &T::largest_rise_share, &T::largest_sum_n,
                           &T::largest_rest_n, &T::largest_lever_m, &T::largest_lag_m}) {
    this->*field = std::max(this->*field, other.*field);
  }
  failures.add(other.failures);
}

BodiesRun::BodiesRun(const CompiledBodies& compiled, const std::string& label,
                     std::uint32_t work_units, std::optional<BodiesFault> fault)
    : scene_(compiled.scene),
      has_loose_(std::ranges::any_of(
          scene_.bodies, [](const FuzzBody& body) { return body.role == BodyRole::kLoose; })),
      session_(compiled, work_units, fault),
      judge_(compiled),
      scene_label_(label),
      fault_(fault) {}

/// At random where the goals go. A body that finds no room there is at its own start as its carrier
/// sees it; without a carrier, all are at theirs.
std::vector<BodyPlace> BodiesRun::draw_starts(Seeded& random) {
  const Wide clear_m = kClearTolerances * judge_.tolerance_m();
  std::vector<BodyPlace> places(scene_.bodies.size());
  std::vector<WidePose> poses(places.size());
  const auto put = [&](std::size_t body, const BodyPlace& place) {
    const std::size_t carrier = scene_.bodies[body].range.carrier;
    places[body] = carrier == kNoCarrier ? place : carried_by(places[carrier], place);
    poses[body] = wide_pose(pose_of(as_grip_pose(places[body])));
    return judge_.clear_of_earlier_m(body, poses, clear_m) >= clear_m;
  };
  const auto drawn = [&](std::size_t body) {
    const BodyRange& range = scene_.bodies[body].range;
    BodyPlace place;
    for (int i = 0; i < 3; ++i)
      place.p[i] = range.home[i] + random.uniform(-range.reach_m[i], range.reach_m[i]);
    place.q = Rotation(Eigen::AngleAxisd(random.uniform(-range.tilt_rad, range.tilt_rad),
                                         random.direction())) *
              range.turn;
    return place;
  };
  const auto put_at_start = [&](std::size_t body) {
    return put(body, {scene_.bodies[body].start, scene_.bodies[body].start_turn});
  };
  if (scene_.keeps_starts) {
    for (std::size_t body = 0; body < places.size(); ++body) static_cast<void>(put_at_start(body));
    const Wide allowed_m = judge_.allowed_depth_m();
    const BodiesJudge::PairGap found = judge_.end_gap(poses, -allowed_m);
    if (found.gap_m >= -allowed_m) return places;
    throw tools::InputError(scene_.name + ": " + judge_.name_of(found.pair) +
                            " start in each other; compile the scene again");
  }
  std::size_t placed = 0;
  for (; placed < places.size(); ++placed) {
    int trials = kStartTrials;
    while (trials > 0 && !put(placed, drawn(placed))) --trials;
    if (trials > 0) continue;
    if (scene_.bodies[placed].range.carrier == kNoCarrier || !put_at_start(placed)) break;
  }
  if (placed == places.size()) return places;
  for (std::size_t body = 0; body < places.size(); ++body) {
    if (put_at_start(body)) continue;
    throw tools::InputError(scene_.name + ": " + scene_.bodies[body].name + " does not start free");
  }
  return places;
}

BodiesTotals BodiesRun::run(std::uint64_t ticks, std::uint64_t seed, std::uint64_t number) {
  BodiesTotals totals;
  Seeded random(seed_of(seed, number));
  const std::vector<BodyPlace> starts = draw_starts(random);
  BodiesMotion motion(scene_, starts, random.below(1u << 30));
  label_ = scene_label_ + ", seed " + std::to_string(seed) + ", run " + std::to_string(number);
  Tick tick;
  for (const BodyPlace& place : starts) tick.goals.push_back(as_grip_pose(place));
  session_.begin(tick.goals);
  tick.after = tick.wide_goals = wide_poses(tick.goals);
  resting_ = still_ = rejected_ = 0;
  bool rests = false;
  for (std::uint64_t t = 0; t < ticks || !rests; ++t) {
    tick.number = t;
    if (t < ticks) std::ranges::transform(motion.next(), tick.goals.begin(), as_grip_pose);
    tick.before = tick.after;
    tick.goals_before = tick.wide_goals;
    const auto start = std::chrono::steady_clock::now();
    tick.told = session_.tick(tick.goals);
    tick.ns = static_cast<std::uint64_t>(
        std::chrono::nanoseconds(std::chrono::steady_clock::now() - start).count());
    ++totals.ticks;
    if (!is_finite_tick(tick)) {
      fail(tick, "not finite", "", totals.infinite, totals);
      return totals;
    }
    look(tick);
    check_ways(tick, totals);
    check_free(tick, totals);
    check_energy(tick, totals);
    check_springs(tick, totals);
    check_sums(tick, totals);
    note_work(tick, totals);
    if (totals.deep >= kMostDeep) return totals;
    if (t >= ticks) rests = check_rest(tick, totals);
    session_.release_anchors();
  }
  return totals;
}

bool BodiesRun::is_finite_tick(const Tick& tick) const {
  const BodyLaw& law = session_.law();
  for (std::uint32_t k = 0; k < law.body_count(); ++k) {
    const GripPose& pose = law.pose(k);
    if (!is_finite(pose.x0_w) || !is_orientation(pose.q_wa) || !is_finite(law.contact_w(k)))
      return false;
  }
  return std::isfinite(tick.told.start_potential_j) && std::isfinite(tick.told.end_potential_j);
}

/// Takes the poses of the end, or what a fault makes of them.
void BodiesRun::look(Tick& tick) {
  const BodyLaw& law = session_.law();
  tick.wide_goals = wide_poses(tick.goals);
  for (std::uint32_t k = 0; k < law.body_count(); ++k)
    tick.after[k] = wide_pose(pose_of(law.pose(k)));
  if (fault_ == BodiesFault::kGoal) tick.after = tick.wide_goals;
  if (fault_ == BodiesFault::kRestless && tick.number % 2 == 1) {
    const WideVec pull = wide_error(tick.wide_goals[0], tick.after[0]).translation_m;
    const Wide length = norm(pull);
    const WideVec away = length > 0 ? (-1 / length) * pull : WideVec{0, 0, 1};
    tick.after[0].p = tick.after[0].p + kRestlessShift_m * away;
  }
  tick.steps.clear();
  for (std::uint32_t k = 0; k < law.steps_of_tick(); ++k)
    tick.steps.push_back(wide_poses(law.after_step(k)));
  if (fault_ && !tick.steps.empty()) tick.steps.back() = tick.after;
}

void BodiesRun::fail(const Tick& tick, const char* kind, const std::string& what,
                     std::uint64_t& count, BodiesTotals& totals) const {
  ++count;
  std::string text = what;
  for (std::size_t k = scene_.bodies.size(); k-- > 0;) {
    const Pose pose = pose_of(session_.law().pose(static_cast<std::uint32_t>(k)));
    text = failure_text("its goal", pose_of(tick.goals[k]), text);
    text = failure_text(std::string(to_text(scene_.bodies[k].role)) + " " + scene_.bodies[k].name,
                        pose, text);
  }
  totals.failures.add(kind, label_ + ", tick " + std::to_string(tick.number) + ", " + text);
}

void BodiesRun::check_free(const Tick& tick, BodiesTotals& totals) {
  const Wide allowed = judge_.allowed_depth_m();
  // Deeper than seen so far: then it is worth the search for the distance itself.
  const Wide worst = std::max(totals.worst_gap_m * judge_.tolerance_m(), -allowed);
  const BodiesJudge::PairGap found = judge_.end_gap(tick.after, worst);
  totals.worst_gap_m = std::min(totals.worst_gap_m, found.gap_m / judge_.tolerance_m());
  if (found.gap_m >= -allowed) return;
  fail(tick, "not free", judge_.name_of(found.pair) + ", gap " + number_text(found.gap_m) + " m",
       totals.deep, totals);
}

/// The way of every step, each pair's own: straight as the second body sees the first.
void BodiesRun::check_ways(const Tick& tick, BodiesTotals& totals) {
  const std::vector<WidePose>* from = &tick.before;
  for (std::size_t k = 0; k < tick.steps.size(); ++k) {
    const BodiesJudge::PairGap found = judge_.way_gap(*from, tick.steps[k]);
    from = &tick.steps[k];
    ++totals.ways;
    totals.worst_way_m = std::min(totals.worst_way_m, found.gap_m / judge_.tolerance_m());
    if (found.gap_m >= -judge_.allowed_depth_m()) continue;
    fail(tick, "on the way",
         judge_.name_of(found.pair) + ", step " + std::to_string(k) + ", gap " +
             number_text(found.gap_m) + " m",
         totals.dips, totals);
  }
  if (std::ranges::equal(tick.after, *from, is_same)) return;
  fail(tick, "moves without a step", "", totals.dips, totals);
}

WidePull BodiesRun::pull_of(std::size_t body, const Tick& tick) const {
  return wide_pull(session_.bodies()[body].spring,
                   wide_error(tick.wide_goals[body], tick.after[body]));
}

/// The sum of the energies may rise by rounding: of itself, and of coordinates under the pulls. A
/// surface is held off by a skin, which may be closed at the cost of a tolerance under them.
void BodiesRun::check_energy(const Tick& tick, BodiesTotals& totals) {
  Wide start_j = 0, end_j = 0, rounding_j = 0, pull_n = 0;
  bool held = false;
  for (std::size_t k = 0; k < scene_.bodies.size(); ++k) {
    const Spring& spring = session_.bodies()[k].spring;
    const WidePull from = wide_pull(spring, wide_error(tick.wide_goals[k], tick.before[k]));
    const WideError error = wide_error(tick.wide_goals[k], tick.after[k]);
    const WidePull to = wide_pull(spring, error);
    start_j += from.energy_j;
    end_j += to.energy_j;
    const Wide force = std::max(norm(from.force), norm(to.force));
    const Wide torque = std::max(norm(from.torque), norm(to.torque));
    rounding_j += kPullRoundings * kRoundoff * (force * judge_.extent_m() + torque);
    pull_n += force + torque / widen(spring.length_m);
    const BodyRole role = scene_.bodies[k].role;
    held = held || (role == BodyRole::kHand && to.energy_j > kAtGoalOfHand_j);
    if (role == BodyRole::kDriver)
      totals.largest_lag_m = std::max(totals.largest_lag_m, norm(error.translation_m));
  }
  if (held) ++totals.held;
  Wide bound = rounding_j + kEnergyRoundings * kRoundoff * (start_j + 1e-6L);
  if (judge_.has_surfaces()) bound += judge_.tolerance_m() * pull_n;
  const Wide rise = end_j - start_j;
  totals.largest_rise_j = std::max(totals.largest_rise_j, rise);
  totals.largest_rise_share = std::max(totals.largest_rise_share, rise / bound);
  if (rise <= bound) return;
  fail(tick, "energy rises", "by " + number_text(rise) + " J from " + number_text(start_j),
       totals.rises, totals);
}

}  // namespace haptic::sim
