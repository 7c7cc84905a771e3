// SPDX-License-Identifier: Apache-2.0
#include "tools/library/session_line.hpp"

#include <algorithm>

#include "hal/device_limits.hpp"
#include "tools/library/call.hpp"

namespace haptic::tools {
namespace {

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
    : parameters_(servo_parameters(scene, driver_, settings.period_ns)),
      peer_(SimulatedPeerSettings{settings.period_ns, parameters_.switches.deadman}, hand_),
      link_(driver_, mailbox_, peer_, link_settings(parameters_)),
      thread_(link_, thread_settings(settings)),
      notes_(scene, parameters_, settings.history_s) {}

void SessionLine::emergency_stop() noexcept {
  hand_.stop_presses();
  link_.emergency_stop();
}

// On the servo thread. The counters of the loop are those of the tick before.
void SessionLine::note(const ServoInput& input, const ServoResult& result,
                       const hal::ServoLoopCounters& counters, std::int64_t opened_ns,
                       const HeldNow& held) noexcept {
  const LoopCounts counts{counters.ticks, counters.late, counters.missed_periods,
                          counters.largest_tick_ns, input.now_ns - opened_ns};
  haptic_state& s = notes_.take(input, result, counts, held);
  s.hand_held = hand_.holds() ? 1 : 0;
  s.goals_reached = hand_.reached();
  hand_.note_fault(result.arming == ArmingState::kFaulted);
  notes_.publish();
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
