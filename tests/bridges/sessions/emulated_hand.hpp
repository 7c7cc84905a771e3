// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A hand on an emulated device, as a session needs it: the device is found by what
/// `run_device list` proposes, is moved, its switch is pressed, and its own wire says which force
/// it has.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/base/pose.hpp"

namespace haptic::test {

/// A force that the device has from now on, in D.
struct WireForce {
  std::int64_t at_ns = 0;  ///< CLOCK_MONOTONIC
  Vec3 force_d = Vec3::Zero();
};

/// Owner: the test's thread. Emulators have threads of their own.
class EmulatedHand {
 public:
  virtual ~EmulatedHand() = default;

  /// Empty: it is there; else why this machine cannot have it.
  [[nodiscard]] virtual std::string absence() const { return {}; }
  /// Variables for the programs that look for the device.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> environment() const {
    return {};
  }
  [[nodiscard]] virtual std::string list_arguments() const { return {}; }
  /// The proposed lines with what they say to fill in.
  [[nodiscard]] virtual std::string filled(std::string toml) const { return toml; }
  /// Time that it takes after arming until the wire has nothing but the force [s].
  [[nodiscard]] virtual double settling_s() const { return 0; }

  /// Stiffness of the scene that this device holds by its gate.
  [[nodiscard]] virtual double stiffness_n_per_m() const { return 200; }

  virtual void press(bool pressed) = 0;
  /// To `way_d` from where it was at the beginning, not turned [m]; about once a millisecond.
  virtual void move(const Vec3& way_d) = 0;
  /// Forces since the beginning, in order of time; none of a device without.
  [[nodiscard]] virtual std::vector<WireForce> wire() const { return {}; }
  /// The device has no force now, by its own word.
  [[nodiscard]] virtual bool is_limp() const { return true; }
};

[[nodiscard]] std::unique_ptr<EmulatedHand> make_spacenav_hand();
[[nodiscard]] std::unique_ptr<EmulatedHand> make_haply_hand(const std::string& version);
[[nodiscard]] std::unique_ptr<EmulatedHand> make_touch_hand();
[[nodiscard]] std::unique_ptr<EmulatedHand> make_force_dimension_hand();
[[nodiscard]] std::unique_ptr<EmulatedHand> make_dynamixel_hand();
[[nodiscard]] std::unique_ptr<EmulatedHand> make_feetech_hand();

}  // namespace haptic::test
