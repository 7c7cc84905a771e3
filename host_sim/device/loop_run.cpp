// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/loop_run.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"
#include "tools/graph_compiler/coupling/simulated_gains.hpp"

namespace haptic::sim {

namespace {

double checked_rate(double rate_hz) {
  if (!(rate_hz >= 1 && rate_hz <= 1e6))
    throw tools::InputError("the rate of the loop must be from 1 to 1e6 Hz");
  return rate_hz;
}

Vector vector_of(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

}  // namespace

ClosedLoop::ClosedLoop(CoreSession& session, const DeviceModel& device, const HandModel& hand,
                       double rate_hz, std::uint32_t number)
    : session_(session),
      rate_hz_(checked_rate(rate_hz)),
      period_s_(1.0 / rate_hz),
      grip_a_(Eigen::Map<const Vector>(session.view_of(number).bodies()[0].reference_m)),
      device_(device, hand, period_s_) {
  place({});
}

void ClosedLoop::place(const DeviceState& state) {
  session_.reset();
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

std::string fit_to_device(CoreSession& session, const DeviceModel& device, double rate_hz,
                          double late_s) {
  tools::SimulatedLoop loop;
  loop.rate_hz = rate_hz;
  DeviceParameters& d = loop.device;
  d.mass_kg = device.mass_kg;
  d.damping_ns_per_m = device.damping_ns_per_m;
  std::ranges::fill(d.rotor_inertia_kg_m2, device.rotor_kg_m2);
  std::ranges::fill(d.rotor_damping_nms_per_rad, device.rotor_damping_nms_per_rad);
  d.delay_s = device.delay_samples / rate_hz + late_s;
  const double radius_m = tools::served_size(session.view()).radius_m;
  const auto gains = tools::simulated_gains(session.view().parameters(), radius_m, loop);
  if (!gains) return {};
  session.change([&](SceneParameters& p) { gains->put(p); });
  return gains->text;
}

std::int64_t loop_stamp_ns(std::uint64_t tick, double rate_hz) {
  return std::llround(static_cast<double>(tick + 1) * 1e9 / rate_hz);
}

StepInput ClosedLoop::sample() const {
  StepInput input;
  input.sequence = tick_;
  input.stamp_ns = loop_stamp_ns(tick_, rate_hz_);
  input.pose_wa = mesh_pose(device_.sensed());
  input.accepted_wrench_w = {accepted_.force_w.cast<Real>(), accepted_.torque_w.cast<Real>()};
  input.accepted_valid = true;
  input.report_goal_contact = true;
  return input;
}

void ClosedLoop::guide(const DeviceState& state) {
  device_.place(state);
  accepted_ = {};
  static_cast<void>(session_.step(sample()));
  ++tick_;
}

LoopTick ClosedLoop::step(const HandStroke& stroke) {
  const StepInput given = sample();
  return move_on(given, session_.step(given), stroke);
}

LoopTick ClosedLoop::move_on(const StepInput& sample, const StepResult& result,
                             const HandStroke& stroke) {
  LoopTick out;
  out.tick = tick_;
  out.t_s = static_cast<double>(tick_) / rate_hz_;
  out.device = device_.state();
  out.sensed_wa = sample.pose_wa;
  out.accepted_w = sample.accepted_wrench_w;
  out.result = result;

  Load command{out.result.wrench_w.force_w.cast<double>(),
               out.result.wrench_w.torque_w.cast<double>()};
  if (const Guidance& guide = out.result.guidance; guide.state != GuideState::kNone) {
    command.force_w += guide.wrench_w.force_w.cast<double>();
    command.torque_w += guide.wrench_w.torque_w.cast<double>();
  }
  accepted_ = out.acting = device_.advance(command, stroke);
  out.delivered_j = device_.delivered_j();
  ++tick_;
  return out;
}

LoopRecord loop_record(const ClosedLoop& loop, const LoopTick& tick) {
  LoopRecord record;
  record.tick = record_of(tick.tick, tick.t_s, tick.result, loop.law(), loop.grip_in_part());
  record.tick.device_wa = tick.sensed_wa;
  record.accepted_w = tick.accepted_w;
  record.speed_m_per_s = tick.device.velocity_w.norm();
  record.turn_rad_per_s = tick.device.angular_velocity_w.norm();
  record.delivered_j = tick.delivered_j;
  return record;
}

namespace {

/// The hand's target, of a record.
void note_target(const MotionSample& sample, LoopRecord& record) {
  std::copy(sample.p, sample.p + 3, record.target_m.begin());
  std::copy(sample.q_wxyz, sample.q_wxyz + 4, record.target_wxyz.begin());
}

}  // namespace

std::vector<LoopRecord> run_loop(ClosedLoop& loop, std::span<const MotionSample> motion,
                                 const std::function<void(const LoopRecord&)>& after_tick,
                                 const std::function<void(double)>& before_tick) {
  std::vector<LoopRecord> records;
  if (motion.empty()) return records;
  records.reserve(motion.size());
  HandStroke stroke{loop.grip_of(motion[0]), loop.grip_of(motion[0])};
  loop.place({stroke.from.x0_w, stroke.from.q_wa, Vector::Zero(), Vector::Zero()});
  for (std::size_t k = 0; k < motion.size(); ++k) {
    if (k + 1 < motion.size()) stroke.to = loop.grip_of(motion[k + 1]);
    if (before_tick) before_tick(loop.time_s());
    LoopRecord record = loop_record(loop, loop.step(stroke));
    note_target(motion[k], record);
    records.push_back(record);
    if (after_tick) after_tick(record);
    stroke.from = stroke.to;
  }
  return records;
}

Hands::Each<std::vector<LoopRecord>> run_loops(
    CoreSession& session, const Hands::Each<ClosedLoop*>& loops,
    const Hands::Each<std::span<const MotionSample>>& motions,
    const std::function<void(const Hands::Each<LoopRecord>&, const Hands::Each<StepResult>&)>&
        after_tick,
    const std::function<void(double)>& before_tick) {
  Hands::Each<std::vector<LoopRecord>> records;
  if (motions[0].empty() || motions[1].empty()) return records;
  const auto target = [&](std::size_t hand, std::size_t k) {
    const std::span<const MotionSample> motion = motions[hand];
    return loops[hand]->grip_of(motion[std::min(k, motion.size() - 1)]);
  };
  Hands::Each<HandStroke> strokes;
  for (std::size_t hand = 0; hand < kMostHands; ++hand) {
    const HandTarget from = target(hand, 0);
    strokes[hand] = {from, from};
    loops[hand]->place({from.x0_w, from.q_wa, Vector::Zero(), Vector::Zero()});
  }
  const std::size_t ticks = std::max(motions[0].size(), motions[1].size());
  for (std::size_t k = 0; k < ticks; ++k) {
    if (before_tick) before_tick(loops[0]->time_s());
    const Hands::Each<StepInput> samples{loops[0]->sample(), loops[1]->sample()};
    const Hands::Each<StepResult> results = session.step_both({&samples[0], &samples[1]});
    Hands::Each<LoopRecord> tick;
    for (std::size_t hand = 0; hand < kMostHands; ++hand) {
      HandStroke& stroke = strokes[hand];
      stroke.to = target(hand, k + 1);
      tick[hand] =
          loop_record(*loops[hand], loops[hand]->move_on(samples[hand], results[hand], stroke));
      note_target(motions[hand][std::min(k, motions[hand].size() - 1)], tick[hand]);
      records[hand].push_back(tick[hand]);
      stroke.from = stroke.to;
    }
    if (after_tick) after_tick(tick, results);
  }
  return records;
}

std::string loop_csv_header() {
  return tick_columns(TickTable::kCsv) + tick_columns(TickTable::kCsvPoses) +
         ",hand_x_m,hand_y_m,hand_z_m,speed_m_per_s,turn_rad_per_s,delivered_j";
}

void append_loop_row(std::string& csv, const LoopRecord& record) {
  append_cells(csv, TickTable::kCsv, record.tick);
  append_cells(csv, TickTable::kCsvPoses, record.tick);
  for (const double value : record.target_m) append_number(csv += ',', value);
  for (const double value : {record.speed_m_per_s, record.turn_rad_per_s, record.delivered_j}) {
    append_number(csv += ',', value);
  }
}

std::string last_columns(const GuideLegs& legs) {
  return tick_columns(TickTable::kCsvGuide, legs) + tick_columns(TickTable::kCsvAdded);
}

void append_last_cells(std::string& csv, const TickRecord& tick, const GuideLegs& legs) {
  append_cells(csv, TickTable::kCsvGuide, tick, legs);
  append_cells(csv, TickTable::kCsvAdded, tick);
}

std::string loop_csv(std::span<const LoopRecord> records, const GuideLegs& legs) {
  std::string csv = loop_csv_header() + last_columns(legs) + '\n';
  csv.reserve(600 * (records.size() + 1));
  for (const LoopRecord& record : records) {
    append_loop_row(csv, record);
    append_last_cells(csv, record.tick, legs);
    csv += '\n';
  }
  return csv;
}

LoopTotals total(std::span<const LoopRecord> records) {
  LoopTotals t;
  t.ticks = records.size();
  t.smallest_gap_m = records.empty() ? 0 : records.front().tick.proxy_gap_m;
  Vector last_force = Vector::Zero(), last_torque = Vector::Zero();
  for (std::size_t k = 0; k < records.size(); ++k) {
    const LoopRecord& r = records[k];
    const Vector force = vector_of(r.tick.force_n), torque = vector_of(r.tick.torque_nm);
    t.finite = t.finite && std::isfinite(force.sum() + torque.sum() + r.speed_m_per_s +
                                         r.turn_rad_per_s + r.delivered_j);
    t.largest_force_n = std::max(t.largest_force_n, force.norm());
    t.largest_torque_nm = std::max(t.largest_torque_nm, torque.norm());
    t.refused_poses += r.tick.status != RtStatus::kOk ? 1u : 0u;
    t.contact_ticks += r.tick.in_contact ? 1u : 0u;
    t.largest_speed_m_per_s = std::max(t.largest_speed_m_per_s, r.speed_m_per_s);
    t.largest_turn_rad_per_s = std::max(t.largest_turn_rad_per_s, r.turn_rad_per_s);
    t.largest_delivered_j = std::max(t.largest_delivered_j, r.delivered_j);
    t.least_energy_j = std::min(t.least_energy_j, r.tick.energy_j);
    t.smallest_gap_m = std::min(t.smallest_gap_m, r.tick.proxy_gap_m);
    if (k > 0 && (force - last_force).norm() > t.largest_force_step_n) {
      t.largest_force_step_n = (force - last_force).norm();
      t.force_step_at_s = r.tick.t_s;
    }
    if (k > 0 && (torque - last_torque).norm() > t.largest_torque_step_nm) {
      t.largest_torque_step_nm = (torque - last_torque).norm();
      t.torque_step_at_s = r.tick.t_s;
    }
    last_force = force;
    last_torque = torque;
    if (10 * (records.size() - k) > records.size()) continue;
    t.rest_speed_m_per_s = std::max(t.rest_speed_m_per_s, r.speed_m_per_s);
    t.rest_turn_rad_per_s = std::max(t.rest_turn_rad_per_s, r.turn_rad_per_s);
  }
  if (!records.empty()) {
    t.duration_s = records.back().tick.t_s - records.front().tick.t_s;
    t.delivered_j = records.back().delivered_j;
  }
  return t;
}

}  // namespace haptic::sim
