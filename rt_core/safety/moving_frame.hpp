// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The frame in which the fixed parts lie, where its owner moves it: a robot or a simulator that
/// gives poses 30 to 200 times a second. Between two of them the frame is interpolated, one
/// interval behind; each tick moves it no faster than its owner has stated. A pose that is not one,
/// too fast or too late makes the frame stay where it is, and is a cause to release the hand: the
/// frame goes to its newest pose once nobody feels it.

#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// One pose of the frame, as its owner gives it. Trivially copyable, no padding.
struct FrameRecord {
  std::uint64_t number = 0;   ///< counts them; 0: none was given yet, the frame is W
  std::int64_t stamp_ns = 0;  ///< host monotonic clock when it was given
  double p_m[3] = {0, 0, 0};  ///< of the frame in W
  double q_xyzw[4] = {0, 0, 0, 1};
  double fastest_m_per_s = 0, fastest_rad_per_s = 0;  ///< the owner moves it no faster
  std::int64_t late_ns = 0;  ///< without a newer one for longer: late; at most kLatestFrame_ns
  std::uint64_t stands = 0;  ///< not 0: the frame stays there, and no newer one is waited for
};

inline constexpr std::int64_t kLatestFrame_ns = 500'000'000;
/// Two poses may differ by this much after any time: their owner's clock jitters.
inline constexpr Real kFrameFloor_m = 5.0e-4_r, kFrameFloor_rad = 5.0e-3_r;

/// Owner: the servo thread. No heap. Same inputs, same bits; cost: constant. Rotations are bounded
/// polynomials (base/rotation.hpp).
class MovingFrame {
 public:
  /// Before the first record it is there, not at W's.
  void begin_at(const Pose& pose) noexcept { now_ = start_ = target_ = pose; }
  /// One tick. `felt`: the device exerts a force, or is about to. @return whether there is a cause
  /// to release the hand.
  bool follow(const FrameRecord& newest, std::int64_t now_ns, bool felt) noexcept;

  /// True if a pose was ever given; else the frame is W and the functions below need not be asked.
  [[nodiscard]] bool is_used() const noexcept { return number_ != 0; }
  /// Its owner is late, too fast, or has given what is no pose: it stays where it is.
  [[nodiscard]] bool is_lost() const noexcept { return lost_; }
  /// In the last tick the frame went to another place at once: history in it is void.
  [[nodiscard]] bool has_jumped() const noexcept { return jumped_; }
  [[nodiscard]] const Pose& pose() const noexcept { return now_; }  ///< of the frame in W

  /// A pose, a velocity at a point `at_w` and a wrench, from W to the frame; and a wrench back.
  [[nodiscard]] Pose inside(const Pose& pose_wa) const noexcept;
  [[nodiscard]] Twist inside(const Twist& twist_w, const Vec3& at_w) const noexcept;
  [[nodiscard]] Wrench inside(const Wrench& wrench_w) const noexcept;
  [[nodiscard]] Wrench outside(const Wrench& wrench_f) const noexcept;

 private:
  void take(const FrameRecord& record, std::int64_t now_ns, std::int64_t begin_ns) noexcept;
  void go_on(std::int64_t passed_ns, std::int64_t now_ns) noexcept;

  Pose now_, start_, target_;
  Twist twist_w_;  ///< of now_, at its origin
  Real fastest_m_per_s_ = 0, fastest_rad_per_s_ = 0;
  std::uint64_t number_ = 0;  ///< of the newest record
  std::int64_t stamp_ns_ = 0, late_ns_ = 0;
  std::int64_t begin_ns_ = 0, span_ns_ = 0;  ///< of the way from start_ to target_
  std::int64_t last_ns_ = 0;                 ///< of the last tick
  bool stands_ = false;
  bool refused_ = false;  ///< the newest record
  bool lost_ = false;     ///< now_ does not follow
  bool jumped_ = false;
};

}  // namespace haptic
