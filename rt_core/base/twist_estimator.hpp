// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Velocity of the device from stamped poses, over a window that adapts: the longest one in which a
/// straight line from the newest sample to the oldest explains every sample between them within the
/// encoder step (first-order adaptive windowing; Janabi-Sharifi, Hayward and Chen, IEEE Trans.
/// Control Systems Technology 8(6), 2000). Slow motion gets a long window and little noise, a
/// reversal a short one and little delay. Time is taken from the stamps alone, so late and
/// irregular ticks cost nothing; the nominal period appears nowhere.

#include <array>
#include <cstdint>

#include "rt_core/base/pose.hpp"

namespace haptic {

/// Samples kept: the window has one interval fewer at most.
inline constexpr std::uint32_t kTwistSamples = 32;
/// A window ends before the device has turned this far: rotation vectors stay far from pi.
inline constexpr Real kMaxWindowTurn_rad = 1.0_r;
/// Samples in a row whose stamp is not newer that are answered with the last twist; the next one
/// starts a new history, so that a clock set back or a device that repeats itself for ever does not
/// leave a velocity standing.
inline constexpr std::uint32_t kMaxKeptTwists = 32;

/// What the estimator must know of the device. A value that is not finite or negative counts as 0.
struct TwistWindow {
  Real step_m = 0;    ///< rounding of the grip point along each W axis; 0: shortest window always
  Real step_rad = 0;  ///< rounding of the rotation about each W axis; 0: shortest window always
  /// Shortest span; no twist is given before the history spans it (or fills the ring).
  Real min_window_s = 1.0e-3_r;
  Real max_window_s = 20.0e-3_r;  ///< longest span, unless a single interval is longer
};

/// One report of the device.
struct TwistSample {
  std::int64_t stamp_ns = 0;     ///< any origin; increasing
  Vec3 grip_w = Vec3::Zero();    ///< grip point in W [m]
  Quat q_wa = Quat::Identity();  ///< orientation; its length does not matter
  Twist sensed_w;                ///< the device's own twist, used where `sensed` is true
  bool sensed = false;
};

/// Velocity and what it is worth. Noise: largest error per W axis that rounding to the encoder step
/// leaves in the twist of a motion at constant velocity (for turns within 5 %); the gain is 1 /
/// window [1/s]. Delay: age of the motion that the twist shows, half the window. A sensed twist has
/// neither: both are 0.
struct TwistEstimate {
  Twist twist_w;  ///< of the grip point, W axes; zero until `valid`
  Real linear_window_s = 0, angular_window_s = 0;
  Real linear_noise_m_per_s = 0, angular_noise_rad_per_s = 0;
  Real linear_delay_s = 0, angular_delay_s = 0;
  bool valid = false;   ///< two samples or more, spanning the shortest window; or sensed
  bool sensed = false;  ///< the device's own twist
  bool kept = false;    ///< sample refused (stamp not newer, pose not finite): the twist before it
};

/// Owner: the servo thread. Memory: sizeof(TwistEstimator), 2.2 kB in double; no heap.
class TwistEstimator {
 public:
  TwistEstimator() noexcept = default;
  explicit TwistEstimator(const TwistWindow& window) noexcept;

  /// Takes one report and returns the velocity at it. Sensed twists that are not finite are not
  /// used. A report that is refused changes nothing but the count of refusals.
  /// Cost: at most kTwistSamples - 1 rotation logarithms and as many tests of six intervals.
  TwistEstimate update(const TwistSample& sample) noexcept;
  /// The same of a device that only translates: its angular velocity is zero.
  /// Cost: no logarithms, half of the tests.
  TwistEstimate update_place(const TwistSample& sample) noexcept;

  /// Forgets every sample; the next twist comes with the second sample after it.
  void reset() noexcept;

 private:
  struct Kept {
    std::int64_t stamp_ns = 0;
    Vec3 grip_w = Vec3::Zero();
    Quat q_wa = Quat::Identity();
  };
  /// A velocity and the span it was taken over; span 0: none.
  struct Slope {
    Vec3 per_s = Vec3::Zero();
    Real span_s = 0;
  };

  void push(const TwistSample& sample) noexcept;
  [[nodiscard]] const Kept& sample_before(std::uint32_t intervals) const noexcept;
  template <bool kAngular>
  [[nodiscard]] Slope slope(Real step) const noexcept;
  template <bool kTurns>
  [[nodiscard]] TwistEstimate estimate() const noexcept;
  template <bool kTurns>
  TwistEstimate take(const TwistSample& sample) noexcept;

  TwistWindow window_;
  std::array<Kept, kTwistSamples> ring_;
  std::uint32_t newest_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t refusals_ = 0;  ///< in a row
  TwistEstimate last_;
};

}  // namespace haptic
