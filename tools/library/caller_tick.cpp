// SPDX-License-Identifier: Apache-2.0
#include "tools/library/caller_tick.hpp"

namespace haptic::tools {
namespace {

bool is_default_or_within(double value, double low, double high) noexcept {
  return value == 0 || is_within(value, low, high);
}

bool is_unit(const double (&q)[4]) noexcept {
  const double pose[7] = {0, 0, 0, q[0], q[1], q[2], q[3]};
  return is_pose(pose);
}

Quat rotation_of(const double (&q)[4]) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2])).normalized();
}

}  // namespace

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

ServoInput input_of(const CallersTime& time, bool goes_on, std::uint32_t lost_periods,
                    const haptic_servo_input& in) noexcept {
  ServoInput input;
  input.now_ns = time.now_ns();
  // A time that is none says nothing of how late this is.
  if (!goes_on) input.late_periods = lost_periods + 1;
  DeviceState& state = input.state;
  state.sequence = in.report;
  state.stamp_ns = time.stamp_ns(in.report_time_s);
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

}  // namespace haptic::tools
