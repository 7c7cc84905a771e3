// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/resampled.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace haptic::sim {
namespace {

// Rounding of the log's last time must not cost the last sample.
constexpr double kSamplesOfRounding = 1e-3;

Eigen::Vector3d place_in(const MotionSample& sample) {
  return {sample.p[0], sample.p[1], sample.p[2]};
}
Eigen::Quaterniond turn_in(const MotionSample& sample) {
  const double* q = sample.q_wxyz;
  return {q[0], q[1], q[2], q[3]};
}
void set_pose(MotionSample& sample, const Eigen::Vector3d& p, const Eigen::Quaterniond& q) {
  const Eigen::Quaterniond unit = q.normalized();
  for (int k = 0; k < 3; ++k) sample.p[k] = p[k];
  sample.q_wxyz[0] = unit.w();
  sample.q_wxyz[1] = unit.x();
  sample.q_wxyz[2] = unit.y();
  sample.q_wxyz[3] = unit.z();
}

}  // namespace

double resampled_count(std::span<const MotionSample> motion, double rate_hz) {
  return std::floor(motion.back().t_s * rate_hz + kSamplesOfRounding) + 1;
}

std::vector<MotionSample> resampled(std::span<const MotionSample> motion, double rate_hz) {
  const auto count = static_cast<std::size_t>(resampled_count(motion, rate_hz));
  std::vector<MotionSample> even(count);
  std::size_t before = 0;
  for (std::size_t k = 0; k < count; ++k) {
    MotionSample& sample = even[k];
    sample.t_s = static_cast<double>(k) / rate_hz;
    while (before + 2 < motion.size() && motion[before + 1].t_s <= sample.t_s) ++before;
    const MotionSample &a = motion[before], &b = motion[before + 1];
    const double share = std::clamp((sample.t_s - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0);
    set_pose(sample, (1 - share) * place_in(a) + share * place_in(b),
             turn_in(a).slerp(share, turn_in(b)));
  }
  return even;
}

void place(std::vector<MotionSample>& motion, const Placement& placement) {
  const auto& q = placement.q_wxyz;
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  const Eigen::Vector3d way(placement.p_m[0], placement.p_m[1], placement.p_m[2]);
  for (MotionSample& sample : motion)
    set_pose(sample, turn * place_in(sample) + way, turn * turn_in(sample));
}

Placement placement_between(const MotionSample& from, const MotionSample& to) {
  const Eigen::Quaterniond turn = (turn_in(to) * turn_in(from).conjugate()).normalized();
  const Eigen::Vector3d way = place_in(to) - turn * place_in(from);
  return {{turn.w(), turn.x(), turn.y(), turn.z()}, {way.x(), way.y(), way.z()}};
}

double turn_between(const MotionSample& a, const MotionSample& b) {
  return turn_in(a).angularDistance(turn_in(b));
}

}  // namespace haptic::sim
