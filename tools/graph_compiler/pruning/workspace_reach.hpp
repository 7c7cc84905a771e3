// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Contacts that a box around the grip point rules out. A pair of pieces: when it always stays
/// apart. A basic contact: when, at every place in the box and every orientation of the envelope,
/// its C-face has the grip behind it and lies below another C-face that could carry the force. It
/// is then never near, however deep the pieces overlap, and never a plane that separates them, so
/// neither the search nor the walk over separating planes ever stands on it. Every bound is
/// conservative: what is ruled out is proved, what is kept may still never occur.

#include <optional>

#include "tools/graph_compiler/pruning/node_marks.hpp"

namespace haptic::tools {

/// A motion to bound: grip point in the box, orientation in the envelope (absent: free).
struct MotionRange {
  WorkspaceBox box;
  std::optional<OrientationEnvelope> orientation;
};

/// Lengths [m] that the loop counts with.
struct ReachLimits {
  double clear_m = 0.0;    ///< pieces always farther apart need no search: exact band and motion
  double epsilon_m = 0.0;  ///< width of the near set
  double behind_m = 0.0;   ///< a plane with the grip this far behind it separates nothing
};

/// Clears `marks.near`, or the `reachable` of nodes, where the range rules them out. Cost: nodes
/// times faces of the pair times the eight corners of the box.
void mark_workspace_reach(const PieceShape& a, const PieceShape& b, const MotionRange& range,
                          const ReachLimits& limits, PairMarks& marks);

}  // namespace haptic::tools
