// SPDX-License-Identifier: Apache-2.0
#include "tests/rt_core/servo_fault_cases.hpp"

#include <limits>

#include "rt_core/base/rotation.hpp"

namespace haptic::test {
namespace {

ServoResult with_new(ServoBench& b, const std::function<void(DeviceState&)>& change) {
  change(b.input.state);
  return b.tick();
}

void restore(DeviceState& s) { s.pose_dh = record_of(Pose{Vec3(0, 0, 0.009_r), Quat::Identity()}); }
void no_fault(DeviceState& s) { s.faults = 0; }

/// A fault that a new state brings, and what the state must be for it to be gone.
FaultCase state_case(const char* name, std::uint32_t fault,
                     const std::function<void(DeviceState&)>& change,
                     const std::function<void(DeviceState&)>& mend) {
  return {name, fault, [change](ServoBench& b) { return with_new(b, change); },
          [mend](ServoBench& b) { mend(b.input.state); }};
}

std::vector<FaultCase> pose_faults() {
  constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
  constexpr Real kInf = std::numeric_limits<Real>::infinity();
  std::vector<FaultCase> cases;
  cases.push_back(state_case(
      "pose NaN", kFaultBadPose, [](DeviceState& s) { s.pose_dh.p_m[1] = kNan; }, restore));
  cases.push_back(state_case(
      "quaternion not unit", kFaultBadPose, [](DeviceState& s) { s.pose_dh.q_xyzw[3] = 1.01_r; },
      restore));
  cases.push_back(state_case(
      "quaternion zero", kFaultBadPose, [](DeviceState& s) { s.pose_dh.q_xyzw[3] = 0; }, restore));
  cases.push_back(state_case(
      "beyond every scene", kFaultBadPose, [](DeviceState& s) { s.pose_dh.p_m[0] = kInf; },
      restore));
  cases.push_back(state_case(
      "twist NaN", kFaultBadPose,
      [](DeviceState& s) {
        s.twist_valid = true;
        s.twist_d.angular_rad_per_s[2] = kNan;
      },
      [](DeviceState& s) { s.twist_valid = false; }));
  cases.push_back(state_case(
      "jump", kFaultJump, [](DeviceState& s) { s.pose_dh.p_m[0] = 0.02_r; }, restore));
  cases.push_back(state_case(
      "turn", kFaultJump,
      [](DeviceState& s) {
        s.pose_dh = record_of(Pose{Vec3(0, 0, 0.009_r), so3_exp(Vec3(0, 0, 0.5_r))});
      },
      restore));
  return cases;
}

std::vector<FaultCase> device_faults() {
  std::vector<FaultCase> cases;
  cases.push_back(state_case(
      "device fault", kFaultDevice, [](DeviceState& s) { s.faults = kDeviceOverheated; },
      no_fault));
  cases.push_back(state_case(
      "not homed", kFaultDevice, [](DeviceState& s) { s.faults = kDeviceNotHomed; }, no_fault));
  cases.push_back(state_case(
      "link fault", kFaultDevice, [](DeviceState& s) { s.faults = kLinkSilent; }, no_fault));
  cases.push_back(state_case(
      "stop of the device", kFaultEmergencyStop,
      [](DeviceState& s) { s.faults = kDeviceEmergencyStop; }, no_fault));
  cases.push_back(state_case(
      "stop by a switch", kFaultEmergencyStop, [](DeviceState& s) { s.switches |= kStop; },
      [](DeviceState& s) { s.switches &= ~kStop; }));
  cases.push_back(state_case(
      "link lost", kFaultDeviceLost, [](DeviceState& s) { s.link = LinkState::kAbsent; },
      [](DeviceState& s) { s.link = LinkState::kReady; }));
  cases.push_back(state_case(
      "link starts again", kFaultDeviceLost, [](DeviceState& s) { s.link = LinkState::kStarting; },
      [](DeviceState& s) {
        s.link = LinkState::kReady;
        s.sequence = 0;
      }));
  return cases;
}

std::vector<FaultCase> loop_faults() {
  const auto nothing = [](ServoBench&) {};
  std::vector<FaultCase> cases;
  cases.push_back({"stop by a call", kFaultEmergencyStop,
                   [](ServoBench& b) {
                     b.input.emergency_stop = true;
                     return b.tick();
                   },
                   [](ServoBench& b) { b.input.emergency_stop = false; }});
  cases.push_back({"sequence back", kFaultSequence,
                   [](ServoBench& b) {
                     b.input.state.sequence -= 5;
                     return b.tick();
                   },
                   nothing});
  cases.push_back({"stamp back", kFaultSequence,
                   [](ServoBench& b) {
                     b.input.now_ns += kMs;
                     b.input.state.sequence += 1;
                     b.input.state.stamp_ns -= 1;
                     return b.bare_tick();
                   },
                   nothing});
  cases.push_back(
      {"no new state", kFaultStaleState, [](ServoBench& b) { return b.ticks(8, false); }, nothing});
  cases.push_back({"late by the loop's count", kFaultLateTick,
                   [](ServoBench& b) {
                     b.input.late_periods = 6;
                     const ServoResult r = b.tick();
                     b.input.late_periods = 0;
                     return r;
                   },
                   nothing});
  cases.push_back({"late by the clock", kFaultLateTick,
                   [](ServoBench& b) {
                     b.input.now_ns += 6 * kMs;
                     return b.tick();
                   },
                   nothing});
  cases.push_back({"clock back", kFaultInternal,
                   [](ServoBench& b) {
                     b.input.now_ns -= 3 * kMs;
                     const ServoResult r = b.bare_tick();
                     b.input.now_ns += 5 * kMs;
                     return r;
                   },
                   nothing});
  return cases;
}

}  // namespace

std::vector<FaultCase> fault_cases() {
  std::vector<FaultCase> all;
  for (const auto& cases : {pose_faults(), device_faults(), loop_faults()}) {
    all.insert(all.end(), cases.begin(), cases.end());
  }
  return all;
}

}  // namespace haptic::test
