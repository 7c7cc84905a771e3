// SPDX-License-Identifier: Apache-2.0

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "rt_core/base/rotation.hpp"
#include "tests/support/servo_bench.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// Every fault that a servo tick can find by itself: how it comes, and how its cause ends.

struct FaultCase {
  std::string name;
  std::uint32_t fault;
  std::function<ServoResult(ServoBench&)> happen;  ///< the tick in which it is found
  std::function<void(ServoBench&)> end;            ///< of the cause
};

ServoResult with_new(ServoBench& b, const std::function<void(DeviceState&)>& change) {
  change(b.input.state);
  return b.tick();
}

void restore(DeviceState& s) { s.pose_dh = record_of(Pose{Vec3(0, 0, 0.009_r), Quat::Identity()}); }
void no_fault(DeviceState& s) { s.faults = 0; }

/// A fault that a new state brings, and what the state must be for it to be gone.
FaultCase state_case(const char* name, std::uint32_t fault,
                     const std::function<void(DeviceState&)>& change,
                     const std::function<void(DeviceState&)>& make_good) {
  return {name, fault, [change](ServoBench& b) { return with_new(b, change); },
          [make_good](ServoBench& b) { make_good(b.input.state); }};
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

std::vector<FaultCase> fault_cases() {
  std::vector<FaultCase> all;
  for (const auto& cases : {pose_faults(), device_faults(), loop_faults()}) {
    all.insert(all.end(), cases.begin(), cases.end());
  }
  return all;
}

constexpr std::uint64_t kSeed = 0x5E60;

/// Breaks one thing of a tick's input; span and age are the times from the last tick and state.
void storm(Random& random, ServoInput& input, std::int64_t& span_ns, std::int64_t& age_ns) {
  constexpr Real kBad[] = {std::numeric_limits<Real>::quiet_NaN(),
                           std::numeric_limits<Real>::infinity(), std::numeric_limits<Real>::max(),
                           0.0_r};
  DeviceState& s = input.state;
  const Real value = kBad[random.next() % 4];
  const auto any = [&] { return static_cast<std::uint32_t>(random.next()); };
  const auto any_span = [&] { return static_cast<std::int64_t>(random.uniform(-1e9, 1e9)); };
  switch (random.next() % 16) {
    case 0:
      s.pose_dh.p_m[any() % 3] = value;
      break;
    case 1:
      s.pose_dh.q_xyzw[any() % 4] = value;
      break;
    case 2:
      s.accepted_d.force_n[any() % 3] = value;
      break;
    case 3:
      s.sequence -= any() % 9;
      break;
    case 4:
      s.sequence = random.next();
      break;
    case 5:
      s.link = static_cast<LinkState>(any() % 5);
      break;
    case 6:
      s.faults = any();
      break;
    case 7:
      span_ns = any_span();
      break;
    case 8:
      age_ns = any_span();
      break;
    case 9:
      s.pose_dh.p_m[2] = static_cast<Real>(random.uniform(-1, 1));
      break;
    case 10:
      s.switches = any();
      break;
    case 11:
      input.late_periods = 1u << (any() % 32);
      break;
    case 12:
      input.emergency_stop = true;
      break;
    case 13:
      s.twist_valid = true;
      s.twist_d.linear_m_per_s[0] = value;
      break;
    default:
      s.sequence -= 1;
      break;  // the state before
  }
}

}  // namespace

