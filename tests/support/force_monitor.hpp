// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Judges what is sent to a device, command by command, from the outside: it knows the device's own
/// limits and when output must not grow, and nothing of how the output came about.

#include <cstdint>
#include <string>

#include "hal/device.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/safety/safety_limits.hpp"

namespace haptic::test {

/// What no command may leave. A limit per axis of 0: that axis has none.
struct ForceBlock {
  Real max_force_n = 0, max_torque_nm = 0;
  Vec3 max_axis_force_n = Vec3::Zero(), max_axis_torque_nm = Vec3::Zero();
  Real slew_n_per_s = 0, slew_nm_per_s = 0;
  std::int64_t longest_step_ns = 0;           ///< however late a command is, only this long counts
  Real force_unit_n = 0, torque_unit_nm = 0;  ///< to which the device's commands are rounded

  /// Of a device by its own block, with a loop of `limits`. The rate of force is the device's where
  /// it states one. Two periods of reports count at most.
  [[nodiscard]] static ForceBlock of(const hal::DeviceCapabilities& capabilities,
                                     const SafetyLimits& limits);
};

/// One command as the device gets it.
struct SentCommand {
  std::int64_t stamp_ns = 0;
  Wrench wrench_d;
  Real rounding_n = 0;     ///< of force in this command, beyond force_unit_n
  bool drives_on = false;  ///< it asks for the drives, or lets a motor act
  bool ready = false;      ///< the device says that it may be driven
  bool blocked = false;    ///< a cause to let go has been there since it was last armed
  bool fading = false;     ///< the servo's command is late or is none
  bool cut = false;        ///< device or driver has let go: a fall at once is right
};

/// Owner: one thread.
class ForceMonitor {
 public:
  explicit ForceMonitor(const ForceBlock& block) : block_(block) {}

  /// The rule that this command breaks; empty: none.
  [[nodiscard]] std::string on_send(const SentCommand& sent);
  /// The last command did not reach the device.
  void not_delivered() { last_ = before_; }

 private:
  struct Command {
    Wrench wrench_d;
    std::int64_t stamp_ns = 0;
    bool stamped = false;
    Real blocked_s = 0;  ///< time that counted since it was blocked
  };
  [[nodiscard]] std::string change(const SentCommand& sent, Real counted_s) const;
  [[nodiscard]] std::string release(const SentCommand& sent, Real blocked_s) const;

  ForceBlock block_;
  Command last_, before_;
};

}  // namespace haptic::test
