// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Settings of the small leader arm, and the periods that a bridge gives its device.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

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

/// Servo 1 goes on by 8 steps at each question, and some answers are late: samples whose pose is
/// not that of the question at their time. @return their count, and -1 where there were too few
/// samples.
template <typename Emulator>
int samples_of_other_questions(Emulator& bus, hal::BridgedDevice& device) {
  constexpr int kStep = 8, kATurn = 4096 / kStep;
  const auto yaw = [](const hal::BridgeSample& s) {
    return 2 * std::atan2(static_cast<double>(s.pose_dh.q_xyzw[2]),
                          static_cast<double>(s.pose_dh.q_xyzw[3]));
  };
  hal::BridgeSample sample;
  hal::BridgeRead last = hal::BridgeRead::kSilent;
  REQUIRE(read_until(device, sample, last, [&] { return last == hal::BridgeRead::kNew; }));
  const double begin = yaw(sample);
  bus.with([&](auto& b) {
    b.asked_ns.clear();
    b.counts_a_question = kStep;
  });
  std::vector<std::pair<std::int64_t, int>> seen;
  for (int k = 0; k < 6; ++k) {
    bus.with([](auto& b) { b.late_once_ms = 30; });
    static_cast<void>(read_until(
        device, sample, last,
        [&] {
          if (last == hal::BridgeRead::kNew)
            seen.emplace_back(sample.sampled_ns,
                              static_cast<int>(std::lround((yaw(sample) - begin) * 4096 /
                                                           (2 * 3.141592653589793 * kStep))));
          return false;
        },
        90));
  }
  const std::vector<std::int64_t> asked = bus.with([](auto& b) { return b.asked_ns; });
  int others = 0, judged = 0;
  for (const auto& [sampled_ns, steps] : seen) {
    const auto number = static_cast<std::size_t>((steps % kATurn + kATurn) % kATurn);
    if (number == 0 || number > asked.size()) continue;
    ++judged;
    // The servo heard the question of this pose before the one that the sample is of was asked.
    if (asked[number - 1] < sampled_ns) ++others;
  }
  return judged < 10 ? -1 : others;
}

}  // namespace haptic::test
