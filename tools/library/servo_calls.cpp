// SPDX-License-Identifier: Apache-2.0
// Group servo: the tick of run_device in memory of the caller. Nothing is allocated here.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <new>
#include <optional>
#include <span>

#include "rt_core/scene/part_scenes.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/library/call.hpp"
#include "tools/library/handle_call.hpp"
#include "tools/verdict/session_judge.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

/// Time of the ticks, made of the caller's, which may be anything: it goes forward by at least
/// nothing and at most kMostStep_ns a tick, and says whether the caller's time was one.
class CallersTime {
 public:
  explicit CallersTime(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  /// One tick at `time_s`. @return whether it goes on from the last; else a period is taken for it.
  [[nodiscard]] bool advance(double time_s, std::uint32_t most_still_ticks) noexcept {
    const bool is_time = is_within(time_s, 0, kMostTime_s);
    const std::int64_t given_ns = is_time ? std::llround(1e9 * time_s) : 0;
    const bool is_first = !has_given_;
    const std::int64_t passed_ns = is_first ? 0 : given_ns - given_ns_;
    if (is_time) {
      given_ns_ = given_ns;
      has_given_ = true;
    }
    // A clock of coarse steps gives the same time twice; one that stands gives it for ever.
    still_ticks_ = is_time && passed_ns == 0 && !is_first ? still_ticks_ + 1 : 0;
    const bool goes_on = is_time && passed_ns >= 0 && still_ticks_ <= most_still_ticks;
    now_ns_ += goes_on ? std::min(passed_ns, kMostStep_ns) : period_ns_;
    return goes_on;
  }
  [[nodiscard]] std::int64_t now_ns() const noexcept { return now_ns_; }
  /// `time_s` of the same clock, as far as it is of the last seconds; one that is none is long ago.
  [[nodiscard]] std::int64_t stamp_ns(double time_s) const noexcept {
    if (!is_within(time_s, 0, kMostTime_s)) return now_ns_ - kLongAgo_ns;
    const std::int64_t age_ns = given_ns_ - std::llround(1e9 * time_s);
    return now_ns_ - std::clamp(age_ns, -kMostStep_ns, kLongAgo_ns);
  }

 private:
  // Beyond each of them everything is late all the same.
  static constexpr std::int64_t kMostStep_ns = 1'000'000'000, kLongAgo_ns = 1'000'000'000'000;
  std::int64_t period_ns_;
  std::int64_t now_ns_ = 1'000'000'000'000'000;  ///< so that what is long ago is still above 0
  std::int64_t given_ns_ = 0;
  std::uint32_t still_ticks_ = 0;
  bool has_given_ = false;
};

}  // namespace

/// At the begin of the caller's memory; the core's state follows.
struct alignas(kStateAlignment) haptic_servo {
  explicit haptic_servo(std::int64_t period_ns) noexcept : time(period_ns) {}
  std::atomic<std::uint64_t> magic{0};
  std::atomic<bool> busy{false}, stop{false};
  SceneView view;
  HapticCore* core = nullptr;
  ServoParameters parameters;
  std::optional<ServoTick> tick;
  CallersTime time;
  SessionJudge judge;

  static constexpr std::uint64_t kOpenMagic = 0x736572766f6f706e;
  static constexpr std::uint64_t kClosedMagic = 0x7368757473657276;
};

namespace {

using ServoCall = HandleCall<haptic_servo>;

bool is_default_or_within(double value, double low, double high) noexcept {
  return value == 0 || is_within(value, low, high);
}

bool is_unit(const double (&q)[4]) noexcept {
  const double pose[7] = {0, 0, 0, q[0], q[1], q[2], q[3]};
  return is_pose(pose);
}

int check_options(const haptic_servo_options* options) noexcept {
  if (const int error = check_structure(options); error != HAPTIC_OK) return error;
  const haptic_servo_options& o = *options;
  bool numbers = o.deadman != 0 && (o.deadman & (o.clutch | o.emergency_stop)) == 0 &&
                 (o.clutch & o.emergency_stop) == 0 && o.driven_axes <= 0x3f &&
                 is_default_or_within(o.rate_hz, 50, 10'000) && is_within(o.scale, 1e-3, 1e3) &&
                 is_default_or_within(o.max_force_n, 1e-3, 1000) &&
                 is_default_or_within(o.max_torque_nm, 1e-5, 100) &&
                 is_default_or_within(o.slew_n_per_s, 1e-3, 1e6) &&
                 is_default_or_within(o.slew_nm_per_s, 1e-5, 1e5) &&
                 is_default_or_within(o.ramp_in_s, 0.05, 10) &&
                 is_default_or_within(o.jump_speed_m_per_s, 0.1, 1000) &&
                 is_default_or_within(o.jump_turn_rad_per_s, 1, 1e5);
  for (const double metres : o.offset_m) numbers = numbers && is_within(metres, -1e5, 1e5);
  if (!numbers) return HAPTIC_ERROR_NUMBER;
  return is_unit(o.rotation) && is_unit(o.part_rotation) ? HAPTIC_OK : HAPTIC_ERROR_POSE;
}

Quat rotation_of(const double (&q)[4]) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2])).normalized();
}

