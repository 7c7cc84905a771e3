// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/base/rotation.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/servo_bench.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {}  // namespace

TEST_SUITE("rt_core.servo_tick") {
  TEST_CASE("arming on a pressed wall: from zero, over the ramp, to the spring's pull") {
    ServoBench b;
    b.tick();
    b.descend();
    ServoResult r = b.tick();
    CHECK(static_cast<double>(r.rendered.wrench_w.force_w.z()) ==
          doctest::Approx(1.0).epsilon(0.01));
    CHECK(force_of(r) == Vec3::Zero());  // rendered, but felt by nobody
    CHECK(r.command.arming == 0);
    b.press(true);
    for (int k = 0; k <= 100; ++k) {
      r = b.tick();
      CHECK(r.command.arming == 1);
      CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(k / 100.0).epsilon(0.01));
      if (k < 100) CHECK(r.arming == ArmingState::kArming);
    }
    r = b.ticks(2);
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(r.limiter_flags == 0);
    CHECK(r.command.tick == 136);
    CHECK(r.command.stamp_ns == b.input.now_ns);
    CHECK(r.command.sequence == b.input.state.sequence);
    b.press(false);
    r = b.tick();
    CHECK(r.arming == ArmingState::kDisarming);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(0.4).epsilon(0.01));
    r = b.ticks(2);
    CHECK(r.arming == ArmingState::kDisarmed);
    CHECK(force_of(r) == Vec3::Zero());
    CHECK(r.faults == 0);
    CHECK(b.kept);
  }

  TEST_CASE("a deadman held from the start, or while the link comes back, does not arm") {
    ServoBench b;
    b.press(true);
    b.input.state.link = LinkState::kStarting;
    b.ticks(20);
    b.input.state.link = LinkState::kReady;
    CHECK(b.ticks(20).arming == ArmingState::kDisarmed);
    CHECK(b.ticks(1).faults == 0);  // starting is no fault
    CHECK(b.arm().arming == ArmingState::kArmed);
    b.input.state.link = LinkState::kAbsent;
    b.input.state.switches = 0;  // says nothing: the device is away
    b.ticks(20);
    b.input.state.link = LinkState::kReady;
    b.press(true);
    CHECK(b.ticks(20).arming == ArmingState::kFaulted);
    CHECK(b.arm().arming == ArmingState::kArmed);
    CHECK(b.kept);
  }

  TEST_CASE("no deadman named: nothing arms; two switches: both are needed") {
    ServoParameters parameters;
    parameters.switches.deadman = 0;
    ServoBench none(cube_on_floor(), parameters);
    none.input.state.switches = ~0u;
    CHECK(none.arm().arming == ArmingState::kDisarmed);
    parameters.switches.deadman = 0x30;
    ServoBench two(cube_on_floor(), parameters);
    two.tick();
    two.input.state.switches = 0x10;
    CHECK(two.ticks(20).arming == ArmingState::kDisarmed);
    two.input.state.switches = 0x30;
    CHECK(two.ticks(130).arming == ArmingState::kArmed);
  }

  TEST_CASE("a tool tip: the tip touches, and its force turns the handle at the sensed point") {
    ServoParameters parameters = bench_parameters();
    parameters.map.handle_offset_h = Vec3(0.03_r, 0, -0.02_r);
    parameters.map.offset_w = -parameters.map.handle_offset_h;
    PressingBench b(parameters);
    ServoResult r = b.ticks(5);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.01));
    const Vec3 expected = parameters.map.handle_offset_h.cross(force_of(r));
    CHECK(norm(torque_of(r) - expected) <= 1e-3);
    CHECK(norm(expected) == doctest::Approx(0.03).epsilon(0.01));
    CHECK(norm(r.rendered.wrench_w.torque_w) <= 1e-3);  // about the grip point
    CHECK(b.kept);
    // The torque is bounded where the motors exert it.
    parameters.limits.max_torque_nm = 0.01_r;
    PressingBench bounded(parameters);
    r = bounded.ticks(5);
    CHECK(norm(torque_of(r)) <= 0.01 * (1 + 1e-9));
    CHECK(norm(torque_of(r)) >= 0.0099);
  }

  TEST_CASE("limits of a connection: the tighter of each counts, from its first state on") {
    PressingBench b;
    LimitsRecord& record = b.input.state.limits;
    record.connection = 1;
    record.driven_dof = 0x3f;
    record.max_force_n = 0.2_r;
    record.max_torque_nm = 1;
    record.slew_n_per_s = 20;
    record.slew_nm_per_s = 1e6_r;
    ServoResult r = b.tick();
    CHECK(force_of(r) == Vec3::Zero());  // what was there before was another device's
    b.kept = true;                       // which is no jump that a hand could feel
    r = b.arm();
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(0.2));
    Vec3 last = force_of(r);
    b.press(false);
    for (int k = 0; k < 5; ++k) {
      r = b.tick();
      CHECK(norm(force_of(r) - last) <= 0.02 * (1 + 1e-9));
      last = force_of(r);
    }
    b.ticks(20);
    record.connection = 2;  // stronger than the parameters: these stay
    record.max_force_n = 1000;
    record.slew_n_per_s = 1e6_r;
    r = b.arm();
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.01));
    CHECK(b.kept);  // the parameters' own
    record.connection = 3;
    record.driven_dof = 0x3b;  // no z
    CHECK(force_of(b.arm()).z() == 0.0_r);
  }

  TEST_CASE("reports slower than the loop, as stated: held between them, and late beyond them") {
    for (const int every : {2, 4, 6, 8, 20}) {
      CAPTURE(every);
      PressingBench b;
      b.input.state.limits = {1, 0x3f, 100, 10, {}, {}, 1e6_r, 1e5_r, every * 1'000'000};
      const auto report = [&b, every] {
        ServoResult r = b.tick();
        Real least = force_of(r).z();
        for (int k = 1; k < every; ++k) least = std::min(least, force_of(r = b.tick(false)).z());
        return std::pair(r, least);
      };
      b.press(false);
      for (int k = 0; k < 20; ++k) (void)report();
      b.press(true);
      for (int k = 0; k < 200; ++k) (void)report();
      for (int k = 0; k < 10; ++k) {
        const auto [r, least] = report();
        CHECK(r.arming == ArmingState::kArmed);
        CHECK(r.faults == 0u);
        CHECK((r.limiter_flags & kLimiterDecaying) == 0u);
        CHECK(static_cast<double>(least) == doctest::Approx(1.0).epsilon(0.01));
      }
      // Two of its periods pass, a third makes it fade, and in the end it is stale.
      ServoResult r = b.ticks(every + every / 2, false);
      CHECK((r.limiter_flags & kLimiterDecaying) == 0u);
      r = b.ticks(every, false);
      CHECK((r.limiter_flags & kLimiterDecaying) != 0u);
      CHECK(b.ticks(5 * every, false).faults == kFaultStaleState);
    }
  }

  TEST_CASE("no state: noted, held and fading, taken up again; nothing latched") {
    PressingBench b;
    ServoResult r = b.tick(false);  // 1.2 periods old
    CHECK(!r.rendered_new);
    CHECK(r.limiter_flags == 0);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.01));
    r = b.tick(false);
    CHECK(r.limiter_flags == kLimiterLate);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.01));
    for (const double expected : {0.7, 0.49, 0.343, 0.2401}) {
      r = b.tick(false);
      CHECK((r.limiter_flags & kLimiterDecaying) != 0);
      CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(expected).epsilon(0.01));
      CHECK(r.arming == ArmingState::kArmed);
    }
    r = b.ticks(3);
    CHECK(r.faults == 0);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.01));
    // A stamp from the future does not keep a state fresh.
    b.input.state.stamp_ns += 1'000'000'000;
    b.input.state.sequence += 1;
    b.bare_tick();
    CHECK(b.ticks(10, false).faults == kFaultStaleState);
    CHECK(b.kept);
  }

  TEST_CASE(
      "the clutch never arms; armed, it ramps the force out and the goal goes on from there") {
    PressingBench b;
    b.input.state.switches |= kClutch;
    ServoResult r = b.ticks(200);
    CHECK(force_of(r) == Vec3::Zero());
    CHECK((r.rendered.flags & kFlagClutched) != 0);
    for (int k = 0; k < 100; ++k) {
      b.place(0, 0, 0.009 + 0.0001 * k);
      b.tick();
    }
    b.input.state.switches &= ~kClutch;
    r = b.ticks(200);
    CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.02));
    CHECK(b.kept);
    ServoBench other;
    other.tick();
    other.input.state.switches = kClutch;
    CHECK(other.ticks(20).arming == ArmingState::kDisarmed);
  }

  TEST_CASE("a fast handle feels less, by its own velocity or by its poses") {
    for (const bool sensed : {false, true}) {
      PressingBench b;
      ServoResult r;
      for (int k = 1; k <= 50; ++k) {  // 1.5 m/s: half-way from full to none
        if (!sensed) b.place(0.0015 * k, 0, 0.009);
        b.input.state.twist_valid = sensed;
        b.input.state.twist_d.linear_m_per_s[0] = 1.5_r;
        r = b.tick();
      }
      CHECK((r.limiter_flags & kLimiterSpeed) != 0);
      CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(0.5).epsilon(0.02));
      b.input.state.twist_valid = false;
      r = b.ticks(5);
      CHECK(static_cast<double>(force_of(r).z()) == doctest::Approx(1.0).epsilon(0.02));
      CHECK(b.kept);
    }
  }

  TEST_CASE("armed far in a wall that the device cannot feel: nothing to start again for") {
    ServoParameters parameters = bench_parameters();
    for (const bool driven : {true, false}) {
      parameters.limits.driven_dof = driven ? 0x3fu : 0x38u;
      ServoBench b(cube_on_floor(), parameters);
      b.tick();
      b.descend();
      for (int k = 0; k < 60; ++k) {
        b.place(0, 0, 0.009 - 0.0001 * k);
        b.tick();
      }
      b.press(true);
      b.tick();
      CHECK(((b.tick().rendered.flags & kFlagRecovery) != 0) == driven);
      CHECK(b.kept);
    }
  }

  TEST_CASE("after a long pause of the loop no jump is looked for, and the core starts again") {
    ServoParameters parameters = bench_parameters();
    parameters.limits.jump_speed_m_per_s = 0.3_r;
    PressingBench b(parameters);
    b.place(0.04, 0, 0.008);
    b.input.now_ns += 120 * kMs;
    ServoResult r = b.tick();
    CHECK(r.faults == kFaultLateTick);
    CHECK((r.rendered.flags & kFlagRecovery) != 0);
    r = b.ticks(200);
    CHECK(b.arm().arming == ArmingState::kArmed);
    b.place(0, 0, 0.008);
    b.input.now_ns += 90 * kMs;
    CHECK(b.tick().faults == (kFaultLateTick | kFaultJump));
    CHECK(b.kept);
  }

  TEST_CASE("the device away and back inside an obstacle: brought out without force") {
    PressingBench b;
    b.input.state.link = LinkState::kAbsent;
    b.ticks(50);
    b.input.state.link = LinkState::kReady;
    b.input.state.sequence = 0;
    b.place(0, 0, 0.006);
    ServoResult r = b.tick();
    CHECK((r.rendered.flags & kFlagRecovery) != 0);
    CHECK(r.rendered.wrench_w.force_w == Vec3::Zero());
    CHECK(r.faults == kFaultDeviceLost);
    b.press(false);
    b.tick();
    b.press(true);
    r = b.tick();  // armed while it is still being brought out
    CHECK(r.arming == ArmingState::kArming);
    CHECK((r.rendered.flags & kFlagRecovery) != 0);
    double last = 0;
    for (int k = 0; k < 400; ++k) {
      r = b.tick();
      if ((r.rendered.flags & kFlagRecovery) != 0) CHECK(force_of(r) == Vec3::Zero());
      CHECK(norm(force_of(r)) - last <= 0.1);
      last = norm(force_of(r));
    }
    CHECK(last == doctest::Approx(3.0).epsilon(0.01));  // 4 mm at 1 N/mm, at most 3 N
    CHECK(b.kept);
  }

  TEST_CASE("armed with the hand far in or beyond a wall: the proxy starts again, without a kick") {
    // 8 mm in: brought out, then the spring at most at the limit.
    PressingBench in;
    in.press(false);
    in.ticks(10);
    for (int k = 0; k < 70; ++k) {
      in.place(0, 0, 0.009 - 0.0001 * k);
      in.tick();
    }
    ServoResult r = in.tick();
    CHECK(static_cast<double>(r.rendered.spring_w.force_w.z()) ==
          doctest::Approx(7.9).epsilon(0.02));
    in.press(true);
    in.tick();
    CHECK(force_of(in.tick(false)) == Vec3::Zero());  // nor does the old pull come in by repetition
    CHECK((in.tick().rendered.flags & kFlagRecovery) != 0);
    double last = 0;
    for (int k = 0; k < 400; ++k) {
      r = in.tick();
      CHECK(std::abs(norm(force_of(r)) - last) <= 0.1);
      last = norm(force_of(r));
    }
    CHECK(r.arming == ArmingState::kArmed);
    CHECK(last == doctest::Approx(3.0).epsilon(0.01));
    CHECK(in.kept);
    // Through the floor and out below: free, and no pull back through it.
    PressingBench below;
    below.press(false);
    below.ticks(10);
    for (int k = 0; k < 800; ++k) {
      below.place(0, 0, 0.009 - 0.0001 * k);
      below.tick();
    }
    CHECK(norm(below.tick().rendered.spring_w.force_w) > 50.0);
    below.press(true);
    below.tick();
    for (int k = 0; k < 200; ++k) CHECK(norm(force_of(below.tick())) < 1.0e-6);
    CHECK(below.tick().arming == ArmingState::kArmed);
  }

  TEST_CASE(
      "the map: force by the scale, and the accepted wrench does the same work on both sides") {
    tools::SceneDescription description = cube_on_floor();
    description.parameters.coupling.passivity = 1;
    ServoParameters parameters;
    parameters.map.scale = 2;
    parameters.map.q_wd = so3_exp(Vec3(0, 0, std::acos(0.0_r)));
    ServoBench b(description, parameters);
    b.place(0, 0, 0.02);
    b.tick();
    const Wrench accepted = {Vec3(0.5_r, 0, 0), Vec3::Zero()};
    for (int k = 1; k <= 50; ++k) {
      b.place(0.0002 * k, 0, 0.02);
      b.input.state.accepted_d = record_of(accepted);
      b.input.state.accepted_tick = 1;
      const ServoResult r = b.tick();
      CHECK(static_cast<double>(r.rendered.goal_pose_wa.p_wa.y()) == doctest::Approx(0.0004 * k));
      CHECK(static_cast<double>(r.rendered.energy_j) ==
            doctest::Approx(-0.5 * 0.0002 * k).epsilon(1e-3));
    }
    // A device that does not say: what left here, which is nothing while nobody is armed.
    ServoBench mute(description, parameters);
    for (int k = 0; k < 300; ++k) {
      mute.place(0, 0, 0.005 - 0.0005 * std::sin(k * 0.05));
      mute.input.state.accepted_d.force_n[2] = 5;
      mute.input.state.accepted_tick = 0;
      // Of the first ticks of a touch: far below the work that 5 N would do.
      CHECK(mute.tick().rendered.energy_j > -5.0e-5_r);
    }
  }

  TEST_CASE("no heap call, in any state of arming and with faults") {
    PressingBench b;
    std::uint64_t calls = 0;
    {
      RtGuard guard;
      b.ticks(50);
      b.ticks(12, false);
      b.press(false);
      b.ticks(12);
      b.press(true);
      b.ticks(50);
      b.input.state.link = LinkState::kAbsent;
      b.ticks(5);
      b.input.state.link = LinkState::kReady;
      b.ticks(5);
      calls = guard.heap_calls();
    }
    CHECK(calls == 0);
  }

  TEST_CASE("the recorder: one record of every tick, with what a fault is explained from") {
    struct alignas(64) Line {
      std::byte bytes[64];
    };
    std::vector<Line> memory(FlightRecorder::bytes_for(32) / sizeof(Line) + 1);
    const std::span<std::byte> bytes = std::as_writable_bytes(std::span<Line>(memory));
    FlightRecorder recorder(bytes);
    ServoBench b;
    ServoTick recorded(*b.scene.core, bench_parameters(), b.scene.view.header().capacity,
                       &recorder);
    std::vector<ServoResult> results;
    std::vector<ServoInput> inputs;
    for (int k = 0; k < 20; ++k) {
      b.place(0, 0.001, 0.0105 - 0.0001 * k);
      b.press(k > 5);
      b.input.now_ns += kMs;
      if (k != 10) b.input.state.sequence += 1;
      if (k != 10) b.input.state.stamp_ns = b.input.now_ns;
      b.input.state.faults = k == 15 ? std::uint32_t{kDeviceOverheated} : 0u;
      b.input.late_periods = k == 12 ? 3 : 0;
      inputs.push_back(b.input);
      results.push_back(recorded.step(b.input));
    }
    std::vector<StepTrace> traces(32);
    REQUIRE(FlightRecorder::copy_newest(bytes, traces) == 20);
    for (std::size_t k = 0; k < 20; ++k) {
      CAPTURE(k);
      const StepTrace& t = traces[k];
      const ServoResult& r = results[k];
      CHECK(t.tick == k + 1);
      CHECK(t.sequence == inputs[k].state.sequence);
      CHECK(t.stamp_ns == inputs[k].state.stamp_ns);
      CHECK(t.now_ns == inputs[k].now_ns);
      CHECK(t.state_hash == r.rendered.state_hash);
      for (int i = 0; i < 3; ++i) {
        CHECK(t.pose_p_m[i] == static_cast<double>(inputs[k].state.pose_dh.p_m[i]));
        CHECK(t.command_force_n[i] == static_cast<double>(r.command.wrench_d.force_n[i]));
        CHECK(t.command_torque_nm[i] == static_cast<double>(r.command.wrench_d.torque_nm[i]));
        CHECK(t.rendered_force_n[i] == static_cast<double>(r.rendered.wrench_w.force_w[i]));
        CHECK(t.rendered_torque_nm[i] == static_cast<double>(r.rendered.wrench_w.torque_w[i]));
      }
      CHECK(t.pose_q_xyzw[3] == 1.0);
      CHECK(t.d_near_m == static_cast<double>(r.rendered.d_near_m));
      CHECK(t.step_flags == r.rendered.flags);
      CHECK(t.limiter_flags == r.limiter_flags);
      CHECK(t.faults == r.faults);
      CHECK(t.device_faults == inputs[k].state.faults);
      CHECK(t.switches == inputs[k].state.switches);
      CHECK(t.late_periods == inputs[k].late_periods);
      CHECK(t.link == static_cast<std::uint8_t>(LinkState::kReady));
      CHECK(t.arming == static_cast<std::uint8_t>(r.arming));
      CHECK((t.work > 0) == (k != 10));
    }
    CHECK(traces[19].faults == kFaultDevice);
    CHECK(traces[14].command_force_n[2] > 0.0);
  }
}
