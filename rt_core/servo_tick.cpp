// SPDX-License-Identifier: Apache-2.0
#include "rt_core/servo_tick.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

/// Causes after which the newest pose says nothing about where the part is.
constexpr std::uint32_t kNoPose = kFaultBadPose | kFaultJump | kFaultSequence;
constexpr Real kUnitTolerance = 1.0e-3_r;
/// So long does a part that has come back inside its limits follow its handle on.
constexpr std::uint32_t kComesBackTicks = 100;
/// By which a device or its link calls for a stop.
constexpr std::uint32_t kStops = kDeviceEmergencyStop | kLinkStopCalled;

/// Whole periods from one stamp to a later one; 0 for an earlier one.
std::uint32_t periods_between(std::int64_t from_ns, std::int64_t to_ns,
                              std::int64_t period_ns) noexcept {
  if (to_ns <= from_ns) return 0;
  const std::uint64_t span =
      static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  const std::uint64_t periods = span / static_cast<std::uint64_t>(period_ns);
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::min(periods, kMost));
}

/// Periods beyond the one that always passes.
std::uint32_t beyond_one(std::uint32_t periods) noexcept { return periods > 0 ? periods - 1 : 0; }

bool is_pose(const Pose& pose) noexcept {
  // Comparisons with NaN are false.
  const Real n = std::sqrt(pose.q_wa.squaredNorm());
  return is_finite(pose.p_wa) && n >= 1.0_r - kUnitTolerance && n <= 1.0_r + kUnitTolerance;
}

Vec3 turn_between(const Quat& from, const Quat& to) noexcept {
  return so3_log((to * from.conjugate()).normalized());
}

/// The counters of a tick within the bounds that the scene's header states.
bool is_within(const StepCounters& n, const SceneCapacity& c) noexcept {
  return n.pair_visits <= c.max_pair_visits && n.support_pairs <= c.max_support_pairs &&
         n.feature_evaluations <= c.max_feature_evaluations && n.edge_pairs <= c.max_edge_pairs &&
         n.near_nodes <= c.max_near_nodes && n.hull_points <= c.max_hull_points &&
         n.plane_gaps <= c.max_work_units && n.valid_nodes <= c.max_work_units &&
         n.full_searches <= c.max_full_searches && n.search_work <= c.max_work_units &&
         n.proxy_passes <= c.max_proxy_passes && n.proxy_rejected <= c.max_proxy_rejected &&
         n.proxy_rounds <= c.max_proxy_rounds && n.proxy_rows <= c.max_qp_rows &&
         n.qp_iterations <= c.max_qp_iterations && n.qp_programs <= c.max_qp_programs &&
         n.qp_steps <= c.max_qp_steps;
}

Wrench difference(const Wrench& l, const Wrench& r) noexcept {
  return {l.force_w - r.force_w, l.torque_w - r.torque_w};
}

/// More than the device may feel, of what it can.
bool is_beyond(const Wrench& pull_d, const SafetyLimits& l) noexcept {
  Vec3 force_n = pull_d.force_w, torque_nm = pull_d.torque_w;
  for (int k = 0; k < 3; ++k) {
    if ((l.driven_dof >> k & 1u) == 0) force_n[k] = 0.0_r;
    if ((l.driven_dof >> (k + 3) & 1u) == 0) torque_nm[k] = 0.0_r;
  }
  return (l.max_force_n > 0.0_r && robust_length(force_n) > l.max_force_n) ||
         (l.max_torque_nm > 0.0_r && robust_length(torque_nm) > l.max_torque_nm);
}

/// What the device is to be pulled by: the spring, and the guide where there is one.
Wrench pull_of(const StepResult& r) noexcept {
  if (!kSceneTraits.guide || r.guidance.state == GuideState::kNone) return r.spring_w;
  const Wrench& guide_w = r.guidance.wrench_w;
  return {r.spring_w.force_w + guide_w.force_w, r.spring_w.torque_w + guide_w.torque_w};
}

bool is_zero(const Wrench& w) noexcept { return w.force_w.isZero(0) && w.torque_w.isZero(0); }

void copy(const Vec3& from, double (&to)[3]) noexcept {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<double>(from[k]);
}

}  // namespace

ServoResult ServoTick::step(const ServoInput& input) noexcept {
  const Opened opened = open(input);
  return close(input, opened, opened.renders ? step_core(opened.to_core) : StepResult{});
}

