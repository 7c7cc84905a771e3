// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded motions of the device for the campaigns against the proxy, tick by tick; they know
/// nothing of the obstacles and go right through them.

#include <cstdint>

#include "host_sim/lab/proxy_fuzz/fuzz_scene.hpp"

namespace haptic::sim {

enum class FuzzMotionKind : std::uint8_t {
  kSlow,      ///< 0.1 m/s and up to 1 rad/s, with rests
  kFast,      ///< 1 m/s and up to 10 rad/s, with rests
  kJitter,    ///< slow, and +-1 mm, +-50 mrad of noise in every tick
  kTeleport,  ///< slow, and +-20 mm, +-1.5 rad of noise in every tick
  kMixed      ///< another of these every 20 to 200 ticks
};
inline constexpr FuzzMotionKind kFuzzMotions[] = {
    FuzzMotionKind::kSlow, FuzzMotionKind::kFast, FuzzMotionKind::kJitter,
    FuzzMotionKind::kTeleport, FuzzMotionKind::kMixed};
[[nodiscard]] const char* to_text(FuzzMotionKind kind);

class FuzzMotion {
 public:
  /// Begins at `p`, `q`.
  FuzzMotion(const FuzzScene& scene, FuzzMotionKind kind, const Vector& p, const Rotation& q,
             std::uint64_t seed);

  /// Pose of the next tick of 1 ms.
  [[nodiscard]] Pose next();

 private:
  void advance(double linear_m, double angular_rad);
  void draw_goal();

  const FuzzScene& scene_;
  FuzzMotionKind kind_, now_;
  Seeded random_;
  Vector p_, goal_p_;
  Rotation q_, goal_q_;
  double turn_share_ = 1;        ///< of the largest angular speed, of this way
  std::uint32_t rest_ = 0;       ///< ticks still to rest
  std::uint32_t change_in_ = 0;  ///< kMixed: ticks to the next kind
};

}  // namespace haptic::sim
