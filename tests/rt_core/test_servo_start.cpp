// SPDX-License-Identifier: Apache-2.0
// Where the part begins: where the scene has it start, wherever the handle is; and why nothing
// arms.
#include <doctest/doctest.h>

#include "rt_core/base/rotation.hpp"
#include "tests/support/pruned_scenes.hpp"
#include "tests/support/servo_bench.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kRounding = HAPTIC_REAL_IS_FLOAT ? 1e-6 : 1e-12;

/// The cube begins 2 mm above the floor, a little beside and turned about z.
StartPlace start_above() {
  StartPlace start{true, true, {}};
  start.pose_wa.p_wa = Vec3(0.003_r, -0.002_r, 0.012_r);
  start.pose_wa.q_wa = so3_exp(Vec3(0, 0, 0.4_r));
  return start;
}

ServoParameters starting() {
  ServoParameters parameters = bench_parameters();
  parameters.start = start_above();
  return parameters;
}

void check_at(const Pose& pose, const Pose& wanted) {
  CHECK(norm(pose.p_wa - wanted.p_wa) <= kRounding);
  CHECK(norm(so3_log((pose.q_wa * wanted.q_wa.conjugate()).normalized())) <= kRounding);
}

/// The handle at `p`, turned by `turn`.
void hold_at(ServoBench& b, const Vec3& p, const Vec3& turn) {
  b.input.state.pose_dh = record_of(Pose{p, so3_exp(turn)});
}

}  // namespace