ServoTick::Opened ServoTick::open(const ServoInput& input) noexcept {
  Opened opened;
  tick_ += 1;
  const DeviceState& state = input.state;
  follow_limits(state.limits);
  const bool linked = state.link == LinkState::kReady;
  const bool is_new = linked && state.sequence != 0 &&
                      (!device_.has_state || state.sequence != device_.state.sequence);
  opened.present = check_device(input);
  follow_state(input, is_new);
  opened.present |= check_time(input);
  opened.present |= check_frame(input);
  opened.present |= input.other_faults & (kFaultInternal | kFaultNotFinite);
  const bool has_pose =
      usable_ && (device_.faults & kNoPose) == 0 && (state.faults & kDeviceNotHomed) == 0;
  if (is_new && has_pose) prepare(input, opened);
  return opened;
}

ServoResult ServoTick::close(const ServoInput& input, const Opened& opened,
                             const StepResult& rendered) noexcept {
  ServoResult result = opened.result;
  if (opened.renders) {
    rendered_.result = rendered;
    result.rendered_new = true;
    const std::uint32_t faults = check_rendered();
    if ((faults & kFaultBadPose) != 0) broken_ = true;
    device_.faults |= faults;
  }
  const std::uint32_t present = opened.present | device_.faults;
  arm(input, present);
  LimiterInput in;
  in.stamp_ns = input.now_ns;
  in.spring_d = exerted(pull_of(rendered_.result));
  in.damping_d = exerted(difference(rendered_.result.wrench_w, rendered_.result.spring_w));
  in.twist_d = device_.twist_d;
  in.wants_force = arming_.wants_force();
  in.late_periods = late_;
  const LimitedOutput limited = limiter_.update(in);
  full_ = limited.gain == 1.0_r;

  result.command = {tick_, input.now_ns, input.state.sequence, record_of(limited.wrench_d),
                    arming_.count()};
  result.rendered = rendered_.result;
  result.frame_wf = frame_.pose();
  result.arming = arming_.state();
  result.faults = arming_.latched();
  result.limiter_flags = limited.flags;
  result.present = present;
  result.waits = waits(input, present);
  record(input, result);
  return result;
}

StepInput core_input(const DeviceState& state, const ServoParameters& parameters, const Vec3& arm_d,
                     const Wrench& sent_d) noexcept {
  const WorkspaceMap& map = parameters.map;
  StepInput in;
  in.sequence = state.sequence;
  in.stamp_ns = state.stamp_ns;
  in.pose_wa = mesh_pose(map, at_handle_point(pose_of(state.pose_dh), arm_d));
  in.twist_valid = state.twist_valid;
  if (state.twist_valid)
    in.twist_w = scene_twist(map, at_handle_point(twist_of(state.twist_d), arm_d));
  in.clutched = (state.switches & parameters.switches.clutch) != 0;
  // A device that does not say what it was handed: what left here, which may be held back.
  const Wrench accepted_d = state.accepted_tick != 0 ? wrench_of(state.accepted_d) : sent_d;
  in.accepted_wrench_w = scene_wrench(map, about_handle_point(accepted_d, arm_d));
  in.accepted_valid = true;
  in.switches = state.switches;
  in.device_faults = state.faults;
  return in;
}

ServoParameters with_scene(ServoParameters parameters, const SceneView& scene) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  const double* grip = scene.bodies()[0].reference_m;
  const double* p = scene.parameters().start_p_wa_m;
  const double* q = scene.parameters().start_q_wa_xyzw;
  parameters.map.grip_a = Vec3(real(grip[0]), real(grip[1]), real(grip[2]));
  parameters.start.pose_wa.p_wa = Vec3(real(p[0]), real(p[1]), real(p[2]));
  parameters.start.pose_wa.q_wa = Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2]));
  return parameters;
}

WorkspaceMap begun_map(WorkspaceMap map, const StartPlace& start, const Pose& handle_dh) noexcept {
  if (start.turn) {
    const Quat held = (map.q_wd * handle_dh.q_wa).normalized();
    map.q_ha = (held.conjugate() * start.pose_wa.q_wa.normalized()).normalized();
  }
  if (!start.place) return map;
  // As the goal will be turned; with `turn` as the start is.
  const Pose goal = mesh_pose(map, handle_dh);
  const Vec3 wanted_w = start.pose_wa.p_wa + start.pose_wa.q_wa.normalized() * map.grip_a;
  map.offset_w += wanted_w - (goal.p_wa + goal.q_wa * map.grip_a);
  return map;
}

