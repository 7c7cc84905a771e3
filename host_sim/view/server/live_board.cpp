// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/server/live_board.hpp"

#include <algorithm>
#include <bit>

namespace haptic::sim {
namespace {

/// A reader that copies the oldest ticks is not overtaken by so many new ones.
constexpr std::uint64_t kMargin = 1024;

void put(const Pose& pose, double (&p)[3], double (&q)[4]) {
  for (int k = 0; k < 3; ++k) p[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) q[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
}

Pose pose_in(const double (&p)[3], const double (&q)[4]) {
  return {Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2])),
          Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
               static_cast<Real>(q[2]))};
}

}  // namespace

void LiveWriter::publish(const LiveTick& tick, LiveState state) noexcept {
  LiveBoard::Record& record = board_.ring[written_ % LiveBoard::kTicks];
  record.write(static_cast<RecordWord>(written_ + 1),
               std::bit_cast<LiveBoard::Record::Words>(tick));
  state.tick = written_;
  newest_.publish(state);
  last_ = state;
  ++written_;
  // Release: who sees the count sees the tick.
  board_.written.store(written_, std::memory_order_release);
}

void LiveWriter::finish() noexcept {
  last_.is_over = 1;
  newest_.publish(last_);
}

std::size_t LiveReader::copy(std::uint64_t& first, std::span<LiveTick> out) const noexcept {
  const std::uint64_t end = written();
  if (end > LiveBoard::kTicks - kMargin)
    first = std::max(first, end - (LiveBoard::kTicks - kMargin));
  std::size_t copied = 0;
  while (copied < out.size() && first + copied < end) {
    const std::uint64_t tick = first + copied;
    LiveBoard::Record::Words words;
    if (!board_.ring[tick % LiveBoard::kTicks].copy(static_cast<RecordWord>(tick + 1), words)) {
      if (copied > 0) break;
      first += 1;  // overwritten meanwhile
      continue;
    }
    out[copied] = std::bit_cast<LiveTick>(words);
    ++copied;
  }
  return copied;
}

LiveTick live_tick(const RecordedTick& tick, std::uint64_t sequence) { return {tick, sequence}; }

LiveState live_state(const LoopRecord& record, double hand_stamp) {
  const TickRecord& tick = record.tick;
  LiveState state;
  state.t_s = tick.t_s;
  put(record.tick.device_wa, state.device_p_m, state.device_q_xyzw);
  put(record.tick.proxy_wa, state.felt_p_m, state.felt_q_xyzw);
  std::copy_n(tick.force_n, 3, state.force_n);
  std::copy_n(tick.torque_nm, 3, state.torque_nm);
  state.apart_m = tick.apart_m;
  state.gap_m = tick.proxy_gap_m;
  state.d_near_m = tick.d_near_m;
  state.energy_j = tick.energy_j;
  state.state_hash = tick.state_hash;
  state.hand_stamp = hand_stamp;
  state.situation = static_cast<std::uint32_t>(tick.situation);
  state.flags = tick.flags;
  state.status = static_cast<std::uint32_t>(tick.status);
  state.work = tick.nodes_evaluated;
  std::copy_n(tick.guide.force_n, 3, state.guide_force_n);
  std::copy_n(tick.guide.torque_nm, 3, state.guide_torque_nm);
  state.guide_to_go_m = tick.guide.to_go_m;
  state.guide_off_m = tick.guide.off_m;
  state.guide_state = static_cast<std::uint32_t>(tick.guide.state);
  state.guide_station = tick.guide.station;
  return state;
}

LoopRecord record_of(const LiveState& state) {
  LoopRecord record;
  TickRecord& tick = record.tick;
  tick.tick = state.tick;
  tick.t_s = state.t_s;
  std::copy_n(state.force_n, 3, tick.force_n);
  std::copy_n(state.torque_nm, 3, tick.torque_nm);
  tick.apart_m = state.apart_m;
  tick.proxy_gap_m = state.gap_m;
  tick.d_near_m = state.d_near_m;
  tick.energy_j = state.energy_j;
  tick.state_hash = state.state_hash;
  tick.situation = static_cast<ContactSituation>(state.situation);
  tick.flags = state.flags;
  tick.nodes_evaluated = state.work;
  std::copy_n(state.guide_force_n, 3, tick.guide.force_n);
  std::copy_n(state.guide_torque_nm, 3, tick.guide.torque_nm);
  tick.guide.to_go_m = state.guide_to_go_m;
  tick.guide.off_m = state.guide_off_m;
  tick.guide.state = static_cast<GuideState>(state.guide_state);
  tick.guide.station = state.guide_station;
  record.tick.device_wa = pose_in(state.device_p_m, state.device_q_xyzw);
  record.tick.proxy_wa = pose_in(state.felt_p_m, state.felt_q_xyzw);
  return record;
}

}  // namespace haptic::sim
