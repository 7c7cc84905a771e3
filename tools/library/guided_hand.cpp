// SPDX-License-Identifier: Apache-2.0
#include "tools/library/guided_hand.hpp"

#include <algorithm>

namespace haptic::tools {
namespace {

std::array<double, 4> between(const std::array<double, 4>& a, const std::array<double, 4>& b,
                              double share) {
  using Turn = Eigen::Quaternion<double, Eigen::DontAlign>;
  const Turn q = Turn(a[3], a[0], a[1], a[2]).slerp(share, Turn(b[3], b[0], b[1], b[2]));
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

// A fault is let go of for a moment before the next press, and a press is given one to take effect.
bool GuidedHand::presses(std::uint64_t hold, double t_s) noexcept {
  constexpr double kMoment_s = 0.05;
  if (hold == HAPTIC_RELEASE) return false;
  const bool stopped = stopped_.load(std::memory_order_relaxed);
  const bool again = hold == HAPTIC_HOLD_AGAIN && !stopped;
  if (!now_.deadman) {
    // Also a press that was ordered before the stop must not undo it.
    if (stopped || t_s < released_s_ + kMoment_s) return false;
    pressed_s_ = t_s;
    return true;
  }
  if (!again || !faulted_.load(std::memory_order_relaxed) || t_s < pressed_s_ + kMoment_s)
    return true;
  released_s_ = t_s;
  return false;
}

HandWish GuidedHand::wish(double t_s) noexcept {
  const HandOrder& order = reader_.newest();
  if (order.number != number_) {
    number_ = order.number;
    from_ = now_;
    from_s_ = t_s;
  }
  now_.deadman = presses(order.hold, t_s);
  holds_.store(now_.deadman, std::memory_order_relaxed);
  if (order.number == 0) return now_;
  const double x = std::clamp((t_s - from_s_) / order.seconds, 0.0, 1.0);
  const double share = x * x * x * (10 - 15 * x + 6 * x * x);  // smallest jerk
  for (std::size_t k = 0; k < 3; ++k) {
    now_.position_m[k] = from_.position_m[k] + share * (order.pose_dh[k] - from_.position_m[k]);
  }
  const double* q = order.pose_dh + 3;
  now_.q_xyzw = between(from_.q_xyzw, {q[0], q[1], q[2], q[3]}, share);
  // Release: who sees the number sees a wish that is there.
  if (x >= 1.0) reached_.store(order.number, std::memory_order_release);
  return now_;
}

}  // namespace haptic::tools
