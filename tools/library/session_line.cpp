// SPDX-License-Identifier: Apache-2.0
#include "tools/library/session_line.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hal/device_limits.hpp"
#include "tools/library/call.hpp"

namespace haptic::tools {
namespace {

std::size_t recorded_ticks(const LineSettings& settings) {
  return static_cast<std::size_t>(
      std::ceil(1e9 * settings.history_s / static_cast<double>(settings.period_ns)));
}

/// The handle's origin and axes are the part's where the scene has it start.
ServoParameters servo_parameters(const SceneView& view, const hal::Driver& driver,
                                 std::int64_t period_ns) {
  ServoParameters p;
  const SceneParameters& scene = view.parameters();
  const auto real = [](double x) { return static_cast<Real>(x); };
  const double* grip = view.bodies()[0].reference_m;
  const double* q = scene.start_q_wa_xyzw;
  p.map.grip_a = Vec3(real(grip[0]), real(grip[1]), real(grip[2]));
  p.map.q_ha = Quat(real(q[3]), real(q[0]), real(q[1]), real(q[2])).normalized();
  const double* at = scene.start_p_wa_m;
  p.map.offset_w = Vec3(real(at[0]), real(at[1]), real(at[2])) + p.map.q_ha * p.map.grip_a;
  p.limits = hal::limits_of(driver.capabilities(), period_ns);
  return p;
}

hal::LinkSettings link_settings(const ServoParameters& parameters) {
  hal::LinkSettings settings;
  settings.limits = parameters.limits;
  settings.deadman = parameters.switches.deadman;
  return settings;
}

hal::UsbThreadSettings thread_settings(const LineSettings& settings) {
  hal::UsbThreadSettings thread;
  thread.period_ns = settings.period_ns;
  thread.priority = std::max(0, settings.priority - 1);
  thread.name = "haptic-link";
  return thread;
}

}  // namespace

SessionLine::SessionLine(const SceneView& scene, const LineSettings& settings)
    : history_memory_(FlightRecorder::bytes_for(recorded_ticks(settings))),
      parameters_(servo_parameters(scene, driver_, settings.period_ns)),
      peer_(SimulatedPeerSettings{settings.period_ns, parameters_.switches.deadman}, hand_),
      link_(driver_, mailbox_, peer_, link_settings(parameters_)),
      thread_(link_, thread_settings(settings)),
      recorder_(history_memory_.span()),
      judge_(scene) {}

void SessionLine::emergency_stop() noexcept {
  hand_.stop_presses();
  link_.emergency_stop();
}

// On the servo thread. The counters of the loop are those of the tick before.
void SessionLine::note(const ServoInput& input, const ServoResult& result,
                       const hal::ServoLoopCounters& counters, std::int64_t opened_ns,
                       const HeldNow& held) noexcept {
  if (result.rendered_new) judge_.take(result.rendered);
  NewestTick record{HAPTIC_STATE_INIT, judge_.verdict(), held};
  haptic_state& s = record.state;
  const StepResult& rendered = result.rendered;
  s.link = static_cast<std::uint32_t>(input.state.link);
  s.tick = counters.ticks;
  s.time_s = 1e-9 * static_cast<double>(input.now_ns - opened_ns);
  write_numbers(mesh_pose(parameters_.map, pose_of(input.state.pose_dh)), s.hand_pose);
  const Pose& frame = result.frame_wf;
  const Pose& felt = rendered.proxy_pose_wa;
  write_numbers(Pose{frame.p_wa + frame.q_wa * felt.p_wa, frame.q_wa * felt.q_wa}, s.felt_pose);
  write_numbers(
      Wrench{frame.q_wa * rendered.wrench_w.force_w, frame.q_wa * rendered.wrench_w.torque_w},
      s.wrench);
  write_numbers(scene_wrench(parameters_.map, wrench_of(result.command.wrench_d)), s.sent_wrench);
  s.gap_m = static_cast<double>(rendered.proxy_gap_m);
  s.state_hash = rendered.state_hash;
  s.situation = static_cast<std::uint32_t>(rendered.situation);
  s.flags = rendered.flags;
  s.arming = static_cast<std::uint32_t>(result.arming);
  s.safety_faults = result.faults;
  s.device_faults = input.state.faults;
  s.hand_held = hand_.holds() ? 1 : 0;
  s.goals_reached = hand_.reached();
  s.late_ticks = counters.late;
  s.missed_periods = counters.missed_periods;
  s.longest_tick_s = 1e-9 * static_cast<double>(counters.largest_tick_ns);
  s.armings = result.command.arming;
  hand_.note_fault(result.arming == ArmingState::kFaulted);
  newest_writer_.publish(record);
}

void SessionLine::state(haptic_state& state) const noexcept {
  NewestReader<NewestTick> reader(newest_);
  bool found = false;
  const NewestTick& record = reader.newest(&found);
  state = HAPTIC_STATE_INIT;
  if (found) state = record.state;
}

SessionVerdict SessionLine::verdict() const noexcept {
  NewestReader<NewestTick> reader(newest_);
  bool found = false;
  const NewestTick& record = reader.newest(&found);
  return found ? record.verdict : SessionVerdict{};
}

HeldNow SessionLine::held() const noexcept {
  NewestReader<NewestTick> reader(newest_);
  return reader.newest().held;
}

std::size_t SessionLine::history(std::span<haptic_tick> ticks, std::int64_t opened_ns) const {
  std::vector<StepTrace> records(std::min(ticks.size(), recorder_.capacity()));
  const std::size_t count = FlightRecorder::copy_newest(history_memory_.span(), records);
  for (std::size_t k = 0; k < count; ++k) {
    const StepTrace& from = records[k];
    haptic_tick& to = ticks[k];
    to = haptic_tick{};
    to.tick = from.tick;
    to.time_s = 1e-9 * static_cast<double>(from.now_ns - opened_ns);
    double pose[7];
    std::copy_n(from.pose_p_m, 3, pose);
    std::copy_n(from.pose_q_xyzw, 4, pose + 3);
    write_numbers(mesh_pose(parameters_.map, pose_of_numbers(pose)), to.hand_pose);
    std::copy_n(from.rendered_force_n, 3, to.wrench);
    std::copy_n(from.rendered_torque_nm, 3, to.wrench + 3);
    WrenchRecord sent;
    for (int i = 0; i < 3; ++i) {
      sent.force_n[i] = static_cast<Real>(from.command_force_n[i]);
      sent.torque_nm[i] = static_cast<Real>(from.command_torque_nm[i]);
    }
    write_numbers(scene_wrench(parameters_.map, wrench_of(sent)), to.sent_wrench);
    to.situation = from.situation;
    to.flags = from.step_flags;
    to.arming = from.arming;
    to.safety_faults = from.faults;
  }
  return count;
}

std::uint64_t SessionLine::move_hand(const double* pose, double seconds) noexcept {
  Pose pose_wa = pose_of_numbers(pose);
  pose_wa.q_wa.normalize();
  order_.number += 1;
  order_.seconds = seconds;
  write_numbers(handle_pose(parameters_.map, pose_wa), order_.pose_dh);
  hand_.order(order_);
  return order_.number;
}

void SessionLine::hold(haptic_hold hold) noexcept {
  order_.hold = hold;
  hand_.allow_presses();
  hand_.order(order_);
}

}  // namespace haptic::tools
