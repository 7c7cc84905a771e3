// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/closed_loop.hpp"

#include <cmath>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

double checked_rate(double rate_hz) {
  if (!(rate_hz >= 1 && rate_hz <= 1e6))
    throw tools::InputError("the rate of the loop must be from 1 to 1e6 Hz");
  return rate_hz;
}

}  // namespace

ClosedLoop::ClosedLoop(CoreSession& session, const DeviceModel& device, const HandModel& hand,
                       double rate_hz)
    : session_(session),
      rate_hz_(checked_rate(rate_hz)),
      period_s_(1.0 / rate_hz),
      grip_a_(Eigen::Map<const Vector>(session.view().bodies()[0].reference_m)),
      device_(device, hand, period_s_) {
  place({});
}

void ClosedLoop::place(const DeviceState& state) {
  session_.core().reset();
  device_.place(state);
  accepted_ = {};
  tick_ = 0;
}

HandTarget ClosedLoop::grip_of(const Vector& p_wa, const Rotation& q_wa) const {
  return {p_wa + q_wa * grip_a_, q_wa};
}

HandTarget ClosedLoop::grip_of(const MotionSample& sample) const {
  const double* q = sample.q_wxyz;
  return grip_of(Eigen::Map<const Vector>(sample.p), Rotation(q[0], q[1], q[2], q[3]));
}

Pose ClosedLoop::mesh_pose(const HandTarget& grip) const {
  return pose_at(grip.x0_w - grip.q_wa * grip_a_, grip.q_wa);
}

StepInput ClosedLoop::input() const {
  StepInput input;
  input.sequence = tick_;
  // Counted from one period on: a stamp of 0 means "not stamped".
  input.stamp_ns = std::llround(static_cast<double>(tick_ + 1) * 1e9 / rate_hz_);
  input.pose_wa = mesh_pose(device_.sensed());
  input.accepted_wrench_w = {accepted_.force_w.cast<Real>(), accepted_.torque_w.cast<Real>()};
  input.accepted_valid = true;
  input.report_goal_contact = true;
  return input;
}

void ClosedLoop::guide(const DeviceState& state) {
  device_.place(state);
  accepted_ = {};
  static_cast<void>(session_.core().step(input()));
  ++tick_;
}

LoopTick ClosedLoop::step(const HandStroke& stroke) {
  LoopTick out;
  out.tick = tick_;
  out.t_s = static_cast<double>(tick_) / rate_hz_;
  out.device = device_.state();
  const StepInput sample = input();
  out.sensed_wa = sample.pose_wa;
  out.result = session_.core().step(sample);

  const Load command{out.result.wrench_w.force_w.cast<double>(),
                     out.result.wrench_w.torque_w.cast<double>()};
  accepted_ = out.acting = device_.advance(command, stroke);
  out.delivered_j = device_.delivered_j();
  ++tick_;
  return out;
}

}  // namespace haptic::sim
