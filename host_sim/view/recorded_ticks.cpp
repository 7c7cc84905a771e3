// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/recorded_ticks.hpp"

namespace haptic::sim {

tools::RecordedTick recorded_tick(const MotionSample& sample, std::uint64_t tick,
                                  std::uint64_t state_hash) {
  return tools::recorded_tick(input_of(sample, tick), state_hash);
}

std::vector<tools::RecordedTick> record_motion(CoreSession& session,
                                               std::span<const MotionSample> motion) {
  std::vector<tools::RecordedTick> ticks;
  ticks.reserve(motion.size());
  session.reset();
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const StepResult result = session.step(input_of(motion[k], k));
    ticks.push_back(recorded_tick(motion[k], k, result.state_hash));
  }
  return ticks;
}

}  // namespace haptic::sim
