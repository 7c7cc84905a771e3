// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/planning/insertion_hand.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/common/split_mix.hpp"

namespace haptic::sim {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
/// The approach ends this far over the hole.
constexpr double kOver_m = 0.006, kApproach_s = 1.2;
constexpr double kDown_m_per_s = 0.015, kPress_n = 1;
/// The aim comes to where the handle is led within about this time.
constexpr double kGivesWay_s = 0.5;
/// No deeper by this within this time: the hand searches.
constexpr double kDeeper_m = 3e-4, kPatience_s = 0.4;
/// The spiral: turns in a second, growth in a turn, and where it begins again.
constexpr double kTurns_per_s = 1.5, kPitch_m = 4e-4, kWidest_m = 3e-3;

std::vector<MotionSample> tremor_of(const InsertionTask& task, std::uint64_t seed,
                                    double period_s) {
  MotionScript script;
  script.rate_hz = 1 / period_s;
  script.seed = seed;
  script.tremor.position_m = task.tremor_m;
  script.tremor.angle_rad = task.tremor_rad;
  script.waypoints.resize(2);
  script.waypoints[1].t_s = task.limit_s + 2 * period_s;
  return make_motion(script);
}

}  // namespace

InsertionHand::InsertionHand(const InsertionTask& task, const HandModel& hand, std::uint64_t seed,
                             double period_s)
    : task_(task),
      stiffness_n_per_m_(hand.stiffness_n_per_m),
      period_s_(period_s),
      wish_(task.start),
      tremor_(tremor_of(task, seed, period_s)),
      lowest_m_(task.start.x0_w.z()),
      since_s_(kApproach_s) {
  tools::SplitMix64 words(tools::hashed(seed));
  const double aside_m = task.aside_m * words.uniform(), towards = kTwoPi * words.uniform();
  aim_ = task.goal.x0_w + aside_m * Vector(std::cos(towards), std::sin(towards), 0);
  const double tilt = task.askew_rad * words.uniform(), about = kTwoPi * words.uniform();
  const double twist = task.askew_rad * (2 * words.uniform() - 1);
  above_.q_wa =
      rotation_of(Vector(tilt * std::cos(about), tilt * std::sin(about), twist)) * task.goal.q_wa;
  above_.x0_w = aim_ + Vector(0, 0, task.depth_m + kOver_m);
}

HandTarget InsertionHand::first() const { return trembling(task_.start); }

HandTarget InsertionHand::next(const DeviceState& handle) {
  ++tick_;
  const double t_s = static_cast<double>(tick_) * period_s_;
  if (t_s <= kApproach_s) {
    approach(t_s);
  } else {
    go_down(handle, t_s);
  }
  return trembling(wish_);
}

void InsertionHand::approach(double t_s) {
  const double u = t_s / kApproach_s;
  const double way = u * u * u * (10 + u * (6 * u - 15));  // minimum jerk
  wish_.x0_w = task_.start.x0_w + way * (above_.x0_w - task_.start.x0_w);
  wish_.q_wa = task_.start.q_wa.slerp(way, above_.q_wa);
}

void InsertionHand::go_down(const DeviceState& handle, double t_s) {
  const double gives = period_s_ / kGivesWay_s;
  aim_ += gives * (handle.x0_w - aim_);
  wish_.q_wa = wish_.q_wa.slerp(gives, handle.q_wa).normalized();
  if (handle.x0_w.z() < lowest_m_ - kDeeper_m) {
    lowest_m_ = handle.x0_w.z();
    since_s_ = t_s;
    // What it has found is where it goes on.
    if (searches_) aim_ = handle.x0_w;
    searches_ = false;
  } else if (!searches_ && t_s - since_s_ > kPatience_s) {
    searches_ = true;
    searched_turns_ = 0;
  }
  Vector around = Vector::Zero();
  if (searches_) {
    searched_turns_ += kTurns_per_s * period_s_;
    if (kPitch_m * searched_turns_ > kWidest_m) searched_turns_ = 0;
    const double angle = kTwoPi * searched_turns_;
    around = kPitch_m * searched_turns_ * Vector(std::cos(angle), std::sin(angle), 0);
  }
  const double height_m = std::max(wish_.x0_w.z() - kDown_m_per_s * period_s_,
                                   handle.x0_w.z() - kPress_n / stiffness_n_per_m_);
  wish_.x0_w = aim_ + around;
  wish_.x0_w.z() = height_m;
}

HandTarget InsertionHand::trembling(const HandTarget& wish) const {
  const MotionSample& shake = tremor_[std::min(tick_, tremor_.size() - 1)];
  const double* const q = shake.q_wxyz;
  return {wish.x0_w + Vector(shake.p[0], shake.p[1], shake.p[2]),
          (Rotation(q[0], q[1], q[2], q[3]) * wish.q_wa).normalized()};
}

}  // namespace haptic::sim
