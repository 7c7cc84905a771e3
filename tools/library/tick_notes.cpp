// SPDX-License-Identifier: Apache-2.0
#include "tools/library/tick_notes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/library/call.hpp"
#include "tools/library/tick_history.hpp"

namespace haptic::tools {
namespace {

std::size_t recorded_ticks(const ServoParameters& parameters, double history_s) {
  return static_cast<std::size_t>(
      std::ceil(1e9 * history_s / static_cast<double>(parameters.limits.period_ns)));
}

}  // namespace

TickNotes::TickNotes(const SceneView& scene, const ServoParameters& parameters, double history_s)
    : parameters_(parameters),
      history_memory_(FlightRecorder::bytes_for(recorded_ticks(parameters, history_s))),
      recorder_(history_memory_.span()),
      judge_(scene),
      map_(parameters.map) {}

haptic_state& TickNotes::take(const ServoInput& input, const ServoResult& result,
                              const LoopCounts& counts, const HeldNow& held) noexcept {
  if (result.rendered_new) judge_.take(result.rendered);
  const Pose sensed_dh = pose_of(input.state.pose_dh);
  const Vec3 arm_d = handle_arm(map_, sensed_dh.q_wa);
  if (result.began) {
    map_ = begun_map(parameters_.map, parameters_.start, at_handle_point(sensed_dh, arm_d));
    taken_.began_tick = result.command.tick;
    taken_.map = record_of(map_);
  }
  taken_.verdict = judge_.verdict();
  taken_.held = held;
  haptic_state& s = taken_.state;
  const StepResult& rendered = result.rendered;
  s.link = static_cast<std::uint32_t>(input.state.link);
  s.tick = counts.ticks;
  s.time_s = 1e-9 * static_cast<double>(counts.since_opened_ns);
  write_numbers(mesh_pose(map_, at_handle_point(sensed_dh, arm_d)), s.hand_pose);
  const Pose& frame = result.frame_wf;
  const Pose& felt = rendered.proxy_pose_wa;
  write_numbers(Pose{frame.p_wa + frame.q_wa * felt.p_wa, frame.q_wa * felt.q_wa}, s.felt_pose);
  write_numbers(
      Wrench{frame.q_wa * rendered.wrench_w.force_w, frame.q_wa * rendered.wrench_w.torque_w},
      s.wrench);
  write_numbers(scene_wrench(map_, about_handle_point(wrench_of(result.command.wrench_d), arm_d)),
                s.sent_wrench);
  s.gap_m = static_cast<double>(rendered.proxy_gap_m);
  s.state_hash = rendered.state_hash;
  s.situation = static_cast<std::uint32_t>(rendered.situation);
  s.flags = rendered.flags;
  s.arming = static_cast<std::uint32_t>(result.arming);
  s.safety_faults = result.faults;
  s.device_faults = input.state.faults;
  s.late_ticks = counts.late;
  s.missed_periods = counts.missed_periods;
  s.longest_tick_s = 1e-9 * static_cast<double>(counts.largest_tick_ns);
  s.armings = result.command.arming;
  return s;
}

TickNotes::NewestTick TickNotes::newest() const noexcept {
  NewestReader<NewestTick> reader(record_);
  bool found = false;
  const NewestTick& record = reader.newest(&found);
  return found ? record : NewestTick{};
}

void TickNotes::state(haptic_state& state) const noexcept { state = newest().state; }

std::size_t TickNotes::history(std::span<haptic_tick> ticks, std::int64_t opened_ns) const {
  std::vector<StepTrace> records(std::min(ticks.size(), recorder_.capacity()));
  records.resize(FlightRecorder::copy_newest(history_memory_.span(), records));
  const NewestTick last = newest();
  HistoryPlace place{parameters_.map, parameters_.start, map_of(last.map), last.began_tick, 0,
                     opened_ns};
  std::vector<haptic_tick> all;
  append_ticks(records, place, all);
  std::copy(all.begin(), all.end(), ticks.begin());
  return all.size();
}

}  // namespace haptic::tools
