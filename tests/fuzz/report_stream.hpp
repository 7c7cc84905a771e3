// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What fuzz targets of device drivers share: an input cut into reports and wrenches, and what
/// every driver promises about a state that it filled.

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "hal/drivers/driver.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {

/// Takes pieces off the front of an input; beyond its end there are zeros.
class ReportStream {
 public:
  explicit ReportStream(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }

  /// Up to `count` bytes, fewer at the end.
  std::span<const std::uint8_t> take(std::size_t count) {
    const auto taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::uint8_t byte() {
    const auto taken = take(1);
    return taken.empty() ? std::uint8_t{0} : taken.front();
  }
  /// A report of any length: one byte that says it, then the report.
  std::span<const std::uint8_t> report() { return take(byte()); }
  /// Exactly N bytes, zeros where the input has ended.
  template <std::size_t N>
  std::array<std::uint8_t, N> bytes() {
    std::array<std::uint8_t, N> all{};
    const auto taken = take(N);
    std::copy(taken.begin(), taken.end(), all.begin());
    return all;
  }
  /// Any bit pattern of a float: infinities and NaN are among them.
  Real number() {
    const auto b = bytes<4>();
    const std::uint32_t bits = std::uint32_t{b[0]} | std::uint32_t{b[1]} << 8 |
                               std::uint32_t{b[2]} << 16 | std::uint32_t{b[3]} << 24;
    return static_cast<Real>(std::bit_cast<float>(bits));
  }
  Wrench wrench() {
    Wrench w;
    for (int k = 0; k < 3; ++k) w.force_w[k] = number();
    for (int k = 0; k < 3; ++k) w.torque_w[k] = number();
    return w;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

/// Throws unless `state` is one that a servo loop can take.
inline void require_usable(const DeviceState& state) {
  const Pose pose = pose_of(state.pose_dh);
  require(is_finite(pose.p_wa), "position is finite");
  constexpr Real kUnitSlack = 1.0e-5_r;
  require(std::abs(pose.q_wa.squaredNorm() - 1) < kUnitSlack, "orientation is a unit quaternion");
  require(!state.twist_valid || is_finite(twist_of(state.twist_d)), "a valid twist is finite");
  require(state.link <= LinkState::kReady, "link state is one of three");
  require(state.faults >> 16 == 0, "a driver reports the device's own faults only");
}

/// Throws unless both are the same in all that a driver fills.
inline void require_same(const DeviceState& a, const DeviceState& b) {
  bool same = a.twist_valid == b.twist_valid && a.link == b.link && a.switches == b.switches &&
              a.faults == b.faults;
  const auto equal = [&](const auto& x, const auto& y) {
    same = same && std::equal(std::begin(x), std::end(x), std::begin(y));
  };
  equal(a.pose_dh.p_m, b.pose_dh.p_m);
  equal(a.pose_dh.q_xyzw, b.pose_dh.q_xyzw);
  equal(a.twist_d.linear_m_per_s, b.twist_d.linear_m_per_s);
  equal(a.twist_d.angular_rad_per_s, b.twist_d.angular_rad_per_s);
  require(same, "a refused report leaves the state as it was");
}

/// `read` on a state that is usable, with the two promises above checked.
inline hal::ReportVerdict checked_read(hal::Driver& driver, std::span<const std::uint8_t> report,
                                       std::int64_t stamp_ns, DeviceState& state) {
  const DeviceState before = state;
  const hal::ReportVerdict verdict = driver.read(report, stamp_ns, state);
  if (verdict == hal::ReportVerdict::kState) {
    require_usable(state);
  } else if (verdict != hal::ReportVerdict::kNothing) {
    require_same(before, state);
  }
  return verdict;
}

}  // namespace haptic::fuzz
