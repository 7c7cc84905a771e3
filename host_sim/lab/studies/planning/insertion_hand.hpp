// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A hand that puts a part into its hole, as far as it knows where the hole is: it aims beside it,
/// trembles, presses down with so much force and no more, gives way to what it feels, and searches
/// in a spiral where it gets no deeper. One will for all guides: what leads it is felt, not told.

#include <cstdint>
#include <vector>

#include "host_sim/device/simulated_device.hpp"
#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

/// Where the grip point begins, and where it is when the part is in; the hole opens along +z.
struct InsertionTask {
  HandTarget start, goal;
  double depth_m = 0;     ///< of the goal below where the part enters
  double arrived_m = 0;   ///< the part is in when it is no higher above the goal
  double limit_s = 12;    ///< for a run
  double aside_m = 1e-3;  ///< the hand's aim is off by at most this, across the hole
  double askew_rad = 0.01;
  double tremor_m = 2e-4, tremor_rad = 4e-3;  ///< of each axis at most, 8 to 12 Hz
};

/// Owner: one thread. Equal seeds: equal wishes over equal motions of the handle.
class InsertionHand {
 public:
  InsertionHand(const InsertionTask& task, const HandModel& hand, std::uint64_t seed,
                double period_s);

  /// Where the hand wants the grip at the end of the period that begins now.
  [[nodiscard]] HandTarget next(const DeviceState& handle);

  /// Where it wants it at the begin.
  [[nodiscard]] HandTarget first() const;

 private:
  void approach(double t_s);
  void go_down(const DeviceState& handle, double t_s);
  [[nodiscard]] HandTarget trembling(const HandTarget& wish) const;

  const InsertionTask& task_;
  double stiffness_n_per_m_, period_s_;
  HandTarget above_;  ///< end of the approach: over the hole, as the hand believes
  HandTarget wish_;
  Vector aim_;  ///< where it goes down; z is not used
  std::vector<MotionSample> tremor_;
  std::size_t tick_ = 0;
  double lowest_m_, since_s_;  ///< the deepest that the handle was, and since when
  double searched_turns_ = 0;  ///< of the spiral
  bool searches_ = false;
};

}  // namespace haptic::sim
