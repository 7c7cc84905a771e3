// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Settings of the small leader arm, and the periods that a bridge gives its device.

#include <doctest/doctest.h>

#include <functional>

#include "hal/bridge/bridged_device.hpp"
#include "tests/bridges/arms/pty_bus.hpp"
#include "tests/bridges/arms/random_arm.hpp"
#include "tools/bridges/arm/arm_settings.hpp"

namespace haptic::test {

/// `servos`: with one more than the arm's six joints, that is the trigger, open at half a turn.
inline tools::ArmSettings leader_settings(const std::string& port, bool has_trigger = false) {
  tools::ArmSettings settings;
  settings.port = port;
  settings.arm = tools::arm_of(urdf_of(leader_chain()), "arm.urdf", "base", "tip");
  for (std::uint8_t id = 1; id <= 6; ++id) settings.ids.push_back(id);
  settings.offsets_rad.fill(tools::kTurn_rad / 2);
  settings.signs = {1, -1, 1, 1, -1, 1, 1, 1};
  if (has_trigger) settings.trigger = {true, 7, tools::kTurn_rad / 2, tools::kTurn_rad / 2 + 0.5};
  return settings;
}

/// Reads as a bridge does until `done`, with the newest sample, or for `limit_ms`. True: done.
inline bool read_until(hal::BridgedDevice& device, hal::BridgeSample& sample, hal::BridgeRead& last,
                       const std::function<bool()>& done, int limit_ms = 2000,
                       const Wrench* wrench = nullptr) {
  for (const std::int64_t end = steady_ns() + std::int64_t{limit_ms} * 1'000'000;
       steady_ns() < end;) {
    last = device.read(steady_ns(), sample);
    if (wrench != nullptr) static_cast<void>(device.write(steady_ns(), *wrench));
    if (done()) return true;
    if (last == hal::BridgeRead::kLost) return false;
    pollfd at = device.watched();
    ::poll(&at, 1, 1);
  }
  return false;
}

/// For `ms`, with a wrench or without.
inline hal::BridgeRead read_for(hal::BridgedDevice& device, hal::BridgeSample& sample, int ms,
                                const Wrench* wrench = nullptr) {
  hal::BridgeRead last = hal::BridgeRead::kSilent;
  static_cast<void>(read_until(
      device, sample, last, [] { return false; }, ms, wrench));
  return last;
}

}  // namespace haptic::test
