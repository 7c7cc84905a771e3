// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/rest_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace haptic::sim {
namespace {

constexpr std::size_t kAxes = 6;  ///< force, then torque

double wrench_of(const LoopRecord& r, std::size_t axis) {
  return axis < 3 ? r.tick.force_n[axis] : r.tick.torque_nm[axis - 3];
}

/// Over a window of one axis.
struct Swing {
  double low = 0, high = 0;
  int turns = 0;
  [[nodiscard]] double peak_to_peak() const { return high - low; }
};

Swing swing_of(std::span<const LoopRecord> window, std::size_t axis) {
  Swing s;
  s.low = s.high = wrench_of(window.front(), axis);
  for (const LoopRecord& r : window) {
    s.low = std::min(s.low, wrench_of(r, axis));
    s.high = std::max(s.high, wrench_of(r, axis));
  }
  const double middle = 0.5 * (s.low + s.high), band = 0.25 * s.peak_to_peak();
  int side = 0;
  for (const LoopRecord& r : window) {
    const double off = wrench_of(r, axis) - middle;
    const int now = off > band ? 1 : off < -band ? -1 : side;
    if (side != 0 && now != side) ++s.turns;
    side = now;
  }
  return s;
}

bool same_target(const LoopRecord& a, const LoopRecord& b) {
  return a.target_m == b.target_m && a.target_wxyz == b.target_wxyz;
}

}  // namespace

RestAllowance rest_allowance(const SceneParameters& p, const DeviceModel& device) {
  const bool proxy = p.law == LawId::kProxy;
  const double stiffness = proxy ? p.coupling.k_t_n_per_m : p.k_f_n_per_m;
  const double length_m =
      proxy ? std::sqrt(p.coupling.k_r_nm_per_rad / p.coupling.k_t_n_per_m) : kGripRadius_m;
  const double off_m =
      std::sqrt(3.0) * std::hypot(device.encoder_step_m, length_m * device.encoder_step_rad);
  RestAllowance allowance;
  allowance.force_n = std::max(kStillForce_n, kRestCounts * stiffness * off_m);
  allowance.torque_nm = length_m * allowance.force_n;
  return allowance;
}

RestOscillation rest_oscillation(std::span<const LoopRecord> records,
                                 const RestAllowance& allowance) {
  RestOscillation worst;
  std::size_t still_from = 0, next_end = 0;
  for (std::size_t k = 1; k < records.size(); ++k) {
    if (!same_target(records[k], records[k - 1])) {
      still_from = k;
      continue;
    }
    const double now_s = records[k].tick.t_s;
    const double judged_s = std::max(records[still_from].tick.t_s + kSettle_s,
                                     next_end > still_from ? records[next_end].tick.t_s : 0.0);
    if (now_s < judged_s + kRestWindow_s) continue;
    std::size_t begin = k;
    while (begin > still_from && records[begin - 1].tick.t_s >= judged_s) --begin;
    next_end = k;
    worst.windows += 1;
    const std::span<const LoopRecord> window = records.subspan(begin, k + 1 - begin);
    const std::size_t half = window.size() / 2;
    for (std::size_t axis = 0; axis < kAxes; ++axis) {
      const Swing whole = swing_of(window, axis);
      const Swing first = swing_of(window.first(half), axis);
      const Swing second = swing_of(window.subspan(half), axis);
      const double allowed = axis < 3 ? allowance.force_n : allowance.torque_nm;
      const double ratio = second.peak_to_peak() / allowed;
      const bool goes_on =
          whole.turns >= kLeastTurns && second.peak_to_peak() >= kDiesOut * first.peak_to_peak();
      if (!(ratio > worst.ratio) || (ratio > 1 && !goes_on)) continue;
      worst.ratio = ratio;
      worst.frequency_hz = 0.5 * whole.turns / (now_s - window.front().tick.t_s);
      worst.at_s = now_s;
      worst.force_pp_n = worst.torque_pp_nm = 0;
      for (std::size_t other = 0; other < kAxes; ++other) {
        double& pp = other < 3 ? worst.force_pp_n : worst.torque_pp_nm;
        pp = std::max(pp, swing_of(window, other).peak_to_peak());
      }
    }
  }
  return worst;
}

}  // namespace haptic::sim
