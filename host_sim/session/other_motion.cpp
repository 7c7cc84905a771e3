// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/other_motion.hpp"

#include <algorithm>
#include <utility>

namespace haptic::sim {

OtherMotion::OtherMotion(CoreSession& session, std::vector<HoldCommand> holds,
                         const std::vector<std::string>& drives)
    : session_(session), holds_(session, std::move(holds)), drives_(session, read_drives(drives)) {}

void OtherMotion::before_tick(double t_s, const Pose* second) {
  holds_.before_tick(t_s);
  if (tape_) tape_->give(drives_.input(t_s), second);
  drives_.before_tick(t_s);
}

std::span<const FrameRecord> OtherMotion::poses_before_tick(double t_s) {
  holds_.before_tick(t_s);
  return drives_.at(t_s);
}

void OtherMotion::after_tick(const tools::TickRecord& tick, const StepResult* second) {
  holds_.after_tick(tick);
  drives_.after_tick(tick, second);
  if (tape_ && session_.hand() != nullptr) tape_->take(session_.hand()->driven(), second);
  given_j_.push_back(drives_.given_j());
}

tools::LiveState OtherMotion::shown(const tools::TickRecord& tick) const {
  tools::LiveState state;
  state.record = tick;
  if (!tape_) return state;
  const std::span<const tools::DrivenTick> now = tape_->now();
  state.driven_count = now.size();
  std::ranges::copy(now, state.driven.begin());
  return state;
}

std::span<const tools::DrivenTick> OtherMotion::driven() const {
  return tape_ ? tape_->states() : std::span<const tools::DrivenTick>();
}

std::string OtherMotion::failures() const {
  const std::string of_holds = holds_.failures(), of_drives = drives_.failures();
  return of_holds + (of_holds.empty() || of_drives.empty() ? "" : "; ") + of_drives;
}

}  // namespace haptic::sim
