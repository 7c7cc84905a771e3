// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A servo tick over a small scene with a device and a loop of one millisecond round it: everything
/// is as it should be until a test changes it.

#include <cstdint>

#include "rt_core/servo_tick.hpp"
#include "tests/support/proxy_bench.hpp"

namespace haptic::test {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::uint32_t kDeadman = 1, kClutch = 2, kStop = 4;  ///< switches of the bench

[[nodiscard]] inline Vec3 force_of(const ServoResult& r) {
  return wrench_of(r.command.wrench_d).force_w;
}
[[nodiscard]] inline Vec3 torque_of(const ServoResult& r) {
  return wrench_of(r.command.wrench_d).torque_w;
}

/// A cube of 20 mm over a floor of 50 mm thickness: it touches at z = 10 mm, 1 N per millimetre.
tools::SceneDescription cube_on_floor();

/// The default, with kStop as a stop switch.
ServoParameters bench_parameters();

/// The command of every tick is held against the promises of the output limiter; the device accepts
/// it as it is.
class ServoBench {
 public:
  explicit ServoBench(const tools::SceneDescription& description = cube_on_floor(),
                      const ServoParameters& parameters = bench_parameters());

  void place(double x, double y, double z);
  void press(bool held);

  /// A tick a millisecond later, at a new state or at the one before.
  ServoResult tick(bool is_new = true);
  /// A tick at what stands in `input`.
  ServoResult bare_tick();
  /// The last of `count` ticks.
  ServoResult ticks(int count, bool is_new = true);
  /// Lets go, presses and waits until the force is full.
  ServoResult arm();
  /// From 2 mm above the floor to 1 mm below its surface at 0.1 m/s.
  void descend();

  LoadedScene scene;
  SafetyLimits limits;
  ServoTick servo;
  ServoInput input;
  bool kept = true;  ///< finite, within the limits, no faster than the slew, in every tick so far

 private:
  bool has_ticked_ = false;
  std::int64_t last_now_ns_ = 0;
  Vec3 last_force_n_ = Vec3::Zero(), last_torque_nm_ = Vec3::Zero();
};

/// A bench that presses on the floor with 1 N, armed.
/// @throws std::runtime_error when it does not come to that.
struct PressingBench : ServoBench {
  explicit PressingBench(const ServoParameters& parameters = bench_parameters());
};

}  // namespace haptic::test
