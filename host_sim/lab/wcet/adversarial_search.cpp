// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/wcet/adversarial_search.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "host_sim/lab/wcet/scene_motion.hpp"
#include "host_sim/session/counters_check.hpp"
#include "host_sim/session/tick_clock.hpp"
#include "host_sim/timing/same_state_times.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

constexpr double kNearKnown = 0.01;  // of A's radius, and rad
constexpr double kPositionDigits = 1e9, kQuaternionDigits = 1e12, kTimeDigits = 1e6;

Vector vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

Rotation turned(const Rotation& q, const Vector& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle == 0) return q;
  return (Rotation(Eigen::AngleAxisd(angle, rotation_rad / angle)) * q).normalized();
}

Vector at_most(const Vector& v, double limit) {
  const double length = v.norm();
  return length > limit ? Vector(v * (limit / length)) : v;
}

double rounded(double value, double digits) { return std::round(value * digits) / digits; }

/// Changes in a row without a gain before the climb starts elsewhere.
constexpr std::uint32_t kPatience = 60;

const TickClock& tick_clock() {
  static const TickClock clock;
  return clock;
}

/// Keeps the largest value of a motion's ticks.
class Worst {
 public:
  /// @return whether it is the largest so far.
  bool offer(double value, std::size_t tick) {
    if (value <= value_) return false;
    value_ = value;
    tick_ = tick;
    return true;
  }
  void write(AdversarialFinding& finding) const {
    finding.value = value_;
    finding.tick = tick_;
  }

 private:
  double value_ = 0;
  std::size_t tick_ = 0;
};

void evaluate_time(CoreSession& session, std::span<const MotionSample> motion,
                   AdversarialFinding& finding) {
  std::vector<double> least(motion.size(), std::numeric_limits<double>::infinity());
  for (std::uint32_t r = 0; r < kLeastRepeats; ++r) {
    session.core().reset();
    for (std::size_t i = 0; i < motion.size(); ++i) {
      const StepInput input = input_of(as_read(motion[i]), i);
      StepResult step;
      const double ns = tick_clock().ns_of([&] { step = session.core().step(input); });
      least[i] = std::min(least[i], ns);
      finding.state_hash = step.state_hash;
      finding.not_finite += step.wrench_w.force_w.allFinite() ? 0u : 1u;
    }
  }
  raise_peaks(session.core().peaks(), finding.peaks);
  Worst worst;
  for (std::size_t i = 0; i < least.size(); ++i) worst.offer(least[i], i);
  worst.write(finding);
}

double value_of_tick(AdversarialGoal goal, const StepResult& now, const StepResult& before) {
  switch (goal) {
    case AdversarialGoal::kWork:
      return static_cast<double>(work_units(now.counters));
    case AdversarialGoal::kProxyWork:
      return static_cast<double>(proxy_units(now.counters));
    case AdversarialGoal::kForceStep:
      return static_cast<double>((now.wrench_w.force_w - before.wrench_w.force_w).norm());
    case AdversarialGoal::kTorqueStep:
      return static_cast<double>((now.wrench_w.torque_w - before.wrench_w.torque_w).norm());
    default:
      return 0;
  }
}

double angle_rad(const Quat& from, const Quat& to) {
  return static_cast<double>(from.angularDistance(to));
}

StepCause cause_of(AdversarialGoal goal, const StepResult& now, const StepResult& before,
                   const SceneView& view) {
  const auto part = [&](const Wrench& w) -> Vec3 {
    return goal == AdversarialGoal::kForceStep ? w.force_w : w.torque_w;
  };
  const Vec3 spring = part(now.spring_w) - part(before.spring_w);
  const Vec3 all = part(now.wrench_w) - part(before.wrench_w);
  const double(&grip)[3] = view.bodies()[0].reference_m;
  const Vec3 grip_a(static_cast<Real>(grip[0]), static_cast<Real>(grip[1]),
                    static_cast<Real>(grip[2]));
  const auto moved_m = [&](const Pose& from, const Pose& to) {
    const Vec3 move = (to.p_wa + to.q_wa * grip_a) - (from.p_wa + from.q_wa * grip_a);
    return static_cast<double>(move.norm());
  };
  StepCause cause;
  cause.spring = static_cast<double>(spring.norm());
  cause.damping = static_cast<double>((all - spring).norm());
  cause.goal_m = moved_m(before.goal_pose_wa, now.goal_pose_wa);
  cause.proxy_m = moved_m(before.proxy_pose_wa, now.proxy_pose_wa);
  cause.goal_rad = angle_rad(before.goal_pose_wa.q_wa, now.goal_pose_wa.q_wa);
  cause.proxy_rad = angle_rad(before.proxy_pose_wa.q_wa, now.proxy_pose_wa.q_wa);
  cause.flags = now.flags;
  return cause;
}