ServoTick::ServoTick(HapticCore& core, const ServoParameters& parameters,
                     const SceneCapacity& bounds, FlightRecorder* recorder) noexcept
    : ServoTick(&core, nullptr, parameters, bounds, recorder) {}

ServoTick::ServoTick(PartHand& hand, const ServoParameters& parameters,
                     FlightRecorder* recorder) noexcept
    : ServoTick(nullptr, &hand, parameters, SceneCapacity{}, recorder) {}

ServoTick::ServoTick(HapticCore* core, PartHand* hand, const ServoParameters& parameters,
                     const SceneCapacity& bounds, FlightRecorder* recorder) noexcept
    : core_(core),
      hand_(hand),
      parameters_(parameters),
      bounds_(bounds),
      recorder_(recorder),
      own_limits_(usable(parameters.limits)),
      limiter_(parameters.limits),
      usable_(is_usable(parameters.map) && is_usable(parameters.envelope) &&
              is_pose(parameters.start.pose_wa)) {
  parameters_.limits = own_limits_;
  device_.period_ns = own_limits_.period_ns;
  const MotionEnvelope& of_scene = (hand != nullptr ? hand->core() : *core).envelope();
  if (of_scene.limits_place()) parameters_.envelope.half_extent_m = Vec3::Zero();
  if (of_scene.limits_turn()) parameters_.envelope.max_angle_rad = 0;
}

// An image has one core, and asks for no hand.
void ServoTick::reset_core() noexcept {
  if (!kSceneTraits.image && hand_ != nullptr) {
    hand_->reset(!drops_pull_);
    drops_pull_ = false;
  } else {
    core_->reset();
  }
}

StepResult ServoTick::step_core(const StepInput& input) noexcept {
  if (!kSceneTraits.image && hand_ != nullptr) return hand_->step(input);
  return core_->step(input);
}

const SceneCapacity& ServoTick::bounds() const noexcept {
  if (!kSceneTraits.image && hand_ != nullptr) return hand_->bounds();
  return bounds_;
}

/// That of the part whose poses the last result has.
Vec3 ServoTick::felt_grip_a() const noexcept {
  if (!kSceneTraits.image && hand_ != nullptr) return hand_->grip_a();
  return parameters_.map.grip_a;
}

/// The limits of a connection, from its first state on.
void ServoTick::follow_limits(const LimitsRecord& record) noexcept {
  if (record.connection == limits_from_ || record.connection == 0) return;
  limits_from_ = record.connection;
  SafetyLimits stated = own_limits_;
  stated.driven_dof = record.driven_dof;
  stated.max_force_n = record.max_force_n;
  stated.max_torque_nm = record.max_torque_nm;
  stated.max_axis_force_n = vec3_of(record.max_axis_force_n);
  stated.max_axis_torque_nm = vec3_of(record.max_axis_torque_nm);
  stated.slew_n_per_s = record.slew_n_per_s;
  stated.slew_nm_per_s = record.slew_nm_per_s;
  parameters_.limits = tighter(own_limits_, stated);
  device_.period_ns =
      std::max(own_limits_.period_ns, std::min(record.report_period_ns, kLongestReportPeriod_ns));
  limiter_.limit(parameters_.limits);
  full_ = false;
}

/// How late the tick is, and the state that it rests on.
std::uint32_t ServoTick::check_time(const ServoInput& input) noexcept {
  const SafetyLimits& l = parameters_.limits;
  std::uint32_t faults = 0;
  std::uint32_t tick_late = input.late_periods;
  if (tick_ > 1) {
    if (input.now_ns < now_ns_) faults |= kFaultInternal;  // the clock is monotonic
    const std::uint32_t passed = periods_between(now_ns_, input.now_ns, l.period_ns);
    tick_late = std::max(tick_late, beyond_one(passed));
  }
  now_ns_ = input.now_ns;
  std::uint32_t state_late = 0;
  if (device_.has_state) {
    // Not by its stamp alone: one from the future must not keep it fresh for ever.
    const std::int64_t since_ns = std::min(device_.state.stamp_ns, device_.seen_ns);
    state_late = beyond_one(periods_between(since_ns, input.now_ns, device_.period_ns));
    if (periods_between(since_ns, input.now_ns, kLongAbsence_ns) > 0) {
      device_.has_pose = false;
      broken_ = true;
    }
  }
  if (tick_late > l.lost_periods) faults |= kFaultLateTick;
  if (state_late > l.lost_periods) faults |= kFaultStaleState;
  late_ = std::max(tick_late, state_late);
  return faults;
}

