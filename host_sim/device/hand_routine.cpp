// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/hand_routine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

HandTarget target_of(const WorkspaceMap& map, const MotionSample& sample) {
  const Pose handle = handle_pose(map, pose_of(sample));
  HandTarget target;
  target.x0_w = handle.p_wa.cast<double>();
  target.q_wa = handle.q_wa.cast<double>().normalized();
  return target;
}

bool same_place(const HandTarget& a, const HandTarget& b) {
  constexpr double kSame_m = 1.0e-6, kSame_rad = 1.0e-5;
  return (a.x0_w - b.x0_w).norm() < kSame_m && a.q_wa.angularDistance(b.q_wa) < kSame_rad;
}

}  // namespace

std::function<HandAction(double)> hand_routine(std::vector<MotionSample> motion, double rate_hz,
                                               const WorkspaceMap& map, double regrip_s) {
  const std::size_t count = motion.size();
  const bool closed =
      count > 1 && same_place(target_of(map, motion.front()), target_of(map, motion.back()));
  return [motion = std::move(motion), rate_hz, map, regrip_s, count, closed](double t_s) {
    const auto k = static_cast<std::size_t>(std::max<long>(std::lround(t_s * rate_hz), 0));
    HandAction action;
    action.target = target_of(map, motion[closed ? k % (count - 1) : std::min(k, count - 1)]);
    if (std::fmod(t_s, regrip_s) >= kLetGo_s) action.switches |= kDeadmanBit;
    return action;
  };
}

}  // namespace haptic::sim