/// The options were checked.
ServoParameters parameters_of(const haptic_servo_options& o, const SceneView& view) noexcept {
  ServoParameters p;
  p.map.scale = static_cast<Real>(o.scale);
  p.map.q_wd = rotation_of(o.rotation);
  p.start.place = p.start.turn = o.is_absolute == 0;
  if (o.is_absolute != 0) {
    p.map.q_ha = rotation_of(o.part_rotation);
    for (int k = 0; k < 3; ++k) p.map.offset_w[k] = static_cast<Real>(o.offset_m[k]);
  }
  p.switches = {o.deadman, o.clutch, o.emergency_stop};
  SafetyLimits& l = p.limits;
  const auto put = [](double given, Real& limit) {
    if (given > 0) limit = static_cast<Real>(given);
  };
  put(o.max_force_n, l.max_force_n);
  put(o.max_torque_nm, l.max_torque_nm);
  put(o.slew_n_per_s, l.slew_n_per_s);
  put(o.slew_nm_per_s, l.slew_nm_per_s);
  put(o.ramp_in_s, l.ramp_in_s);
  put(o.jump_speed_m_per_s, l.jump_speed_m_per_s);
  put(o.jump_turn_rad_per_s, l.jump_turn_rad_per_s);
  l.driven_dof = o.driven_axes;
  l.period_ns = std::llround(1e9 / (o.rate_hz > 0 ? o.rate_hz : view.parameters().rate_hz));
  l = usable(l);
  return with_scene(p, view);
}

/// Options and scene of a servo. @return HAPTIC_OK, or what is wrong with them.
int open_scene(const void* scene, std::size_t bytes, const haptic_servo_options* options,
               SceneView& view) noexcept {
  if (const int error = check_options(options); error != HAPTIC_OK) return error;
  if (scene == nullptr) return HAPTIC_ERROR_NULL;
  if (bytes == 0) return HAPTIC_ERROR_SIZE;
  if (!is_aligned(scene)) return HAPTIC_ERROR_MEMORY;
  PartScenes parts;
  if (SceneView::open({static_cast<const std::byte*>(scene), bytes}, view) != RtStatus::kOk ||
      PartScenes::open(view, parts) != RtStatus::kOk)
    return HAPTIC_ERROR_SCENE;
  if (parts.count() > 0 && parts.hands() > 1) return HAPTIC_ERROR_PART;
  return is_within(view.parameters().rate_hz, 50, 10'000) || options->rate_hz > 0
             ? HAPTIC_OK
             : HAPTIC_ERROR_NUMBER;
}

ServoInput input_of(const haptic_servo& servo, const haptic_servo_input& in) noexcept {
  ServoInput input;
  input.now_ns = servo.time.now_ns();
  DeviceState& state = input.state;
  state.sequence = in.report;
  state.stamp_ns = servo.time.stamp_ns(in.report_time_s);
  state.pose_dh = record_of(pose_of_numbers(in.pose));
  state.twist_valid = in.has_twist != 0;
  for (int k = 0; k < 3; ++k) {
    state.twist_d.linear_m_per_s[k] = static_cast<Real>(in.twist[k]);
    state.twist_d.angular_rad_per_s[k] = static_cast<Real>(in.twist[3 + k]);
  }
  state.link = in.ready != 0 ? LinkState::kReady : LinkState::kStarting;
  state.switches = in.switches;
  state.faults = in.device_faults;
  input.emergency_stop = in.emergency_stop != 0;
  return input;
}

void write_output(const ServoResult& result, haptic_servo_output& output) noexcept {
  const StepResult& rendered = result.rendered;
  output.arming = static_cast<std::uint32_t>(result.arming);
  write_numbers(wrench_of(result.command.wrench_d), output.wrench);
  write_numbers(rendered.wrench_w, output.rendered);
  write_numbers(rendered.proxy_pose_wa, output.felt_pose);
  write_numbers(rendered.goal_pose_wa, output.goal_pose);
  output.gap_m = static_cast<double>(rendered.proxy_gap_m);
  output.state_hash = rendered.state_hash;
  output.safety_faults = result.faults;
  output.present_faults = result.present;
  output.waits = result.waits;
  output.limited = result.limiter_flags;
  output.situation = static_cast<std::uint32_t>(rendered.situation);
  output.flags = rendered.flags;
  output.near_count = rendered.near_count;
  output.armings = result.command.arming;
  output.work = result.rendered_new
                    ? rendered.counters.plane_gaps + rendered.counters.feature_evaluations
                    : 0;
}

}  // namespace