/// Pose and twist of a new state against the one before, which it replaces.
std::uint32_t ServoTick::check_pose(const DeviceState& state) noexcept {
  const Pose pose = pose_of(state.pose_dh);
  const Twist given = twist_of(state.twist_d);
  const bool good = is_pose(pose) && (!state.twist_valid || is_finite(given));
  const Pose last = pose_of(device_.state.pose_dh);
  const Real elapsed_s = seconds_between(device_.state.stamp_ns, state.stamp_ns);
  const bool long_ago =
      periods_between(device_.state.stamp_ns, state.stamp_ns, kLongAbsence_ns) > 0;
  const bool compared = device_.has_pose && !long_ago;
  broken_ = broken_ || long_ago;
  device_.has_pose = good;
  device_.twist_d = Twist{};
  if (!good) return kFaultBadPose;
  if (state.twist_valid) device_.twist_d = given;
  if (!compared) return 0;

  const SafetyLimits& l = parameters_.limits;
  const Vec3 way_m = pose.p_wa - last.p_wa;
  const Vec3 turn_rad = turn_between(last.q_wa, pose.q_wa);
  const bool near = is_finite(way_m) &&
                    robust_length(way_m) <= l.jump_speed_m_per_s * elapsed_s + kJumpFloor_m &&
                    robust_length(turn_rad) <= l.jump_turn_rad_per_s * elapsed_s + kJumpFloor_rad;
  if (!near) return kFaultJump;
  if (!state.twist_valid) {
    // Reports that come in a burst do not make an encoder's step a speed.
    const Real least_s = seconds_between(0, l.period_ns / 2);
    const Real span_s = std::max(elapsed_s, least_s);
    device_.twist_d = {way_m / span_s, turn_rad / span_s};
  }
  return 0;
}

bool ServoTick::is_felt() const noexcept {
  return arming_.wants_force() || !is_zero(limiter_.last());
}

bool ServoTick::is_stopped(const ServoInput& input) const noexcept {
  return input.emergency_stop || (input.state.faults & kStops) != 0 ||
         (input.state.switches & parameters_.switches.emergency_stop) != 0;
}

/// Faults of the device and the link in this tick, and of the parameters.
std::uint32_t ServoTick::check_device(const ServoInput& input) const noexcept {
  const DeviceState& state = input.state;
  std::uint32_t faults = usable_ ? 0u : std::uint32_t{kFaultInternal};
  if (is_stopped(input)) faults |= kFaultEmergencyStop;
  if ((state.faults & ~kStops) != 0) faults |= kFaultDevice;
  if (state.link != LinkState::kReady && device_.was_ready) faults |= kFaultDeviceLost;
  return faults;
}

/// Takes a new state over; forgets the last one where the link is not ready.
void ServoTick::follow_state(const ServoInput& input, bool is_new) noexcept {
  const DeviceState& state = input.state;
  if (state.link != LinkState::kReady) {
    device_.has_state = device_.has_pose = false;  // the next opening counts its own reports
    device_.faults = 0;
    broken_ = true;
  } else {
    device_.was_ready = true;
    if (is_new) {
      const bool in_order = !device_.has_state || (state.sequence > device_.state.sequence &&
                                                   state.stamp_ns >= device_.state.stamp_ns);
      device_.faults = check_pose(state) | (in_order ? 0u : std::uint32_t{kFaultSequence});
      device_.state = state;
      device_.seen_ns = input.now_ns;
      device_.has_state = true;
    }
    if ((state.faults & kDeviceNotHomed) != 0) device_.has_pose = false;
  }
  if ((device_.faults & kNoPose) != 0 || !usable_ || (state.faults & kDeviceNotHomed) != 0) {
    broken_ = true;
  }
}

