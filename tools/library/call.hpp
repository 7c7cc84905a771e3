// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Begin and end of every function of the C interface: structures of a known size, numbers within
/// their range, exceptions turned into error numbers.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <new>

#include "rt_core/base/pose.hpp"
#include "tools/library/haptic.h"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// HAPTIC_OK, or why `given` is no structure of this interface. Version 0 knows one size of each;
/// a member that is added later makes another size, and the first one stays known.
template <class T>
[[nodiscard]] int check_structure(const T* given) noexcept {
  if (given == nullptr) return HAPTIC_ERROR_NULL;
  return given->struct_size == sizeof(T) ? HAPTIC_OK : HAPTIC_ERROR_VERSION;
}

/// HAPTIC_OK, or why there is no room for such a list; `*count` becomes 0.
template <class T>
[[nodiscard]] int check_list(const T* items, std::size_t capacity, std::size_t item_bytes,
                             std::size_t* count) noexcept {
  if (count == nullptr) return HAPTIC_ERROR_NULL;
  *count = 0;
  if (items == nullptr) return HAPTIC_ERROR_NULL;
  if (capacity == 0) return HAPTIC_ERROR_SIZE;
  return item_bytes == sizeof(T) ? HAPTIC_OK : HAPTIC_ERROR_VERSION;
}

/// Ranges of a haptic_frame.
inline constexpr double kMostFrame_m_per_s = 2, kMostFrame_rad_per_s = 20, kMostFrame_late_s = 0.5;

[[nodiscard]] inline bool is_within(double value, double low, double high) noexcept {
  return value >= low && value <= high;  // false for NaN
}

/// Pose of seven numbers x y z, x y z w.
[[nodiscard]] inline Pose pose_of_numbers(const double* p) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return {Vec3(real(p[0]), real(p[1]), real(p[2])),
          Quat(real(p[6]), real(p[3]), real(p[4]), real(p[5]))};
}
inline void write_numbers(const Pose& pose, double* p) noexcept {
  for (int k = 0; k < 3; ++k) p[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) p[3 + k] = static_cast<double>(pose.q_wa.coeffs()[k]);
}
/// Wrench of six numbers, force and torque.
[[nodiscard]] inline Wrench wrench_of_numbers(const double* w) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return {Vec3(real(w[0]), real(w[1]), real(w[2])), Vec3(real(w[3]), real(w[4]), real(w[5]))};
}
inline void write_numbers(const Wrench& wrench, double* p) noexcept {
  for (int k = 0; k < 3; ++k) {
    p[k] = static_cast<double>(wrench.force_w[k]);
    p[3 + k] = static_cast<double>(wrench.torque_w[k]);
  }
}

/// The judgement as the caller's structure, which is of a size that is known.
inline void write_verdict(const SessionVerdict& from, haptic_verdict& to) noexcept {
  static_assert(sizeof to.text == sizeof VerdictLine{}.text);
  static_assert(HAPTIC_VERDICT_COUNT == static_cast<int>(Outcome::kNothingTouched));
  to = HAPTIC_VERDICT_INIT;
  to.verdict = static_cast<uint32_t>(from.outcome);
  to.failures = from.failures;
  to.started_inside = from.started_inside ? 1 : 0;
  to.ticks = from.ticks;
  to.followed_ticks = from.followed_ticks;
  to.contact_ticks = from.contact_ticks;
  const auto ticks = [&from](WhyNot why) { return from.why_not[static_cast<std::size_t>(why)]; };
  to.refused_ticks = ticks(WhyNot::kRefused);
  to.inside_ticks = ticks(WhyNot::kInside);
  to.outside_ticks = ticks(WhyNot::kOutside);
  to.stuck_ticks = ticks(WhyNot::kStuck);
  to.list_full_ticks = ticks(WhyNot::kListFull);
  to.behind_ticks = ticks(WhyNot::kBehind);
  to.saturated_ticks = ticks(WhyNot::kSaturated);
  to.ramped_ticks = ticks(WhyNot::kRamped);
  to.longest_open_ticks = from.longest_open.ticks;
  to.longest_stuck_ticks = from.longest_stuck.ticks;
  to.open_force_n = from.open_force_n;
  to.given_out_j = from.given_out_j;
  const VerdictLine line = verdict_line(from);
  std::copy(line.text.begin(), line.text.end(), to.text);
}

/// A position within 100 km and a quaternion of unit length to 1e-3: what the core takes as one.
[[nodiscard]] inline bool is_pose(const double* p) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (!is_within(p[k], -1e5, 1e5)) return false;
  }
  const double length = std::sqrt(p[3] * p[3] + p[4] * p[4] + p[5] * p[5] + p[6] * p[6]);
  return is_within(length, 1 - 1e-3, 1 + 1e-3);
}

/// The error number that `body` returns, or that of what it throws.
template <class Body>
[[nodiscard]] int guarded(const Body& body) noexcept {
  try {
    return body();
  } catch (const std::bad_alloc&) {
    return HAPTIC_ERROR_MEMORY;
  } catch (...) {
    return HAPTIC_ERROR_INTERNAL;
  }
}

}  // namespace haptic::tools