TEST_SUITE("rt_core.servo_faults") {
  TEST_CASE("fault by fault: found, latched, ramped out, and cleared by a new press alone") {
    for (const FaultCase& c : fault_cases()) {
      CAPTURE(c.name);
      PressingBench b;
      ServoResult r = c.happen(b);
      CHECK(r.faults == c.fault);
      double last = norm(force_of(r));
      CHECK(last < 1.001);
      for (int k = 0; k < 5; ++k) {  // out, and not up again on the way
        r = b.tick(c.fault != kFaultStaleState);
        CHECK(norm(force_of(r)) <= last);
        last = norm(force_of(r));
      }
      CHECK(last == 0);
      CHECK(r.arming == ArmingState::kFaulted);
      c.end(b);
      r = b.ticks(20);
      CHECK(r.arming == ArmingState::kFaulted);  // still held
      CHECK((r.faults & c.fault) != 0);
      CHECK(force_of(r) == Vec3::Zero());
      b.input.state.pose_dh.p_m[0] = 0;
      b.ticks(40);
      r = b.arm();
      CHECK(r.arming == ArmingState::kArmed);
      CHECK(r.faults == 0);
      CHECK(r.command.arming == 2);
      CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.02));
      CHECK(b.kept);
    }
  }

  TEST_CASE(
      "not homed: the pose is not used, and nothing arms on it when the fault alone is gone") {
    PressingBench b;
    b.input.state.faults = kDeviceNotHomed;
    b.place(0, 0, 0.0095);
    CHECK(!b.tick().rendered_new);
    b.ticks(10);
    b.press(false);
    b.tick();
    b.input.state.faults = 0;  // the report is still the one from before
    b.press(true);
    CHECK(b.tick(false).arming == ArmingState::kFaulted);
    CHECK(b.arm().arming == ArmingState::kArmed);
    CHECK(b.kept);
  }

  TEST_CASE("a cause that stays keeps every press from arming") {
    for (const FaultCase& c : fault_cases()) {
      const bool stays = (c.fault & (kFaultDevice | kFaultEmergencyStop | kFaultDeviceLost)) != 0 ||
                         c.name == "pose NaN";
      if (!stays) continue;
      CAPTURE(c.name);
      PressingBench b;
      (void)c.happen(b);
      b.ticks(5);
      for (int press = 0; press < 3; ++press) {
        b.press(false);
        b.ticks(5);
        b.press(true);
        const ServoResult r = b.ticks(20, press != 1);  // a repeated state is as bad
        CHECK(r.arming == ArmingState::kFaulted);
        CHECK(r.command.arming == 1);
        CHECK(force_of(r) == Vec3::Zero());
      }
    }
  }

  TEST_CASE(
      "workspace and envelope: out before the limit is exceeded, with the tick's own motion") {
    ServoParameters parameters;
    parameters.envelope.half_extent_m = Vec3(0.02_r, 0, 0);
    parameters.envelope.max_angle_rad = 0.2_r;
    ServoBench b(cube_on_floor(), parameters);
    b.place(0, 5, 0.03);  // no limit along y
    b.arm();
    ServoResult r;
    int k = 0;
    for (; k < 300 && (r.faults & kFaultWorkspace) == 0; ++k) {
      b.place(0.0001 * k, 5, 0.03);
      r = b.tick();
    }
    CHECK(r.faults == kFaultWorkspace);
    CHECK(k == 201);  // 0.0200 m is in, but 0.0201 m would not be
    b.place(0.0201, 5, 0.03);
    b.press(false);
    b.ticks(2);
    b.press(true);
    CHECK(b.tick(false).arming == ArmingState::kFaulted);  // the state is the same, and so is where
    CHECK(b.tick(false).command.arming == 1);
    b.place(0, 5, 0.03);
    CHECK(b.arm().faults == 0);
    for (k = 0; k < 300 && r.faults != kFaultEnvelope; ++k) {
      b.input.state.pose_dh =
          record_of(Pose{Vec3(0, 5, 0.03_r), so3_exp(Vec3(0, 0.001_r * static_cast<Real>(k), 0))});
      r = b.tick();
    }
    CHECK(r.faults == kFaultEnvelope);
    CHECK(std::abs(k - 200) <= 1);
    CHECK(b.kept);
  }

  TEST_CASE("a part that starts inside: fault of the scene until it is out, no force meanwhile") {
    ServoBench b;
    b.place(0, 0, 0.008);
    b.press(false);
    ServoResult r = b.tick();
    CHECK((r.rendered.flags & kFlagRecovery) != 0);
    CHECK(r.faults == kFaultScene);
    b.press(true);
    r = b.tick();
    CHECK(r.arming == ArmingState::kFaulted);
    int recovering = 0;
    while ((b.tick().rendered.flags & kFlagRecovery) != 0 && recovering < 1000) ++recovering;
    CHECK(recovering > 3);
    CHECK(recovering < 100);
    CHECK(b.arm().arming == ArmingState::kArmed);
    CHECK(b.kept);
  }

  TEST_CASE("work beyond the bounds of the scene, a map that is none: internal, nothing arms") {
    ServoBench b;
    SceneCapacity none{};
    ServoTick strict(*b.scene.core, ServoParameters{}, none, nullptr);
    b.input.state.sequence = 1;
    b.input.state.stamp_ns = b.input.now_ns;
    b.place(0, 0, 0.0101);
    CHECK(strict.step(b.input).faults == kFaultInternal);
    for (int kind = 0; kind < 3; ++kind) {
      ServoParameters parameters;
      if (kind == 0) parameters.map.scale = 0;
      if (kind == 1) parameters.envelope.max_angle_rad = -1;
      if (kind == 2) parameters.envelope.half_extent_m.x() = std::numeric_limits<Real>::quiet_NaN();
      ServoBench bad(cube_on_floor(), parameters);
      const ServoResult r = bad.arm();
      CHECK(r.faults == kFaultInternal);
      CHECK(!r.rendered_new);
      CHECK(r.arming == ArmingState::kFaulted);
    }
  }

  TEST_CASE("hostile inputs: the command keeps every promise, and the same inputs the same bits") {
    CAPTURE(kSeed);
    ServoBench b, twin;
    Random random(kSeed);
    int armed = 0, forced = 0;
    std::uint32_t faults = 0;
    for (int k = 0; k < 200'000; ++k) {
      // Between short storms a hand that presses on the floor and tries to arm.
      DeviceState& s = b.input.state;
      s.link = LinkState::kReady;
      s.faults = 0;
      s.switches = k % 300 < 20 ? 0u : std::uint32_t{kDeadman};
      s.pose_dh = record_of(Pose{Vec3(static_cast<Real>(0.02 * std::sin(k * 1e-3)), 0,
                                      static_cast<Real>(0.0095 + 0.001 * std::sin(k * 0.01))),
                                 Quat::Identity()});
      s.twist_valid = false;
      b.input.late_periods = 0;
      b.input.emergency_stop = false;
      std::int64_t span = kMs + static_cast<std::int64_t>(random.uniform(-2e5, 2e5));
      std::int64_t age = kMs / 5;
      s.sequence += 1;
      const std::uint64_t broken = k % 1500 < 60 ? 1 + random.next() % 3 : 0;
      for (std::uint64_t n = 0; n < broken; ++n) storm(random, b.input, span, age);
      b.input.now_ns += span;
      s.stamp_ns = b.input.now_ns - age;
      twin.input = b.input;
      const ServoResult l = b.bare_tick(), r = twin.bare_tick();
      REQUIRE(b.kept);
      REQUIRE(std::memcmp(&l.command.wrench_d, &r.command.wrench_d, sizeof(WrenchRecord)) == 0);
      REQUIRE(l.rendered.state_hash == r.rendered.state_hash);
      REQUIRE(l.faults == r.faults);
      REQUIRE(l.limiter_flags == r.limiter_flags);
      if ((s.switches & kDeadman) == 0 && s.link == LinkState::kReady) {
        REQUIRE(l.arming != ArmingState::kArming);
        REQUIRE(l.arming != ArmingState::kArmed);
      }
      faults |= l.faults;
      armed += l.arming == ArmingState::kArmed;
      forced += norm(force_of(l)) > 0.2;
    }
    CHECK(armed > 60'000);
    CHECK(forced > 30'000);
    for (const std::uint32_t fault :
         {kFaultBadPose, kFaultStaleState, kFaultLateTick, kFaultDeviceLost, kFaultDevice,
          kFaultEmergencyStop, kFaultInternal, kFaultJump, kFaultSequence}) {
      CAPTURE(fault);
      CHECK((faults & fault) != 0);
    }
  }
}
