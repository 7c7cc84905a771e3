// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/surface_fuzz/surface_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/lab/proxy_fuzz/fuzz_run.hpp"
#include "host_sim/report/shard_run.hpp"
#include "host_sim/session/counters_check.hpp"

namespace haptic::sim {
namespace {

constexpr Wide kJudgedRadius_m = 0.05L, kTolerance_m = 1e-7L;
/// A part arrives within this many ticks of the device's standing still.
constexpr std::uint64_t kLongestArrival = 4000;
/// At rest it moves less than this in each of so many ticks, for a part of 50 mm.
constexpr Wide kStill_m = 1e-6L;
constexpr std::uint64_t kStillTicks = 5;
/// Energy below which the part counts as at its goal [J].
constexpr Wide kAtGoal_j = 1e-9L;
/// A part at rest off its goal is within so many tolerances of what holds it.
constexpr Wide kTouching = 20;
constexpr Wide kDisplacement_m = 20e-6L, kRestless_m = 2e-6L;

std::vector<Triangle> about_grip(std::vector<Triangle> triangles, const WideVec& grip) {
  for (Triangle& t : triangles) {
    for (WideVec& v : t) v = v - grip;
  }
  return triangles;
}

std::vector<Triangle> displaced(std::vector<Triangle> triangles, const WideVec& by) {
  for (Triangle& t : triangles) {
    for (WideVec& v : t) v = v + by;
  }
  return triangles;
}

WideVec grip_of(const SceneView& view) {
  const double* grip = view.bodies()[0].reference_m;
  return {widen(grip[0]), widen(grip[1]), widen(grip[2])};
}

bool finite(const Pose& pose) {
  return is_finite(pose.p_wa) && std::isfinite(pose.q_wa.squaredNorm());
}

Rotation about(const Vector& axis, double angle_rad) {
  return Rotation(Eigen::AngleAxisd(angle_rad, axis));
}

/// A unit vector square to another.
Vector square_to(const Vector& axis, Seeded& random) {
  const Vector v = random.direction();
  const Vector across = axis.cross(v);
  return across.norm() > 1e-3 ? across.normalized() : axis.unitOrthogonal();
}

}  // namespace

const char* to_text(SurfaceMotionKind kind) {
  switch (kind) {
    case SurfaceMotionKind::kSmooth:
      return "smooth";
    case SurfaceMotionKind::kWild:
      return "wild";
    case SurfaceMotionKind::kPress:
      return "press";
    case SurfaceMotionKind::kDrag:
      return "drag";
    case SurfaceMotionKind::kHole:
      break;
  }
  return "hole";
}

std::optional<SurfaceFault> surface_fault_named(const std::string& name) {
  if (name == "displaced") return SurfaceFault::kDisplaced;
  if (name == "goal") return SurfaceFault::kGoal;
  if (name == "restless") return SurfaceFault::kRestless;
  if (name == "certificate") return SurfaceFault::kCertificate;
  return std::nullopt;
}

SurfaceMotion::SurfaceMotion(const Surroundings& around, SurfaceMotionKind kind, std::uint64_t seed)
    : around_(around), kind_(kind), random_(seed) {
  // Outside of the sphere about the obstacle: free, and outside of every closed shell.
  const double clear_m = around_.extent_m + around_.radius_m + 0.1 * around_.radius_m;
  const bool along = kind == SurfaceMotionKind::kPress || kind == SurfaceMotionKind::kHole;
  const Vector side = along ? around_.through_axis : random_.direction();
  p_ = clear_m * side;
  const bool upright = along || random_.below(4) == 0;
  q_ = upright ? Rotation::Identity() : random_.rotation();
  draw_aim();
}

/// The next place to go to, how fast, and how it turns on the way.
void SurfaceMotion::draw_aim() {
  ++aims_;
  const Vector axis = around_.through_axis;
  turn_to_ = q_;
  speed_m_ = random_.uniform(0.1, 0.3) * kMotionPeriod_s;
  swing_rad_ = 0;
  switch (kind_) {
    case SurfaceMotionKind::kSmooth:
    case SurfaceMotionKind::kWild:
      aim_ = random_.uniform(0, 1) * (around_.extent_m + around_.radius_m) * random_.direction();
      turn_to_ = about(random_.direction(), random_.uniform(-1.5, 1.5)) * q_;
      spin_ = random_.direction();
      swing_rad_ = random_.uniform(0, 0.1);
      return;
    case SurfaceMotionKind::kPress: {
      // Press, back, and round to the other side, where the next turn presses.
      const std::uint64_t leg = (aims_ - 1) % 4;
      const double side = (aims_ - 1) / 4 % 2 == 0 ? -1 : 1;
      const double far_m = around_.extent_m + 1.1 * around_.radius_m;
      if (leg > 0) speed_m_ = 1.0 * kMotionPeriod_s;
      if (leg == 0) {
        const Vector across =
            0.3 * around_.extent_m * random_.uniform(-1, 1) * square_to(axis, random_);
        aim_ = around_.through_at + across + side * 0.04 * axis;
      } else if (leg == 2) {
        aim_ = far_m * square_to(axis, random_);
      } else {
        aim_ = (leg == 1 ? -side : side) * far_m * axis;
      }
      return;
    }
    case SurfaceMotionKind::kDrag: {
      const Vector across = square_to(axis, random_);
      const double in_m = random_.uniform(0.002, 0.008);
      aim_ = around_.extent_m * random_.uniform(-1.2, 1.2) * across +
             (around_.radius_m * random_.uniform(0, 1) - in_m) * axis;
      swing_rad_ = random_.uniform(0, 0.05);
      spin_ = random_.direction();
      return;
    }
    case SurfaceMotionKind::kHole: {
      const bool leaves = aims_ % 4 == 0;
      const double depth = leaves ? 1.2 : random_.uniform(-1, 0.3);
      aim_ = around_.through_at + depth * (around_.extent_m + around_.radius_m) * axis;
      if (!leaves && random_.below(2) == 0) {
        aim_ += random_.uniform(0, 0.01) * square_to(axis, random_);
      }
      turn_to_ = about(random_.direction(), random_.uniform(-0.1, 0.1)) *
                 about(axis, random_.uniform(-1, 1));
      spin_ = random_.direction();
      swing_rad_ = random_.uniform(0, 0.05);
      return;
    }
  }
}

Pose SurfaceMotion::next() {
  ++tick_;
  const Vector way = aim_ - p_;
  const double distance = way.norm();
  if (distance <= speed_m_) {
    p_ = aim_;
    draw_aim();
  } else {
    p_ += way * (speed_m_ / distance);
  }
  const double angle = q_.angularDistance(turn_to_);
  if (angle > 0) q_ = q_.slerp(std::min(1.0, 1.0 * kMotionPeriod_s / angle), turn_to_).normalized();
  const auto t = static_cast<double>(tick_) * kMotionPeriod_s;
  if (kind_ != SurfaceMotionKind::kWild) {
    // A wobble of 3 Hz, from nothing at the start.
    const double swing = swing_rad_ * std::min(1.0, 2 * t) * std::sin(18.85 * t);
    return pose_at(p_, (about(spin_, swing) * q_).normalized());
  }
  if (tick_ % 20 == 0) jump_ = random_.uniform(0, 0.04) * random_.direction();
  q_ = (about(spin_, 20 * kMotionPeriod_s) * q_).normalized();
  turn_to_ = q_;
  return pose_at(p_ + jump_, q_);
}

void SurfaceMotion::begin_at(const Vector& p) { p_ = p; }

void SurfaceTotals::add(const SurfaceTotals& other) {
  using T = SurfaceTotals;
  for (const auto field : {&T::ticks, &T::held, &T::deep, &T::passages, &T::rises, &T::unarrived,
                           &T::walls, &T::infinite, &T::over_caps, &T::recoveries, &T::ways,
                           &T::unproven, &T::meeting, &T::behind}) {
    this->*field += other.*field;
  }
  worst_gap_m = std::min(worst_gap_m, other.worst_gap_m);
  worst_way_m = std::min(worst_way_m, other.worst_way_m);
  largest_rise_j = std::max(largest_rise_j, other.largest_rise_j);
  largest_rest_gap_m = std::max(largest_rest_gap_m, other.largest_rest_gap_m);
  longest_arrival = std::max(longest_arrival, other.longest_arrival);
  failures.add(other.failures);
}

/// What one tick was given and returned, with the poses in long double.
struct SurfaceRun::Tick {
  std::uint64_t number = 0;
  StepResult result;
  WidePose before, after, goal;
};

SurfaceRun::SurfaceRun(const CompiledSurface& scene, const SurfaceMotion::Surroundings& way,
                       const std::string& label, bool strict, std::optional<SurfaceFault> fault)
    : session_(scene.blob, scene.name, GoalContact::kLeftOut),
      grip_(grip_of(session_.view())),
      meshes_(about_grip(scene.moving, grip_),
              fault == SurfaceFault::kDisplaced
                  ? displaced(scene.fixed, kDisplacement_m * unit(WideVec{1, 2, 3}))
                  : scene.fixed),
      around_(way),
      scene_label_(label),
      fault_(fault) {
  around_.extent_m = static_cast<double>(meshes_.extent_m());
  around_.radius_m = static_cast<double>(meshes_.radius_m());
  const double* start = session_.view().parameters().start_p_wa_m;
  const Wide from_start = norm(WideVec{widen(start[0]), widen(start[1]), widen(start[2])});
  const Wide extent = std::max(meshes_.extent_m(), from_start);
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  const Wide radius = meshes_.radius_m();
  const Wide given = widen(session_.view().parameters().coupling.tolerance_m);
  tolerance_m_ = std::max(given > 0 ? given : kTolerance_m * radius / kJudgedRadius_m,
                          64.5L * roundoff * (radius + extent));
  allowed_m_ = 8 * roundoff * (radius + extent) + widen(scene.moved_m);
  if (!strict) allowed_m_ += tolerance_m_;
  if (fault_ == SurfaceFault::kCertificate) damage(session_, ProxyFault::kCertificate);
}

OraclePose SurfaceRun::grip_pose(const WidePose& pose) const {
  return {pose.r, pose.p + pose.r * grip_};
}

/// Energy of the coupling's spring, which saturates.
Wide SurfaceRun::potential_j(const WideError& error) const {
  const CouplingParameters& c = session_.view().parameters().coupling;
  const auto spring = [](Wide k, Wide x, Wide limit) {
    return limit > 0 && x > limit ? k * limit * (x - limit / 2) : k * x * x / 2;
  };
  return spring(widen(c.k_t_n_per_m), norm(error.translation_m), widen(c.max_translation_error_m)) +
         spring(widen(c.k_r_nm_per_rad), norm(error.rotation_rad), widen(c.max_rotation_error_rad));
}

/// Straight towards the obstacle, by what is free each time: near it, and still outside.
void SurfaceRun::approach(SurfaceMotion& motion) const {
  const double clear_m = 0.02 * around_.radius_m;
  const Pose far = motion.start();
  const Vector from = far.p_wa.cast<double>();
  const double whole_m = from.norm();
  double left_m = whole_m;
  for (int step = 0; step < 100 && left_m > 0.3 * whole_m; ++step) {
    Pose pose = far;
    pose.p_wa = (from * (left_m / whole_m)).cast<Real>();
    const Wide gap = meshes_.distance_m(grip_pose(wide_pose(pose)), widen(whole_m));
    const double free_m = static_cast<double>(gap) - clear_m;
    if (free_m < 0.1 * clear_m) break;
    left_m -= free_m;
  }
  motion.begin_at(from * (std::max(left_m, 0.3 * whole_m) / whole_m));
}

SurfaceTotals SurfaceRun::run(SurfaceMotionKind kind, std::uint64_t ticks, std::uint64_t seed,
                              std::uint64_t number, std::vector<MotionSample>* poses) {
  SurfaceMotion motion(around_, kind, seed_of(seed, number));
  approach(motion);
  label_ = scene_label_ + ", " + to_text(kind) + ", seed " + std::to_string(seed) + ", run " +
           std::to_string(number);
  return judge(
      ticks, [&](std::uint64_t t) { return t == 0 ? motion.start() : motion.next(); }, poses);
}

SurfaceTotals SurfaceRun::run(std::span<const MotionSample> motion) {
  label_ = scene_label_ + ", given motion";
  return judge(
      motion.size(),
      [&](std::uint64_t t) {
        const MotionSample& at = motion[t];
        return pose_at(Vector(at.p[0], at.p[1], at.p[2]),
                       Rotation(at.q_wxyz[0], at.q_wxyz[1], at.q_wxyz[2], at.q_wxyz[3]));
      },
      nullptr);
}

SurfaceTotals SurfaceRun::judge(std::uint64_t ticks,
                                const std::function<Pose(std::uint64_t)>& pose_at,
                                std::vector<MotionSample>* poses) {
  SurfaceTotals totals;
  HapticCore& core = session_.core();
  core.reset();
  StepInput input;
  Tick tick;
  const bool one_pass = session_.view().parameters().coupling.passes == 1;
  bool rests = false;
  std::uint64_t resting = 0;
  still_ = 0;
  for (std::uint64_t t = 0; t < ticks || !rests; ++t) {
    tick.number = t;
    if (t < ticks) input.pose_wa = pose_at(t);
    ++input.sequence;
    if (poses != nullptr) {
      poses->push_back(sample_at(static_cast<double>(t) * kMotionPeriod_s,
                                 input.pose_wa.p_wa.cast<double>(),
                                 input.pose_wa.q_wa.cast<double>()));
    }
    tick.result = core.step(input);
    ++totals.ticks;
    const bool sound = finite(tick.result.goal_pose_wa) && finite(tick.result.proxy_pose_wa) &&
                       is_finite(tick.result.wrench_w);
    if (!sound) {
      fail(tick, "not finite", "", totals.infinite, totals);
      return totals;
    }
    tick.goal = wide_pose(tick.result.goal_pose_wa);
    tick.before = t == 0 ? tick.goal : tick.after;
    tick.after = wide_pose(tick.result.proxy_pose_wa);
    if (fault_ == SurfaceFault::kGoal) tick.after = tick.goal;
    if (fault_ == SurfaceFault::kRestless && t % 2 == 1) {
      const WideVec pull = wide_error(tick.goal, tick.after).translation_m;
      const Wide length = norm(pull);
      const Wide shift = std::max(kRestless_m, 20 * tolerance_m_);
      if (length > 0) tick.after.p = tick.after.p - (shift / length) * pull;
    }
    check_free(tick, totals);
    if (one_pass) check_way(tick, totals);
    check_energy(tick, totals);
    check_counts(tick, totals);
    if (t >= ticks) rests = check_rest(tick, ++resting, totals);
  }
  return totals;
}

void SurfaceRun::fail(const Tick& tick, const char* kind, const std::string& what,
                      std::uint64_t& count, SurfaceTotals& totals) const {
  ++count;
  totals.failures.add(kind, tick_failure_text(label_, tick.number, tick.result.proxy_pose_wa,
                                              tick.result.goal_pose_wa, what));
}

void SurfaceRun::check_free(const Tick& tick, SurfaceTotals& totals) {
  const MeshCrossing crossing = meshes_.crossing(grip_pose(tick.after));
  if (crossing.meeting > 0) ++totals.meeting;
  totals.worst_gap_m =
      std::min(totals.worst_gap_m, -crossing.depth_m * kJudgedRadius_m / meshes_.radius_m());
  if (crossing.depth_m <= allowed_m_) return;
  fail(tick, "not free",
       "triangles " + std::to_string(crossing.moving) + " and " + std::to_string(crossing.fixed) +
           " cross by " + number_text(crossing.depth_m) + " m",
       totals.deep, totals);
}

void SurfaceRun::check_way(const Tick& tick, SurfaceTotals& totals) {
  const OraclePose from = grip_pose(tick.before);
  const WideError turn = wide_error(tick.after, tick.before);
  const StraightWay way{from, grip_pose(tick.after).x - from.x, turn.rotation_rad};
  ++totals.ways;
  if (!(norm(way.move_m) + norm(way.turn_rad) * meshes_.radius_m() > 0)) return;
  const MeshPassage passage = meshes_.passage(way, allowed_m_, tolerance_m_ / 50);
  totals.unproven += passage.unproven;
  totals.worst_way_m =
      std::min(totals.worst_way_m, passage.gap_m * kJudgedRadius_m / meshes_.radius_m());
  if (passage.gap_m >= -allowed_m_) return;
  fail(tick, "on the way",
       "triangles " + std::to_string(passage.moving) + " and " + std::to_string(passage.fixed) +
           " cross by " + number_text(-passage.gap_m) + " m",
       totals.passages, totals);
}

/// The energy may rise by what the tolerance and rounding allow under the present pull.
void SurfaceRun::check_energy(const Tick& tick, SurfaceTotals& totals) {
  const auto error_of = [&](const WidePose& pose) {
    WideError error = wide_error(tick.goal, pose);
    error.translation_m = grip_pose(tick.goal).x - grip_pose(pose).x;
    return error;
  };
  const WideError error = error_of(tick.before);
  const Wide start_j = potential_j(error), end_j = potential_j(error_of(tick.after));
  if (end_j > kAtGoal_j) ++totals.held;
  const CouplingParameters& c = session_.view().parameters().coupling;
  const Wide pull_n = widen(c.k_t_n_per_m) * norm(error.translation_m) +
                      widen(c.k_r_nm_per_rad) * norm(error.rotation_rad) / meshes_.radius_m();
  const Wide roundoff = widen(std::numeric_limits<Real>::epsilon());
  const Wide bound = 64 * roundoff * (start_j + 1e-6L) + tolerance_m_ * pull_n;
  const Wide rise = end_j - start_j;
  totals.largest_rise_j = std::max(totals.largest_rise_j, rise);
  if (rise <= bound) return;
  fail(tick, "energy rises", "by " + number_text(rise) + " J from " + number_text(start_j),
       totals.rises, totals);
}

void SurfaceRun::check_counts(const Tick& tick, SurfaceTotals& totals) {
  const StepResult& r = tick.result;
  if ((r.flags & kFlagRecovery) != 0) fail(tick, "recovery", "", totals.recoveries, totals);
  if (r.behind_ticks > 0) ++totals.behind;
  for (const CounterBound& bound : counter_bounds(r.counters, session_.view().header().capacity)) {
    if (bound.held()) continue;
    fail(tick, "cap", std::string(bound.name) + " " + std::to_string(bound.peak), totals.over_caps,
         totals);
  }
}

/// Whether the run may end: the part is at rest, or does not come to rest.
bool SurfaceRun::check_rest(const Tick& tick, std::uint64_t resting, SurfaceTotals& totals) {
  const WideError move = wide_error(tick.after, tick.before);
  const Wide radius = meshes_.radius_m();
  const Wide way =
      norm(grip_pose(tick.after).x - grip_pose(tick.before).x) + radius * norm(move.rotation_rad);
  const Wide still = std::max(kStill_m * radius / kJudgedRadius_m, tolerance_m_);
  if (tick.result.behind_ticks > 0 || way > still) {
    still_ = 0;
  } else {
    ++still_;
  }
  if (still_ < kStillTicks) {
    if (resting <= kLongestArrival) return false;
    fail(tick, "does not arrive", std::to_string(resting) + " ticks", totals.unarrived, totals);
    return true;
  }
  totals.longest_arrival = std::max(totals.longest_arrival, resting);
  if (potential_j(wide_error(tick.goal, tick.after)) <= kAtGoal_j) return true;
  const Wide near = kTouching * tolerance_m_ + allowed_m_;
  const Wide gap = meshes_.distance_m(grip_pose(tick.after), 1e3L * near);
  totals.largest_rest_gap_m = std::max(totals.largest_rest_gap_m, gap * kJudgedRadius_m / radius);
  if (gap <= near) return true;
  fail(tick, "invisible wall", "the nearest triangle is " + number_text(gap) + " m or more away",
       totals.walls, totals);
  return true;
}

}  // namespace haptic::sim
