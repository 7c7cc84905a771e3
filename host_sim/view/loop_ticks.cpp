// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/loop_ticks.hpp"

namespace haptic::sim {

tools::RecordedTick recorded_tick(const LoopRecord& record, double rate_hz) {
  StepInput input;
  input.stamp_ns = loop_stamp_ns(record.tick.tick, rate_hz);
  input.pose_wa = record.tick.device_wa;
  input.accepted_wrench_w = record.accepted_w;
  input.accepted_valid = true;
  tools::RecordedTick recorded = tools::recorded_tick(input, record.tick.state_hash);
  if (record.tick.tick == 0) recorded.marks |= tools::kMarkReset;
  return recorded;
}

}  // namespace haptic::sim
