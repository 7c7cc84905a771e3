// SPDX-License-Identifier: Apache-2.0
// Leaving the scene's envelope in contact: no jump, a ramp, a flag that stays, and the way back.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "rt_core/base/rotation.hpp"
#include "tests/support/pruned_scenes.hpp"
#include "tests/support/servo_bench.hpp"
#include "tests/support/vector_norm.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kMax_rad = 0.3;
constexpr std::array<double, 4> kUpright = {0, 0, 0, 1};

double angle_of(const Pose& pose) { return norm(so3_log(pose.q_wa.normalized())); }

/// A cube of 20 mm on a floor, turned about z at most.
tools::SceneDescription enclosed(LawId law, bool boxed) {
  tools::SceneDescription d = proxy_scene_of(box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}),
                                             {box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0})});
  d.parameters.law = law;
  if (boxed) d.workspace = tools::WorkspaceBox{{-0.02, -0.05, -0.02}, {0.02, 0.05, 0.05}};
  return with_envelope(d, kUpright, kMax_rad);
}

/// One hand motion: presses, goes out by a turn or a shift, comes back.
struct Excursion {
  bool by_turn = true;
  [[nodiscard]] StepInput at(int t) const {
    StepInput input;
    input.stamp_ns = 1'000'000 * (t + 1);
    const double press = std::min(t, 200) / 200.0;
    const double out = t < 300    ? 0
                       : t < 800  ? (t - 300) / 500.0
                       : t < 1300 ? (1300 - t) / 500.0
                                  : 0;
    input.pose_wa.p_wa = Vec3(static_cast<Real>(by_turn ? 0 : 0.03 * out), 0,
                              static_cast<Real>(0.011 - 0.002 * press));
    if (by_turn) input.pose_wa.q_wa = so3_exp(Vec3(0, 0, static_cast<Real>(0.5 * out)));
    return input;
  }
};

}  // namespace

