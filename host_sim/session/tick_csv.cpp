// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/tick_csv.hpp"

#include <cmath>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

Vec3 grip_in_part(const SceneView& view) {
  const double* at = view.bodies()[0].reference_m;
  return {static_cast<Real>(at[0]), static_cast<Real>(at[1]), static_cast<Real>(at[2])};
}

tools::JudgedTick judged_tick(const TickRecord& record) noexcept {
  return {record.status != RtStatus::kOk, record.in_contact, record.pull_n, record.flags,
          record.energy_j};
}

TickRecord record_of(std::uint64_t tick, double t_s, const StepResult& result, LawId law,
                     const Vec3& grip_a) {
  TickRecord record;
  record.tick = tick;
  record.t_s = t_s;
  for (int i = 0; i < 3; ++i) {
    record.force_n[i] = static_cast<double>(result.wrench_w.force_w[i]);
    record.torque_nm[i] = static_cast<double>(result.wrench_w.torque_w[i]);
  }
  record.d_near_m = static_cast<double>(result.d_near_m);
  record.situation = result.situation;
  const tools::JudgedTick judged = tools::judged_tick(result, law);
  record.in_contact = judged.in_contact;
  record.pull_n = judged.pull_n;
  record.near_count = result.near_count;
  record.nodes_evaluated = result.counters.feature_evaluations + result.counters.edge_pairs;
  record.support_pairs = result.counters.support_pairs;
  record.relocalised_pairs = result.counters.stale_pairs;
  record.flags = result.flags;
  record.status = result.status;
  record.state_hash = result.state_hash;
  record.proxy_gap_m = static_cast<double>(result.proxy_gap_m);
  record.energy_j = static_cast<double>(result.energy_j);
  if (const Guidance& g = result.guidance; g.state != GuideState::kNone) {
    record.guide.state = g.state;
    record.guide.station = g.station;
    record.guide.to_go_m = static_cast<double>(g.cost_m);
    record.guide.off_m = static_cast<double>(g.off_m);
    for (int i = 0; i < 3; ++i) {
      record.guide.force_n[i] = static_cast<double>(g.wrench_w.force_w[i]);
      record.guide.torque_nm[i] = static_cast<double>(g.wrench_w.torque_w[i]);
    }
  }
  record.device_wa = result.goal_pose_wa;
  record.proxy_wa = result.proxy_pose_wa;
  const auto grip_w = [&](const Pose& pose) -> Vec3 { return pose.p_wa + pose.q_wa * grip_a; };
  record.apart_m = static_cast<double>(
      std::sqrt((grip_w(result.goal_pose_wa) - grip_w(result.proxy_pose_wa)).squaredNorm()));
  return record;
}

void append_tick_row(std::string& csv, const TickRecord& t) {
  constexpr char kHex[] = "0123456789abcdef";
  csv += std::to_string(t.tick);
  csv += ',';
  append_number(csv, t.t_s);
  for (const double value : t.force_n) append_number(csv += ',', value);
  for (const double value : t.torque_nm) append_number(csv += ',', value);
  append_number(csv += ',', t.d_near_m);
  csv += ',';
  csv += to_text(t.situation);
  csv += ',' + std::to_string(t.near_count) + ',' + std::to_string(t.nodes_evaluated) + ',' +
         std::to_string(t.flags) + ',';
  for (int shift = 60; shift >= 0; shift -= 4) csv += kHex[(t.state_hash >> shift) & 15u];
  append_number(csv += ',', t.proxy_gap_m);
  append_number(csv += ',', t.energy_j);
}

void append_poses(std::string& csv, const TickRecord& tick) {
  for (const Pose& pose : {tick.proxy_wa, tick.device_wa}) {
    for (int k = 0; k < 3; ++k) append_number(csv += ',', static_cast<double>(pose.p_wa[k]));
    const Quat& q = pose.q_wa;
    for (const Real c : {q.w(), q.x(), q.y(), q.z()})
      append_number(csv += ',', static_cast<double>(c));
  }
}

std::string guide_csv_header(const GuideLegs& legs) {
  if (legs.empty()) return {};
  return ",guide,guide_station,guide_place,guide_fx_n,guide_fy_n,guide_fz_n,guide_tx_nm,"
         "guide_ty_nm,guide_tz_nm,guide_to_go_m,guide_off_m";
}

void append_guide(std::string& csv, const TickGuide& guide, const GuideLegs& legs) {
  if (legs.empty()) return;
  csv += std::string(",") + tools::to_text(guide.state) + ',' + std::to_string(guide.station) +
         ",\"" + legs.place(guide.state, guide.station) + '"';
  for (const double value : guide.force_n) append_number(csv += ',', value);
  for (const double value : guide.torque_nm) append_number(csv += ',', value);
  for (const double value : {guide.to_go_m, guide.off_m}) append_number(csv += ',', value);
}

std::string tick_csv(std::span<const TickRecord> ticks, const GuideLegs& legs) {
  std::string csv = kTickCsvHeader + guide_csv_header(legs) + kPoseCsvHeader;
  csv.reserve(400 + 480 * ticks.size());
  csv += '\n';
  for (const TickRecord& t : ticks) {
    append_tick_row(csv, t);
    append_guide(csv, t.guide, legs);
    append_poses(csv, t);
    csv += '\n';
  }
  return csv;
}

}  // namespace haptic::sim