/// Whether a time beats `than` a second time: of many times, each the least of a few repeats, the
/// largest would be the one that met most noise. Keeps the lesser.
bool confirmed(CoreSession& session, AdversarialFinding& trial, double than) {
  if (trial.goal != AdversarialGoal::kTime) return true;
  AdversarialFinding again = trial;
  evaluate(session, trial.motion, again);
  if (again.value < trial.value) {
    trial.value = again.value;
    trial.tick = again.tick;
  }
  return trial.value > than;
}

using Clock = std::chrono::steady_clock;

/// Tells how far the search is, about once a second.
class ProgressReport {
 public:
  explicit ProgressReport(const AdversarialLimits& limits) : limits_(limits) {}
  void offer(const AdversarialFinding& best, std::uint64_t evaluations) {
    if (!limits_.progress) return;
    const Clock::time_point now = Clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    limits_.progress(
        {best.goal, best.value, evaluations, std::chrono::duration<double>(now - begin_).count()});
  }

 private:
  const AdversarialLimits& limits_;
  Clock::time_point begin_ = Clock::now(), next_ = begin_ + std::chrono::seconds(1);
};

AdversarialFinding climb(CoreSession& session, const AdversarialSpace& space, AdversarialGoal goal,
                         const AdversarialLimits& limits, double share_s,
                         ProgressReport& progress) {
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(share_s));
  Seeded random(limits.seed * 1000003 + static_cast<std::uint64_t>(goal));
  AdversarialFinding best;
  best.goal = goal;
  best.value = -1;
  AdversarialFinding trial = best;
  AdversarialMotion here;
  double here_value = -1;
  std::uint32_t without_gain = kPatience;
  std::uint64_t evaluations = 0, restarts = 0;
  const auto over = [&] {
    if (limits.evaluations > 0) return evaluations >= limits.evaluations;
    return evaluations > 0 && Clock::now() >= end;
  };
  while (!over()) {
    const bool restart = without_gain >= kPatience;
    restarts += restart && evaluations > 0 ? 1u : 0u;
    const AdversarialMotion next = restart ? space.drawn(random) : space.changed(here, random);
    trial.motion = space.samples(next);
    evaluate(session, trial.motion, trial);
    ++evaluations;
    progress.offer(best, evaluations);
    without_gain = restart || trial.value > here_value ? 0 : without_gain + 1;
    // An equal value is taken too: most of these functions have flats to be crossed.
    if (restart || trial.value >= here_value) {
      here = next;
      here_value = trial.value;
    }
    if (trial.value > best.value && confirmed(session, trial, best.value)) best = trial;
  }
  best.evaluations = evaluations;
  best.restarts = restarts;
  best.peaks = trial.peaks;
  best.not_finite = trial.not_finite;
  return best;
}

}  // namespace

MotionSample as_read(const MotionSample& sample) {
  MotionSample read = sample;
  const double* q = sample.q_wxyz;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& value : read.q_wxyz) value /= length;
  return read;
}

AdversarialSpace::AdversarialSpace(const SceneView& view, std::span<const MotionSample> known)
    : known_(known),
      reference_m_(vector_of(view.bodies()[0].reference_m)),
      radius_m_(moving_radius_m(view)),
      period_s_(1 / view.parameters().rate_hz) {
  low_m_ = high_m_ = reference_m_;
  bool first = true;
  for (const PieceRecord& piece : view.pieces()) {
    if (piece.body == 0) continue;
    const Vector centre =
        vector_of(view.bodies()[piece.body].reference_m) + vector_of(piece.centre_m);
    const Vector reach = Vector::Constant(piece.radius_m);
    low_m_ = first ? Vector(centre - reach) : Vector(low_m_.cwiseMin(centre - reach));
    high_m_ = first ? Vector(centre + reach) : Vector(high_m_.cwiseMax(centre + reach));
    first = false;
  }
}

SegmentVelocity AdversarialSpace::drawn_velocity(Seeded& random) const {
  return {random.uniform(0, kAdversarialSpeed_m_per_s) * random.direction(),
          random.uniform(0, kAdversarialTurn_rad_per_s) * random.direction()};
}

AdversarialMotion AdversarialSpace::drawn(Seeded& random) const {
  AdversarialMotion motion;
  if (random.below(3) < 2) {
    const MotionSample& s = known_[random.below(static_cast<std::uint32_t>(known_.size()))];
    motion.q_wa = turned(Rotation(s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]).normalized(),
                         random.uniform(0, kNearKnown) * random.direction());
    motion.p_wr = vector_of(s.p) + motion.q_wa * reference_m_ +
                  random.uniform(0, kNearKnown * radius_m_) * random.direction();
  } else {
    for (int i = 0; i < 3; ++i) motion.p_wr[i] = random.uniform(low_m_[i], high_m_[i]);
    motion.q_wa = random.rotation();
  }
  for (SegmentVelocity& segment : motion.segments) segment = drawn_velocity(random);
  return motion;
}