TEST_SUITE("rt_core.servo_start") {
  TEST_CASE("the part begins at the scene's start wherever the handle is, and is led from there") {
    for (const Vec3& turn : {Vec3(0, 0, 0), Vec3(0.3_r, -0.2_r, 1.1_r)}) {
      ServoBench b(cube_on_floor(), starting());
      hold_at(b, Vec3(0.3_r, 0.2_r, -0.4_r), turn);
      ServoResult r = b.tick();
      CHECK(r.began);
      check_at(r.rendered.goal_pose_wa, start_above().pose_wa);
      CHECK(r.faults == 0);
      r = b.arm();
      CHECK_FALSE(r.began);
      CHECK(r.arming == ArmingState::kArmed);
      check_at(r.rendered.goal_pose_wa, start_above().pose_wa);
      // A way and a turn of the handle in D are those of the part in W: about the same axes.
      const Vec3 further(0, 0, 0.1_r);
      b.input.state.pose_dh = record_of(
          Pose{Vec3(0.301_r, 0.2_r, -0.4_r), (so3_exp(further) * so3_exp(turn)).normalized()});
      r = b.tick();
      Pose wanted = start_above().pose_wa;
      wanted.p_wa.x() += 0.001_r;
      wanted.q_wa = so3_exp(further) * wanted.q_wa;
      check_at(r.rendered.goal_pose_wa, wanted);
      CHECK(b.kept);
    }
  }

  TEST_CASE(
      "with the place alone the turn is the handle's; without either all is as the map has it") {
    ServoParameters parameters = starting();
    parameters.start.turn = false;
    ServoBench b(cube_on_floor(), parameters);
    hold_at(b, Vec3(0.3_r, 0.2_r, -0.4_r), Vec3(0, 0, 0.1_r));
    Pose wanted = start_above().pose_wa;
    wanted.q_wa = so3_exp(Vec3(0, 0, 0.1_r));
    check_at(b.tick().rendered.goal_pose_wa, wanted);
    parameters.start.place = false;
    ServoBench absolute(cube_on_floor(), parameters);
    hold_at(absolute, Vec3(0.3_r, 0.2_r, 0.4_r), Vec3(0, 0, 0.1_r));
    check_at(absolute.tick().rendered.goal_pose_wa,
             Pose{Vec3(0.3_r, 0.2_r, 0.4_r), so3_exp(Vec3(0, 0, 0.1_r))});
  }

  TEST_CASE("scale, axes and a tool tip: the grip point begins where the start has it") {
    ServoParameters parameters = starting();
    parameters.map.scale = 2;
    parameters.map.q_wd = so3_exp(Vec3(0, 1.2_r, 0.3_r));
    parameters.map.handle_offset_h = Vec3(0.03_r, 0, -0.02_r);
    ServoBench b(cube_on_floor(), parameters);
    hold_at(b, Vec3(0.1_r, 0, 0.05_r), Vec3(0.5_r, 0, 0));
    check_at(b.tick().rendered.goal_pose_wa, start_above().pose_wa);
    CHECK(b.arm().arming == ArmingState::kArmed);
    b.input.state.pose_dh.p_m[0] += 0.001_r;
    const StepResult r = b.tick().rendered;
    CHECK(norm(r.goal_pose_wa.p_wa - start_above().pose_wa.p_wa) ==
          doctest::Approx(0.002).epsilon(1e-4));
  }

  TEST_CASE(
      "after a fault the part begins there again at the press; a release alone changes nothing") {
    ServoBench b(cube_on_floor(), starting());
    b.place(0, 0, 0);
    b.arm();
    b.place(0.001, 0, 0);
    ServoResult r = b.tick();
    b.press(false);
    b.ticks(150);
    r = b.arm();
    CHECK_FALSE(r.began);
    CHECK(r.rendered.goal_pose_wa.p_wa.x() == doctest::Approx(0.004).epsilon(1e-6));
    b.input.state.switches |= kStop;
    CHECK((b.tick().faults & kFaultEmergencyStop) != 0);
    b.input.state.switches &= ~kStop;
    b.press(false);
    r = b.ticks(200);
    CHECK(r.arming == ArmingState::kFaulted);
    CHECK_FALSE(r.began);
    b.press(true);
    r = b.tick();
    CHECK(r.arming == ArmingState::kArming);
    r = b.tick();
    CHECK(r.began);
    check_at(r.rendered.goal_pose_wa, start_above().pose_wa);
    CHECK(b.ticks(150).arming == ArmingState::kArmed);
    CHECK(b.kept);
  }

  TEST_CASE("an envelope that was left needs no way back: the part begins inside again") {
    for (const bool finds : {true, false}) {
      tools::SceneDescription d = cube_on_floor();
      d.workspace = tools::WorkspaceBox{{-0.02, -0.05, -0.02}, {0.02, 0.05, 0.05}};
      d = with_envelope(d, {0, 0, 0, 1}, 2.0);
      ServoParameters parameters = starting();
      parameters.start.place = parameters.start.turn = finds;
      ServoBench b(d, parameters);
      b.place(0, 0, 0.012);
      b.arm();
      ServoResult r;
      for (int k = 0; k < 300 && r.faults == 0; ++k) {
        b.place(0.0002 * k, 0, 0.012);
        r = b.tick();
      }
      CHECK(r.faults == kFaultWorkspace);
      b.place(0.022, 0, 0.012);
      b.ticks(200);
      b.press(false);
      b.ticks(5);
      r = b.arm();  // where the handle is
      CHECK(r.arming == (finds ? ArmingState::kArmed : ArmingState::kFaulted));
      CHECK(r.rendered.goal_pose_wa.p_wa.x() < 0.0201_r);
      CHECK(b.kept);
    }
  }

  TEST_CASE("a start that is no pose is a parameter that cannot be used") {
    ServoParameters parameters = starting();
    parameters.start.pose_wa.q_wa = Quat(0, 0, 0, 0);
    ServoBench b(cube_on_floor(), parameters);
    CHECK(b.arm().faults == kFaultInternal);
  }

  TEST_CASE("why nothing arms, one cause at a time") {
    ServoBench b;
    b.press(true);
    b.input.state.link = LinkState::kStarting;
    CHECK((b.tick().waits & kWaitDevice) != 0);
    b.input.state.link = LinkState::kReady;
    b.input.state.faults = kDeviceNotHomed;
    CHECK((b.tick().waits & kWaitHomed) != 0);
    b.input.state.faults = 0;
    b.place(0, 0, 0.02);
    ServoResult r = b.ticks(3);
    CHECK(r.waits == kWaitDeadmanReleased);
    b.press(false);
    CHECK(b.ticks(3).waits == kWaitDeadmanPressed);
    b.press(true);
    CHECK(b.tick().waits == 0);
    CHECK(b.ticks(150).waits == 0);
    b.input.emergency_stop = true;
    r = b.tick();
    CHECK((r.waits & kWaitCause) != 0);
    CHECK(r.present == kFaultEmergencyStop);
    b.input.emergency_stop = false;
    CHECK((b.tick().waits & kWaitCause) == 0);
    CHECK(b.ticks(200).waits == kWaitDeadmanReleased);
    // A part inside is led out first.
    ServoBench inside;
    inside.place(0, 0, 0.008);
    r = inside.tick();
    CHECK((r.waits & (kWaitInside | kWaitCause)) == (kWaitInside | kWaitCause));
    CHECK(r.present == kFaultScene);
    for (int k = 0; k < 1000 && (r.waits & kWaitInside) != 0; ++k) r = inside.tick();
    CHECK(r.waits == kWaitDeadmanPressed);
  }
}