int haptic_servo_bounds_of(const void* scene, size_t scene_bytes,
                           const haptic_servo_options* options, haptic_servo_bounds* bounds) {
  if (const int error = check_structure(bounds); error != HAPTIC_OK) return error;
  *bounds = HAPTIC_SERVO_BOUNDS_INIT;
  SceneView view;
  if (const int error = open_scene(scene, scene_bytes, options, view); error != HAPTIC_OK)
    return error;
  const SafetyLimits limits = parameters_of(*options, view).limits;
  const SceneCapacity& most = view.header().capacity;
  bounds->held_periods = limits.held_periods;
  bounds->lost_periods = limits.lost_periods;
  bounds->most_work = most.max_work_units + most.max_feature_evaluations;
  bounds->memory_bytes = sizeof(haptic_servo) + HapticCore::state_bytes(view);
  bounds->period_s = 1e-9 * static_cast<double>(limits.period_ns);
  bounds->longest_ramp_s = static_cast<double>(longest_ramp_s(limits));
  return HAPTIC_OK;
}

int haptic_servo_begin(const void* scene, size_t scene_bytes, void* memory, size_t memory_bytes,
                       const haptic_servo_options* options, haptic_servo** servo) {
  if (servo == nullptr) return HAPTIC_ERROR_NULL;
  *servo = nullptr;
  SceneView view;
  if (const int error = open_scene(scene, scene_bytes, options, view); error != HAPTIC_OK)
    return error;
  if (memory == nullptr) return HAPTIC_ERROR_NULL;
  if (!is_aligned(memory) || memory_bytes < sizeof(haptic_servo) + HapticCore::state_bytes(view))
    return HAPTIC_ERROR_MEMORY;
  const ServoParameters parameters = parameters_of(*options, view);
  auto* const handle = new (memory) haptic_servo(parameters.limits.period_ns);  // no heap
  handle->view = view;
  handle->parameters = parameters;
  std::byte* const rest = static_cast<std::byte*>(memory) + sizeof(haptic_servo);
  if (HapticCore::create({rest, memory_bytes - sizeof(haptic_servo)}, handle->view, handle->core) !=
      RtStatus::kOk)
    return HAPTIC_ERROR_SCENE;
  handle->judge = SessionJudge(handle->view);
  handle->tick.emplace(*handle->core, parameters, handle->view.header().capacity, nullptr);
  handle->magic.store(haptic_servo::kOpenMagic, std::memory_order_release);
  *servo = handle;
  return HAPTIC_OK;
}

int haptic_servo_tick(haptic_servo* servo, const haptic_servo_input* input,
                      haptic_servo_output* output) {
  if (const int error = check_structure(output); error != HAPTIC_OK) return error;
  *output = HAPTIC_SERVO_OUTPUT_INIT;
  if (const int error = check_structure(input); error != HAPTIC_OK) return error;
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  haptic_servo& handle = *call;
  const std::uint32_t lost_periods = handle.parameters.limits.lost_periods;
  const bool goes_on = handle.time.advance(input->time_s, lost_periods);
  ServoInput given = input_of(handle, *input);
  // A time that is none says nothing of how late this is.
  if (!goes_on) given.late_periods = lost_periods + 1;
  given.emergency_stop = given.emergency_stop || handle.stop.exchange(false);
  const ServoResult result = handle.tick->step(given);
  if (result.rendered_new) handle.judge.take(result.rendered);
  write_output(result, *output);
  return HAPTIC_OK;
}

int haptic_servo_stop(haptic_servo* servo) {
  if (const int error = open_error(servo); error != HAPTIC_OK) return error;
  servo->stop.store(true);
  return HAPTIC_OK;
}

int haptic_servo_verdict(haptic_servo* servo, haptic_verdict* verdict) {
  if (const int error = check_structure(verdict); error != HAPTIC_OK) return error;
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  write_verdict((*call).judge.verdict(), *verdict);
  return HAPTIC_OK;
}

int haptic_servo_close(haptic_servo* servo) {
  const ServoCall call(servo);
  if (call.error() != HAPTIC_OK) return call.error();
  (*call).magic.store(haptic_servo::kClosedMagic, std::memory_order_relaxed);
  return HAPTIC_OK;
}