AdversarialMotion AdversarialSpace::changed(const AdversarialMotion& motion, Seeded& random) const {
  AdversarialMotion other = motion;
  const double share = std::pow(10.0, random.uniform(-6, 0));
  const std::uint32_t what = random.below(5);
  if (what <= 1) other.p_wr += share * radius_m_ * random.direction();
  if (what >= 1 && what <= 2) other.q_wa = turned(other.q_wa, share * random.direction());
  if (what < 3) return other;
  SegmentVelocity& segment = other.segments[random.below(kMotionSegments)];
  if (what == 4) {
    segment = drawn_velocity(random);
    return other;
  }
  segment.v_m_per_s =
      at_most(segment.v_m_per_s + share * kAdversarialSpeed_m_per_s * random.direction(),
              kAdversarialSpeed_m_per_s);
  segment.w_rad_per_s =
      at_most(segment.w_rad_per_s + share * kAdversarialTurn_rad_per_s * random.direction(),
              kAdversarialTurn_rad_per_s);
  return other;
}

std::vector<MotionSample> AdversarialSpace::samples(const AdversarialMotion& motion) const {
  std::vector<MotionSample> list;
  Vector p = motion.p_wr;
  Rotation q = motion.q_wa;
  for (std::size_t tick = 0; tick < kMotionSegments * kSegmentTicks; ++tick) {
    MotionSample sample = sample_at(static_cast<double>(tick) * period_s_, p - q * reference_m_, q);
    sample.t_s = rounded(sample.t_s, kTimeDigits);
    for (double& value : sample.p) value = rounded(value, kPositionDigits);
    for (double& value : sample.q_wxyz) value = rounded(value, kQuaternionDigits);
    list.push_back(sample);
    const SegmentVelocity& segment = motion.segments[tick / kSegmentTicks];
    p += period_s_ * segment.v_m_per_s;
    q = turned(q, period_s_ * segment.w_rad_per_s);
  }
  return list;
}

const char* to_text(AdversarialGoal goal) {
  constexpr const char* kNames[] = {
      "work", "time", "force_step", "torque_step", "situation_changes", "proxy_work"};
  static_assert(std::size(kNames) == std::size(kAdversarialGoals));
  return kNames[static_cast<std::size_t>(goal)];
}

const char* unit_of(AdversarialGoal goal) {
  constexpr const char* kUnits[] = {"units", "ns", "N", "N m", "changes", "units"};
  static_assert(std::size(kUnits) == std::size(kAdversarialGoals));
  return kUnits[static_cast<std::size_t>(goal)];
}

std::vector<AdversarialGoal> goals_of(const SceneView& view) {
  std::vector<AdversarialGoal> goals(std::begin(kAdversarialGoals), std::end(kAdversarialGoals));
  if (view.parameters().law != LawId::kProxy) std::erase(goals, AdversarialGoal::kProxyWork);
  return goals;
}

void evaluate(CoreSession& session, std::span<const MotionSample> motion,
              AdversarialFinding& finding) {
  if (finding.goal == AdversarialGoal::kTime) {
    evaluate_time(session, motion, finding);
    return;
  }
  const bool first_counts =
      finding.goal == AdversarialGoal::kWork || finding.goal == AdversarialGoal::kProxyWork;
  const bool is_step =
      finding.goal == AdversarialGoal::kForceStep || finding.goal == AdversarialGoal::kTorqueStep;
  // The work of the search at the goal pose: only where it is asked for is there any.
  const GoalContact asked =
      finding.goal == AdversarialGoal::kWork ? GoalContact::kAsked : GoalContact::kLeftOut;
  session.core().reset();
  StepResult before;
  Worst worst;
  std::uint64_t changes = 0;
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const StepResult now = session.core().step(input_of(as_read(motion[i]), i, asked));
    const bool finite = now.wrench_w.force_w.allFinite() && now.wrench_w.torque_w.allFinite();
    finding.not_finite += finite ? 0u : 1u;
    if ((i > 0 || first_counts) && worst.offer(value_of_tick(finding.goal, now, before), i) &&
        is_step) {
      finding.cause = cause_of(finding.goal, now, before, session.view());
    }
    changes += i > 0 && now.situation != before.situation ? 1u : 0u;
    before = now;
  }
  raise_peaks(session.core().peaks(), finding.peaks);
  worst.write(finding);
  if (finding.goal == AdversarialGoal::kSituationChanges)
    finding.value = static_cast<double>(changes);
  finding.state_hash = before.state_hash;
}

std::vector<AdversarialFinding> adversarial_search(CoreSession& session,
                                                   std::span<const MotionSample> known,
                                                   const AdversarialLimits& limits) {
  if (known.empty()) throw tools::InputError("no poses to begin an adversarial search from");
  const AdversarialSpace space(session.view(), known);
  const std::vector<AdversarialGoal> goals = goals_of(session.view());
  const double share_s = limits.seconds / static_cast<double>(goals.size());
  std::vector<AdversarialFinding> findings;
  ProgressReport progress(limits);
  for (const AdversarialGoal goal : goals)
    findings.push_back(climb(session, space, goal, limits, share_s, progress));
  session.core().reset();
  return findings;
}

}  // namespace haptic::sim