/// The frame of the fixed parts, of which the core knows nothing, and the driven parts in it.
std::uint32_t ServoTick::check_frame(const ServoInput& input) noexcept {
  const bool felt = is_felt() || input.other_is_felt;
  bool cause = frame_.follow(input.frame, input.now_ns, felt);
  broken_ = broken_ || frame_.has_jumped();
  if (!kSceneTraits.image && hand_ != nullptr) {
    const bool lost = input.has_followed ? hand_->is_driven_lost()
                                         : hand_->follow({input.driven, input.now_ns, felt});
    cause = cause || lost;
  }
  return cause ? std::uint32_t{kFaultFrame} : 0u;
}

/// Bounds of work, numbers, scene and envelope, of what has just been rendered.
std::uint32_t ServoTick::check_rendered() noexcept {
  const StepResult& r = rendered_.result;
  if (r.status != RtStatus::kOk) return kFaultBadPose;
  std::uint32_t faults = check_envelope();
  const WorkspaceMap& map = parameters_.map;
  if (!is_finite(device_wrench(map, pull_of(r))) ||
      !is_finite(device_wrench(map, difference(r.wrench_w, r.spring_w)))) {
    faults |= kFaultNotFinite;
  }
  if (!is_within(r.counters, bounds())) faults |= kFaultInternal;
  // The scene's own start: a part that is inside after a reset is brought out without a fault.
  const bool inside = (r.flags & kFlagRecovery) != 0;
  rendered_.started_inside = inside && (rendered_.started_inside || !rendered_.has_result);
  rendered_.has_result = true;
  if (rendered_.started_inside) faults |= kFaultScene;
  return faults;
}

/// Grip point and orientation of the goal, now and by the next tick: against the scene's limits by
/// the core, against the others here.
std::uint32_t ServoTick::check_envelope() noexcept {
  const Pose& goal = rendered_.result.goal_pose_wa;
  const Vec3 x0_w = goal.p_wa + goal.q_wa.toRotationMatrix() * felt_grip_a();
  const std::uint32_t outside =
      rendered_.result.outside | watch_.update(parameters_.envelope, x0_w, goal.q_wa);
  rendered_.out_ticks = outside != 0              ? kComesBackTicks
                        : rendered_.out_ticks > 0 ? rendered_.out_ticks - 1
                                                  : 0;
  std::uint32_t faults = 0;
  if ((outside & kOutsideWorkspace) != 0) faults |= kFaultWorkspace;
  if ((outside & kOutsideOrientation) != 0) faults |= kFaultEnvelope;
  return faults;
}

/// The input of the core for a new, usable state.
void ServoTick::prepare(const ServoInput& input, Opened& opened) noexcept {
  const DeviceState& state = input.state;
  if (broken_) {
    reset_core();
    watch_.reset();
    broken_ = false;
    opened.result.began = true;
  }
  WorkspaceMap& map = parameters_.map;
  device_.arm_d = handle_arm(map, pose_of(state.pose_dh).q_wa);
  if (opened.result.began)
    map = begun_map(map, parameters_.start, at_handle_point(pose_of(state.pose_dh), device_.arm_d));
  StepInput in = core_input(state, parameters_, device_.arm_d, limiter_.last());
  if (frame_.is_used()) {
    const Vec3 grip_w = in.pose_wa.p_wa + in.pose_wa.q_wa * map.grip_a;
    in.pose_wa = frame_.inside(in.pose_wa);
    if (in.twist_valid) in.twist_w = frame_.inside(in.twist_w, grip_w);
    in.accepted_wrench_w = frame_.inside(in.accepted_wrench_w);
  }
  in.report_goal_contact = input.report_goal_contact;
  // A hand that nothing holds back must not push the part of another that is felt; but one that
  // has left its limits must bring its part back inside, and off them.
  if (input.other_is_felt && !arming_.wants_force() && rendered_.out_ticks == 0) in.clutched = true;
  opened.to_core = in;
  opened.renders = true;
}

/// What the device must exert for it, at the point where it senses.
Wrench ServoTick::exerted(const Wrench& wrench_w) const noexcept {
  const Wrench outside_w = frame_.is_used() ? frame_.outside(wrench_w) : wrench_w;
  return about_sensed_point(device_wrench(parameters_.map, outside_w), device_.arm_d);
}

