// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/drive_tape.hpp"

#include <algorithm>

namespace haptic::sim {

void DriveTape::give(const DrivenInput& input, const Pose* second) {
  newest_begin_ = given_.size();
  if (input.newest.empty() && second == nullptr) return;
  for (std::size_t k = 0; k < input.newest.size(); ++k) {
    if (input.newest[k].number == numbers_[k]) continue;
    numbers_[k] = input.newest[k].number;
    given_.push_back({clocks_.size(), k, input.newest[k]});
  }
  if (second != nullptr) {
    const std::size_t mover = input.newest.size();
    FrameRecord record;
    record.number = ++numbers_[mover];
    record.stamp_ns = input.now_ns;
    for (int k = 0; k < 3; ++k) record.p_m[k] = static_cast<double>(second->p_wa[k]);
    for (int k = 0; k < 4; ++k) record.q_xyzw[k] = static_cast<double>(second->q_wa.coeffs()[k]);
    given_.push_back({clocks_.size(), mover, record});
  }
  clocks_.push_back({input.now_ns, input.is_felt});
}

void DriveTape::take(const DrivenParts& parts, const StepResult* second) {
  if (!keeps_states_) states_.clear();
  now_begin_ = states_.size();
  for (const DrivenState& state : parts.states()) states_.push_back(tools::driven_tick(state));
  if (second != nullptr) states_.push_back(tools::driven_tick(*second));
}

std::span<const tools::GivenPose> DriveTape::newest() const {
  return std::span(given_).subspan(newest_begin_);
}

std::span<const tools::DrivenTick> DriveTape::now() const {
  return std::span(states_).subspan(now_begin_);
}

void DriveTape::mark(tools::RecordedTick& tick, std::size_t number) const {
  if (number >= clocks_.size()) return;
  tick.driven_ns = clocks_[number].now_ns;
  tick.marks |= tools::kMarkDriven;
  if (clocks_[number].is_felt) tick.marks |= tools::kMarkFelt;
}

std::vector<tools::GivenPose> DriveTape::given() const {
  std::vector<tools::GivenPose> all = given_;
  std::ranges::stable_sort(all, {}, &tools::GivenPose::driven);
  return all;
}

}  // namespace haptic::sim
