// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A block on a plate, each whole or cut into pieces with its seams hidden, led over the middle of
/// the plate: what the cut bodies feel, next to the uncut ones.

#include <array>
#include <string>
#include <vector>

#include "tests/support/shapes.hpp"

namespace haptic::test {

tools::Body block();
tools::Body plate();

struct Division {
  std::string name;
  tools::Body body;
};
/// The plate cut in two, in four, and in a T.
std::vector<Division> plate_divisions();
/// The same of the block, near its middle.
std::vector<Division> block_divisions();

/// The block over the plate under one law, the seams of either hidden; null: uncut.
tools::SceneDescription cut_scene(const tools::Body* cut_block, const tools::Body* cut_plate,
                                  LawId law);

/// Quaternion (w, x, y, z) of a yaw after a tilt about x after one about y.
std::array<double, 4> turned(double tilt_x, double tilt_y, double yaw);

/// A slide of 3000 ticks over the middle of the plate: yaws, tilts, presses and lifts.
struct Slide {
  double largest_tilt_rad = 0;
  double deepest_m = 7e-4;  ///< of a block that is not tilted
  static constexpr int kTicks = 3000;
  [[nodiscard]] std::array<double, 4> rotation(int tick) const;
  [[nodiscard]] Point position(int tick) const;
};

struct SlideDifference {
  double force = 0, torque = 0;       ///< largest, over the force [1, m]
  double force_n = 0, torque_nm = 0;  ///< largest
  double largest_n = 0;
  int verdicts = 0, contacts = 0, ticks = 0;
};

/// Leads both scenes along one slide.
SlideDifference compare(LoadedScene& cut, LoadedScene& uncut, const Slide& slide);

}  // namespace haptic::test