/// Who may feel the wrench; a pull that nobody should meet at once is dropped with its history.
void ServoTick::arm(const ServoInput& input, std::uint32_t present) noexcept {
  const DeviceState& state = input.state;
  const bool linked = state.link == LinkState::kReady;
  const std::uint32_t mask = parameters_.switches.deadman;
  const std::uint32_t count = arming_.count();
  const bool after_fault = arming_.latched() != 0;
  ArmingInput in;
  in.deadman = !linked || (mask != 0 && (state.switches & mask) == mask);
  in.ready = linked && device_.has_state && rendered_.has_result && !broken_ &&
             late_ <= parameters_.limits.held_periods;
  in.present = present;
  in.output_is_zero = is_zero(limiter_.last());
  in.output_is_full = full_;
  static_cast<void>(arming_.update(in));
  // Back inside, or to begin inside, and felt by nobody: what the core has latched may go.
  const bool felt =
      arming_.state() != ArmingState::kDisarmed && arming_.state() != ArmingState::kFaulted;
  const bool left = (rendered_.result.flags & kFlagOutsideEnvelope) != 0;
  if (left && (rendered_.result.outside == 0 || parameters_.start.place) && !felt) broken_ = true;
  if (arming_.count() == count) return;
  const bool coupled = rendered_.result.potential_j > 0.0_r;  // by a proxy
  const Wrench pull_d = exerted(rendered_.result.spring_w);
  const bool begins = after_fault && (parameters_.start.place || parameters_.start.turn);
  if (begins || (rendered_.result.flags & kFlagHooked) != 0 ||
      (coupled && is_beyond(pull_d, parameters_.limits))) {
    broken_ = drops_pull_ = true;
    rendered_.result.wrench_w = rendered_.result.spring_w = Wrench{};
    rendered_.result.guidance.wrench_w = Wrench{};
  }
}

/// Why nothing arms now.
std::uint32_t ServoTick::waits(const ServoInput& input, std::uint32_t present) const noexcept {
  const DeviceState& state = input.state;
  if (arming_.wants_force()) return 0;
  std::uint32_t waits = 0;
  if (arming_.state() == ArmingState::kDisarming) waits |= kWaitRampOut;
  if (state.link != LinkState::kReady || !device_.has_state) {
    waits |= kWaitDevice;
  } else if ((state.faults & kDeviceNotHomed) != 0) {
    waits |= kWaitHomed;
  } else if (!rendered_.has_result || broken_) {
    waits |= kWaitPose;
  }
  if (late_ > parameters_.limits.held_periods) waits |= kWaitLate;
  if ((rendered_.result.flags & kFlagRecovery) != 0) waits |= kWaitInside;
  if (present != 0) waits |= kWaitCause;
  const std::uint32_t mask = parameters_.switches.deadman;
  const bool held = mask != 0 && (state.switches & mask) == mask;
  waits |= held ? kWaitDeadmanReleased : kWaitDeadmanPressed;
  return waits;
}

void ServoTick::record(const ServoInput& input, const ServoResult& result) noexcept {
  if (recorder_ == nullptr) return;
  const DeviceState& state = input.state;
  StepTrace trace;
  trace.tick = tick_;
  trace.sequence = state.sequence;
  trace.stamp_ns = state.stamp_ns;
  trace.now_ns = input.now_ns;
  trace.state_hash = result.rendered.state_hash;
  copy(vec3_of(state.pose_dh.p_m), trace.pose_p_m);
  for (int k = 0; k < 4; ++k) trace.pose_q_xyzw[k] = static_cast<double>(state.pose_dh.q_xyzw[k]);
  const Wrench command = wrench_of(result.command.wrench_d);
  copy(command.force_w, trace.command_force_n);
  copy(command.torque_w, trace.command_torque_nm);
  copy(result.rendered.wrench_w.force_w, trace.rendered_force_n);
  copy(result.rendered.wrench_w.torque_w, trace.rendered_torque_nm);
  trace.d_near_m = static_cast<double>(result.rendered.d_near_m);
  trace.step_flags = result.rendered.flags;
  trace.limiter_flags = result.limiter_flags;
  trace.faults = result.faults;
  trace.device_faults = state.faults;
  trace.switches = state.switches;
  trace.late_periods = late_;
  trace.link = static_cast<std::uint8_t>(state.link);
  trace.arming = static_cast<std::uint8_t>(result.arming);
  trace.situation = static_cast<std::uint8_t>(result.rendered.situation);
  trace.began = result.began ? 1 : 0;
  if (result.rendered_new) {
    const StepCounters& n = result.rendered.counters;
    trace.work = n.plane_gaps + n.feature_evaluations;
  }
  recorder_->write(trace);
}

}  // namespace haptic