TEST_SUITE("rt_core.envelope") {
  TEST_CASE("out of the envelope in contact: ramped, flagged, latched, and reset takes it up") {
    for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
      for (const bool by_turn : {true, false}) {
        CAPTURE(static_cast<int>(law));
        CAPTURE(by_turn);
        LoadedScene scene(enclosed(law, true));
        const Excursion hand{by_turn};
        Vec3 last = Vec3::Zero();
        double jump = 0, pressed = 0;
        int left_at = 0;
        for (int t = 0; t < 1500; ++t) {
          const StepResult r = scene.core->step(hand.at(t));
          CAPTURE(t);
          jump = std::max(jump, norm(r.wrench_w.force_w - last));
          last = r.wrench_w.force_w;
          const bool flagged = (r.flags & kFlagOutsideEnvelope) != 0;
          if (t == 299) pressed = norm(last);
          if (flagged && left_at == 0) left_at = t;
          if (left_at > 0) CHECK(flagged);
          if (left_at > 0 && t > left_at + 120) CHECK(last == Vec3::Zero());
          // The last tick before had room for one more like it.
          if (left_at == 0) {
            CHECK(angle_of(r.goal_pose_wa) + 0.001 <= kMax_rad + 1e-6);
            CHECK(std::abs(r.goal_pose_wa.p_wa.x()) <= 0.02_r);
          }
        }
        CHECK(left_at > 300);
        CHECK(left_at < 800);
        CHECK(pressed > 0.5);
        CHECK(jump < 0.1 * pressed);
        scene.core->reset();
        StepResult r;
        for (int t = 0; t < 300; ++t) r = scene.core->step(hand.at(t));
        CHECK((r.flags & kFlagOutsideEnvelope) == 0);
        CHECK(norm(r.wrench_w.force_w) == doctest::Approx(pressed).epsilon(1e-3));
      }
    }
  }

  TEST_CASE("law proxy, left while pressing: the goal stays there, and nothing is worked for it") {
    for (const bool by_turn : {true, false}) {
      CAPTURE(by_turn);
      LoadedScene scene(enclosed(LawId::kProxy, true));
      const Excursion hand{by_turn};
      Pose stays;
      int left_at = 0, asked_inside = 0;
      std::uint32_t work_before = 0, work_after = 0;
      for (int t = 0; t < 1500; ++t) {
        CAPTURE(t);
        const StepResult r = scene.core->step(hand.at(t));
        if (left_at == 0) {
          if ((r.flags & kFlagOutsideEnvelope) != 0) {
            left_at = t;
            stays = r.goal_pose_wa;
          }
          if (t >= 280) work_before = std::max(work_before, r.counters.work_units);
          continue;
        }
        if (HAPTIC_REAL_IS_FLOAT && t == left_at + 1) {
          // The tick that leaves tells the device's pose as it was given, those after it the same
          // of unit length: so3_exp is that within some roundings.
          CHECK((r.goal_pose_wa.q_wa.coeffs() - stays.q_wa.coeffs()).norm() < 4 * kRealEpsilon);
          stays.q_wa = r.goal_pose_wa.q_wa;
        }
        CHECK(r.goal_pose_wa.p_wa == stays.p_wa);
        CHECK(r.goal_pose_wa.q_wa.coeffs() == stays.q_wa.coeffs());
        // Where the device asks for is still told: it comes back.
        if (t < 900) CHECK(r.outside != 0);
        asked_inside += r.outside == 0 ? 1 : 0;
        if (t > left_at + 10) work_after = std::max(work_after, r.counters.work_units);
      }
      CHECK(left_at > 300);
      CHECK(asked_inside > 200);
      CHECK(work_after <= work_before);
      scene.core->reset();
      const StepResult again = scene.core->step(hand.at(0));
      CHECK(again.flags == 0);
      CHECK(again.goal_pose_wa.p_wa == hand.at(0).pose_wa.p_wa);
    }
  }

  TEST_CASE("a scene without an envelope is never left") {
    tools::SceneDescription d = enclosed(LawId::kPaper, true);
    d.orientation.reset();
    d.workspace.reset();
    d.marks.clear();
    LoadedScene scene(d);
    for (int t = 0; t < 1500; ++t) {
      const StepResult r = scene.core->step(Excursion{t % 2 == 0}.at(t));
      CHECK((r.flags & kFlagOutsideEnvelope) == 0);
      CHECK(r.outside == 0);
    }
  }

  TEST_CASE("the proxy never leaves, for any motion of the hand and any obstacles") {
    tools::SceneDescription d = enclosed(LawId::kProxy, true);
    d.statics.push_back({box({0.005, -0.1, 0}, {0.1, 0.1, 0.05}), {0, 0, 0}, {1, 0, 0, 0}});
    d.marks.clear();
    d = with_envelope(d, kUpright, kMax_rad);
    LoadedScene scene(d);
    Random random(85);
    Point p = {-0.01, 0, 0.02};
    std::array<double, 3> turn = {0, 0, 0};
    std::array<double, 6> speed{};
    double farthest_rad = 0, farthest_m = 0;
    int held = 0, near_limit = 0;
    for (int t = 0; t < 20000; ++t) {
      if (t % 400 == 0) {
        for (double& v : speed) v = random.uniform(-1, 1);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = std::clamp(p[k] + 1e-4 * speed[k], -0.04, 0.06);
        turn[k] = std::clamp(turn[k] + 2e-3 * speed[k + 3], -0.5, 0.5);
      }
      StepInput input;
      input.pose_wa.p_wa =
          Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2]));
      input.pose_wa.q_wa = so3_exp(
          Vec3(static_cast<Real>(turn[0]), static_cast<Real>(turn[1]), static_cast<Real>(turn[2])));
      const StepResult r = scene.core->step(input);
      // As the servo tick has it: what was left is latched until the hand is back.
      if ((r.flags & kFlagOutsideEnvelope) != 0 && r.outside == 0) scene.core->reset();
      farthest_rad = std::max(farthest_rad, angle_of(r.proxy_pose_wa));
      farthest_m = std::max(farthest_m, static_cast<double>(std::abs(r.proxy_pose_wa.p_wa.x())));
      held += r.potential_j > 1e-6_r ? 1 : 0;
      near_limit += angle_of(r.proxy_pose_wa) > kMax_rad - 0.01 ? 1 : 0;
    }
    constexpr double kRounding = HAPTIC_REAL_IS_FLOAT ? 1e-5 : 1e-12;
    CHECK(farthest_rad <= kMax_rad + kRounding);
    CHECK(farthest_m <= 0.02 + kRounding);
    CHECK(held > 1000);
    CHECK(near_limit > 100);
  }

  TEST_CASE("hold_inside: the nearest turn and place, bits kept inside") {
    MotionEnvelope e;
    e.max_angle_rad = 0.2_r;
    e.half_extent_m = Vec3(0.1_r, 0, 0);
    GripPose pose;
    pose.x0_w = Vec3(0.05_r, 7, 0);
    pose.q_wa = so3_exp(Vec3(0.1_r, 0.05_r, 0));
    pose.r_wa = pose.q_wa.toRotationMatrix();
    const GripPose before = pose;
    CHECK_FALSE(hold_inside(e, pose));
    CHECK(pose.q_wa.coeffs() == before.q_wa.coeffs());
    CHECK(pose.x0_w == before.x0_w);
    pose.x0_w.x() = -3;
    pose.q_wa = so3_exp(Vec3(0, 0.7_r, 0));
    CHECK(hold_inside(e, pose));
    CHECK(pose.x0_w == Vec3(-0.1_r, 7, 0));
    CHECK(norm(so3_log(pose.q_wa) - Vec3(0, 0.2_r, 0)) < (HAPTIC_REAL_IS_FLOAT ? 1e-5 : 1e-12));
    CHECK(norm(so3_log(pose.q_wa)) <= static_cast<double>(e.max_angle_rad));
    e.max_angle_rad = std::numeric_limits<Real>::quiet_NaN();
    CHECK_FALSE(is_usable(e));
  }

  TEST_CASE("the servo tick takes the scene's envelope: fault, no force, armed again inside") {
    tools::SceneDescription d = cube_on_floor();
    d.orientation = tools::OrientationEnvelope{kUpright, kMax_rad};
    ServoBench b(d);
    b.descend();
    b.arm();
    ServoResult r = b.tick();
    REQUIRE(norm(force_of(r)) > 0.5);
    const PoseRecord record = b.input.state.pose_dh;
    const Vec3 at = pose_of(record).p_wa;
    const auto turned = [&](double angle) {
      b.input.state.pose_dh = record_of(Pose{at, so3_exp(Vec3(0, 0, static_cast<Real>(angle)))});
    };
    int k = 0;
    for (; k < 400 && (r.faults & kFaultEnvelope) == 0; ++k) {
      turned(0.001 * k);
      r = b.tick();
    }
    CHECK(r.faults == kFaultEnvelope);
    CHECK(std::abs(k - 300) <= 2);
    for (; k < 500; ++k) {
      turned(0.001 * std::min(k, 400));
      r = b.tick();
    }
    CHECK(r.arming == ArmingState::kFaulted);
    CHECK(force_of(r) == Vec3::Zero());
    for (k = 400; k > 0; --k) {  // back, and nothing comes of itself
      turned(0.001 * k);
      r = b.tick();
      CHECK(force_of(r) == Vec3::Zero());
    }
    CHECK(r.faults == kFaultEnvelope);
    r = b.arm();
    CHECK(r.faults == 0);
    CHECK(r.arming == ArmingState::kArmed);
    CHECK((r.rendered.flags & kFlagOutsideEnvelope) == 0);
    CHECK(b.kept);
  }
}
