// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/stack_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "host_sim/report/output_file.hpp"

namespace haptic::sim {
namespace {

// The watchdog of a slow device must span several of its periods.
constexpr double kWatchdogPeriods = 10;

const char* text_of(ArmingState state) {
  switch (state) {
    case ArmingState::kDisarmed:
      return "disarmed";
    case ArmingState::kArming:
      return "arming";
    case ArmingState::kArmed:
      return "armed";
    case ArmingState::kDisarming:
      return "disarming";
    case ArmingState::kFaulted:
      return "faulted";
  }
  return "unknown";
}

const char* text_of(LinkState state) {
  return state == LinkState::kReady      ? "ready"
         : state == LinkState::kStarting ? "starting"
                                         : "absent";
}

Vector in_double(const Vec3& v) { return v.cast<double>(); }

/// `given` where the device says it, else what is there.
void take(double given, Real& value) {
  if (given > 0) value = static_cast<Real>(given);
}

StackRecord record_of(const StackTick& tick, bool was_rendered, double delivered_j,
                      const MotionSample& wanted) {
  StackRecord out;
  LoopRecord& loop = out.loop;
  const StepResult& rendered = tick.servo.rendered;
  loop.tick = sim::record_of(tick.period, tick.t_s, rendered);
  // Before the first report nothing touches.
  if (!was_rendered) loop.tick.d_near_m = std::numeric_limits<double>::infinity();
  loop.device_wa = rendered.goal_pose_wa;
  loop.proxy_wa = rendered.proxy_pose_wa;
  std::copy(wanted.p, wanted.p + 3, loop.target_m.begin());
  loop.speed_m_per_s = tick.device.velocity_w.norm();
  loop.turn_rad_per_s = tick.device.angular_velocity_w.norm();
  loop.delivered_j = delivered_j;
  out.arming = tick.servo.arming;
  out.faults = tick.servo.faults;
  out.device_faults = tick.state.faults;
  out.link = tick.link;
  out.drives_on = tick.drives_on;
  out.handed_d = tick.handed_d;
  out.acting_w = tick.acting;
  out.sends = tick.sends;
  out.armings = tick.servo.command.arming;
  out.cuts = tick.cuts;
  return out;
}

void append_vector(std::string& csv, const Vector& v) {
  for (int k = 0; k < 3; ++k) append_number(csv += ',', v[k]);
}

}  // namespace

StackSettings stack_over(StackCarrier carrier, const DeviceModel& device,
                         const DeviceParameters& given, const HandModel& hand, double rate_hz) {
  StackSettings settings = reference_stack(carrier);
  ReferenceModelSettings& model = settings.model;
  model.device = device;
  model.hand = hand;
  model.report_rate_hz = rate_hz;
  model.watchdog_ns =
      std::max<std::int64_t>(model.watchdog_ns, std::llround(kWatchdogPeriods * 1e9 / rate_hz));
  if (device.max_force_n > 0) model.max_force_n = device.max_force_n;
  if (device.max_torque_nm > 0) model.max_torque_nm = device.max_torque_nm;

  hal::DeviceCapabilities c = hal::reference_capabilities();
  c.watchdog_ns = model.watchdog_ns;
  c.report_period_ns = std::llround(1e9 / rate_hz);
  take(model.max_force_n, c.max_force_n);
  take(model.max_torque_nm, c.max_torque_nm);
  take(given.max_force_rate_n_per_s, c.max_force_rate_n_per_s);
  take(given.max_torque_rate_nm_per_s, c.max_torque_rate_nm_per_s);
  settings.limits = hal::limits_of(c, c.report_period_ns);
  return settings;
}

std::function<HandAction(double)> scripted_hand(const CoreSession& session,
                                                std::vector<MotionSample> motion, double rate_hz) {
  const Vector grip_a = Eigen::Map<const Vector>(session.view().bodies()[0].reference_m);
  const double end_s = static_cast<double>(motion.size() - 1) / rate_hz;
  return [grip_a, end_s, rate_hz, path = std::move(motion)](double t_s) {
    const auto k = static_cast<std::size_t>(std::llround(t_s * rate_hz));
    const MotionSample& sample = path[std::min(k, path.size() - 1)];
    const double* q = sample.q_wxyz;
    HandAction action;
    action.target.q_wa = Rotation(q[0], q[1], q[2], q[3]);
    action.target.x0_w = Eigen::Map<const Vector>(sample.p) + action.target.q_wa * grip_a;
    const bool held = t_s >= kDeadmanAfter_s && t_s < end_s - kDeadmanBefore_s;
    action.switches = held ? SwitchMap{}.deadman : 0;
    return action;
  };
}

std::vector<StackRecord> run_stack(DeviceStack& stack, std::span<const MotionSample> motion,
                                   const std::function<void()>& after_step) {
  std::vector<StackRecord> records;
  records.reserve(motion.size());
  bool was_rendered = false;
  for (std::size_t k = 1; k < motion.size(); ++k) {
    const StackTick tick = stack.step();
    const double delivered_j =
        stack.bus().with_model([](const ReferenceModel& model) { return model.delivered_j(); });
    was_rendered = was_rendered || tick.servo.rendered_new;
    records.push_back(record_of(tick, was_rendered, delivered_j, motion[k]));
    if (after_step) after_step();
  }
  return records;
}

std::string stack_csv(std::span<const StackRecord> records) {
  std::string csv = loop_csv_header();
  csv +=
      ",arming,faults,device_faults,link,drives_on,handed_fx_n,handed_fy_n,handed_fz_n,"
      "handed_tx_nm,handed_ty_nm,handed_tz_nm,acting_fx_n,acting_fy_n,acting_fz_n,acting_tx_nm,"
      "acting_ty_nm,acting_tz_nm\n";
  csv.reserve(850 * (records.size() + 1));
  for (const StackRecord& r : records) {
    append_loop_row(csv, r.loop);
    csv += ',';
    csv += text_of(r.arming);
    csv += ',' + std::to_string(r.faults) + ',' + std::to_string(r.device_faults) + ',';
    csv += text_of(r.link);
    csv += r.drives_on ? ",1" : ",0";
    append_vector(csv, in_double(r.handed_d.force_w));
    append_vector(csv, in_double(r.handed_d.torque_w));
    append_vector(csv, r.acting_w.force_w);
    append_vector(csv, r.acting_w.torque_w);
    csv += '\n';
  }
  return csv;
}

StackTotals total(std::span<const StackRecord> records) {
  StackTotals t;
  if (records.empty()) return t;
  std::vector<LoopRecord> loops;
  loops.reserve(records.size());
  for (const StackRecord& r : records) loops.push_back(r.loop);
  t.loop = total(std::span<const LoopRecord>(loops));
  bool was_ready = false;
  Vector last_n = Vector::Zero(), last_nm = Vector::Zero();
  for (const StackRecord& r : records) {
    const Vector force = in_double(r.handed_d.force_w), torque = in_double(r.handed_d.torque_w);
    const bool ready = r.link == LinkState::kReady;
    t.largest_handed_n = std::max(t.largest_handed_n, force.norm());
    t.largest_handed_nm = std::max(t.largest_handed_nm, torque.norm());
    if (ready && was_ready) {
      const double step_n = (force - last_n).norm();
      if (step_n > t.largest_handed_step_n) t.handed_step_at_s = r.loop.tick.t_s;
      t.largest_handed_step_n = std::max(t.largest_handed_step_n, step_n);
      t.largest_handed_step_nm = std::max(t.largest_handed_step_nm, (torque - last_nm).norm());
    }
    last_n = force;
    last_nm = torque;
    was_ready = ready;
    if (t.faults == 0 && r.faults != 0) t.first_fault_at_s = r.loop.tick.t_s;
    t.faults |= r.faults;
    t.device_faults |= r.device_faults;
  }
  const StackRecord& end = records.back();
  t.sends = end.sends;
  t.armings = end.armings;
  t.cuts = end.cuts;
  t.ended_ready = end.link == LinkState::kReady;
  t.ended_at_zero = last_n.isZero(0) && last_nm.isZero(0);
  return t;
}

}  // namespace haptic::sim
