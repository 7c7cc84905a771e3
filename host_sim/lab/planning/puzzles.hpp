// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes that are hard to plan in: tight, or such that the part must turn in contact. Where a part
/// must pass a place, walls leave it no way round.

#include <string>

namespace haptic::sim {

struct Puzzle {
  std::string name;
  std::string scene;        ///< a scene file; meshes count from host_sim/scenes
  std::string goal;         ///< pose of the moving part's file frame, as for --goal
  double clearance_mm = 0;  ///< on either side, at the place where least is left
  bool solvable = true;
};

/// How deep the peg of peg_puzzle is in its hole at the goal.
inline constexpr double kPegPuzzleDepth_m = 0.034;
/// A square peg and its hole, 20 mm wide, with a clearance on every side; from above, tilted.
[[nodiscard]] Puzzle peg_puzzle(double clearance_mm);
/// A bar between floor and lid round the corner of two closed corridors 30 mm wide, in which it
/// must slide and turn at once; the longest that passes has 68.85 mm.
[[nodiscard]] Puzzle corner_puzzle(double clearance_mm);
/// An L with arms 15 mm thick from one room into the next through a window that it does not pass
/// without a turn: one arm, a quarter of a turn about its elbow, the other arm.
[[nodiscard]] Puzzle window_puzzle(double clearance_mm);
/// A bar that enters a slot lengthwise and is turned by a quarter in the closed room behind it.
[[nodiscard]] Puzzle slot_puzzle(double clearance_mm);
/// A square ring on a bar with an elbow and plates at its ends, from one leg to the other: a
/// quarter of a turn while it slides over the elbow.
[[nodiscard]] Puzzle ring_puzzle(double clearance_mm);
/// A blade through five plates whose slots are turned by 15 degrees each against the one above: it
/// is as high as two plates are apart, and twists by 60 degrees as on a thread.
[[nodiscard]] Puzzle twist_puzzle(double clearance_mm);
/// A cube that never turns, in a chamber with a square hole in its lid and this clearance on every
/// side of it; the goal is outside. With less than nothing there is no way out.
[[nodiscard]] Puzzle chamber_puzzle(double clearance_mm);
/// A cube in a closed box; the goal is outside.
[[nodiscard]] Puzzle cage_puzzle();

}  // namespace haptic::sim
