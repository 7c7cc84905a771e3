// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/core_tape.hpp"

namespace haptic::sim {

CoreTape::CoreTape(const SceneView& scene, const ServoParameters& parameters)
    : core_(scene.blob(), "the scene"), parameters_(parameters) {}

std::optional<tools::RecordedTick> CoreTape::take(const ServoInput& input,
                                                  const ServoResult& result) {
  if (result.command.tick == 1) sent_d_ = Wrench{};
  const Wrench before_d = sent_d_;
  sent_d_ = wrench_of(result.command.wrench_d);
  if (!result.rendered_new) return std::nullopt;
  const Vec3 arm_d = handle_arm(parameters_.map, pose_of(input.state.pose_dh).q_wa);
  StepInput in = core_input(input.state, parameters_, arm_d, before_d);
  in.report_goal_contact = input.report_goal_contact;
  const std::uint64_t hash = result.rendered.state_hash;
  tools::RecordedTick tick = tools::recorded_tick(in, hash);
  if (ticks_.empty()) tick.marks |= tools::kMarkReset;
  if (core_.core().step(in).state_hash != hash) {
    core_.core().reset();
    tick.marks |= tools::kMarkReset;
    if (core_.core().step(in).state_hash != hash) ++unmet_;
  }
  ticks_.push_back(tick);
  return tick;
}

}  // namespace haptic::sim
