// SPDX-License-Identifier: Apache-2.0
#include "tests/support/servo_bench.hpp"

#include <algorithm>
#include <stdexcept>

namespace haptic::test {
namespace {

constexpr double kRounding = 64.0 * static_cast<double>(kRealEpsilon);

double length(const Vec3& v) { return static_cast<double>(v.norm()); }

/// A step from `last` to `now` within slew and limit.
bool is_calm(const Vec3& last, const Vec3& now, Real limit, Real slew_per_s, double elapsed_s) {
  const double most = static_cast<double>(limit);
  return is_finite(now) && length(now) <= most &&
         length(now - last) <= static_cast<double>(slew_per_s) * elapsed_s + kRounding * most;
}

}  // namespace

tools::SceneDescription cube_on_floor() {
  return proxy_scene_of(box({-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}),
                        {box({-0.1, -0.1, -0.05}, {0.1, 0.1, 0})});
}

ServoParameters bench_parameters() {
  ServoParameters parameters;
  parameters.switches.emergency_stop = kStop;
  return parameters;
}

ServoBench::ServoBench(const tools::SceneDescription& description,
                       const ServoParameters& parameters)
    : scene(description),
      limits(usable(parameters.limits)),
      servo(*scene.core, parameters, scene.view.header().capacity, nullptr) {
  input.now_ns = 1000 * kMs;
  input.report_goal_contact = true;
  input.state.link = LinkState::kReady;
  place(0, 0, 0.012);
}

void ServoBench::place(double x, double y, double z) {
  input.state.pose_dh.p_m[0] = static_cast<Real>(x);
  input.state.pose_dh.p_m[1] = static_cast<Real>(y);
  input.state.pose_dh.p_m[2] = static_cast<Real>(z);
}

void ServoBench::press(bool held) {
  input.state.switches = held ? input.state.switches | kDeadman : input.state.switches & ~kDeadman;
}

ServoResult ServoBench::tick(bool is_new) {
  input.now_ns += kMs;
  if (is_new) {
    input.state.sequence += 1;
    input.state.stamp_ns = input.now_ns - kMs / 5;
  }
  return bare_tick();
}

ServoResult ServoBench::bare_tick() {
  const ServoResult r = servo.step(input);
  const double passed_s = static_cast<double>(input.now_ns - last_now_ns_) * 1.0e-9;
  const auto longest_s = static_cast<double>(longest_step_s(limits.period_ns));
  const double elapsed_s = has_ticked_ ? std::clamp(passed_s, 0.0, longest_s) : 0.0;
  kept =
      kept &&
      is_calm(last_force_n_, force_of(r), limits.max_force_n, limits.slew_n_per_s, elapsed_s) &&
      is_calm(last_torque_nm_, torque_of(r), limits.max_torque_nm, limits.slew_nm_per_s, elapsed_s);
  has_ticked_ = true;
  last_now_ns_ = input.now_ns;
  last_force_n_ = force_of(r);
  last_torque_nm_ = torque_of(r);
  input.state.accepted_d = r.command.wrench_d;
  input.state.accepted_tick = r.command.tick;
  return r;
}

ServoResult ServoBench::ticks(int count, bool is_new) {
  ServoResult r;
  for (int k = 0; k < count; ++k) r = tick(is_new);
  return r;
}

ServoResult ServoBench::arm() {
  press(false);
  ticks(12);
  press(true);
  return ticks(130);
}

void ServoBench::descend() {
  for (int k = 0; k <= 30; ++k) {
    place(0, 0, 0.012 - 0.0001 * k);
    tick();
  }
}

PressingBench::PressingBench(const ServoParameters& parameters)
    : ServoBench(cube_on_floor(), parameters) {
  tick();
  descend();
  const ServoResult r = arm();
  if (r.arming != ArmingState::kArmed || length(force_of(r) - Vec3(0, 0, 1)) > 1.0e-3) {
    throw std::runtime_error("the bench does not press on the floor");
  }
}

}  // namespace haptic::test
