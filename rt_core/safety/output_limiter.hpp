// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The last stage of the servo thread before the device: for any command of the rendering, what
/// leaves is finite, within the limits and never a jump.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic {

/// What was done to the wrench of a tick, as bits.
enum LimiterFlag : std::uint32_t {
  kLimiterNotFinite = 1u << 0,  ///< replaced by the last finite one
  kLimiterClamped = 1u << 1,
  kLimiterDampingCut = 1u << 2,  ///< the spring part alone was not enough to cut
  kLimiterSlewed = 1u << 3,
  kLimiterSpeed = 1u << 4,     ///< scaled down because the handle is fast
  kLimiterDecaying = 1u << 5,  ///< the last wrench is held and fades
  kLimiterRamping = 1u << 6,   ///< ramp out, out, or ramp in
  kLimiterLate = 1u << 7       ///< late, but within the held periods: noted only
};

struct LimiterInput {
  std::int64_t stamp_ns = 0;   ///< when this output is made
  Wrench spring_d, damping_d;  ///< at the handle point; what is rendered is their sum
  Twist twist_d;               ///< of the handle; not finite counts as beyond every speed limit
  bool wants_force = false;    ///< Arming::wants_force
  /// Periods by which state or tick are late: 0 on time. Up to SafetyLimits::held_periods it is
  /// noted only; beyond, the last output is held and decays; beyond lost_periods the caller latches
  /// a fault.
  std::uint32_t late_periods = 0;
};

struct LimitedOutput {
  Wrench wrench_d;
  std::uint32_t flags = 0;  ///< LimiterFlag
  Real gain = 0;            ///< of the ramp in; 0 from the tick on that lets go
};

/// Owner: the servo thread. Starts out, at zero. Order: finite, driven degrees of freedom, speed,
/// clamp (the spring part is scaled before the damping part), ramp in, hold while late, slew.
///
/// Letting go is the slew alone, from wherever the output is: there is no second memory of it that
/// could bring a faded wrench back.
class OutputLimiter {
 public:
  OutputLimiter() noexcept : OutputLimiter(SafetyLimits{}) {}
  explicit OutputLimiter(const SafetyLimits& limits) noexcept;

  /// The output differs from the last one by at most slew times the time since, of which at most
  /// longest_step_s counts; its norms and components are within the limits. So it is for
  /// any input, numbers that are not finite and stamps that do not advance included (then the
  /// output stays). Cost: constant.
  [[nodiscard]] LimitedOutput update(const LimiterInput& input) noexcept;

  /// Out, at zero, without history.
  void reset() noexcept;

  /// Other limits from now on, and reset(): what the output was, was another device's.
  void limit(const SafetyLimits& limits) noexcept;

  /// What left last; exactly zero once it has been let go of.
  [[nodiscard]] const Wrench& last() const noexcept { return last_; }

 private:
  [[nodiscard]] Wrench clamped(const LimiterInput& input, std::uint32_t& flags) noexcept;

  SafetyLimits limits_;
  WrenchRamp ramp_;
  Wrench last_, last_finite_spring_, last_finite_damping_;
  bool stamped_ = false;
  std::int64_t stamp_ns_ = 0;
};

}  // namespace haptic
