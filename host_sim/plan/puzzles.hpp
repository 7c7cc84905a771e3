// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes that are hard to plan in: tight, or such that the part must turn in contact.

#include <string>

namespace haptic::sim {

struct Puzzle {
  std::string name;
  std::string scene;  ///< a scene file; meshes count from host_sim/scenes
  std::string goal;   ///< pose of the moving part's file frame, as for --goal
  bool solvable = true;
};

/// How deep the peg of peg_puzzle is in its hole at the goal.
inline constexpr double kPegPuzzleDepth_m = 0.034;
/// A square peg and its hole, 20 mm wide, with a clearance on every side; from above, tilted.
[[nodiscard]] Puzzle peg_puzzle(double clearance_mm);
/// A bar between floor and lid round the corner of two corridors 30 mm wide, which it must turn
/// in, in contact; the longest that passes has 68.8 mm.
[[nodiscard]] Puzzle corner_puzzle(double long_mm);
/// An L with arms 15 mm thick through a window: one arm, a quarter of a turn about its elbow in
/// contact, the other arm.
[[nodiscard]] Puzzle window_puzzle(double wide_mm);
/// A bar that enters a slot lengthwise and is turned by a quarter behind it.
[[nodiscard]] Puzzle slot_puzzle(double clearance_mm);
/// A cube that never turns, in a chamber with a square hole in its lid and this clearance on every
/// side of it; the goal is outside. With less than nothing there is no way out.
[[nodiscard]] Puzzle chamber_puzzle(double clearance_mm);
/// A cube in a closed box; the goal is outside.
[[nodiscard]] Puzzle cage_puzzle();

}  // namespace haptic::sim
