// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The C-obstacle of one pair at one orientation as planes and near nodes (rt_core/scene/
/// fixed_planes.hpp), and the turned vertices that go with it.

#include <array>
#include <cstdint>
#include <vector>

#include "rt_core/scene/fixed_planes.hpp"
#include "tools/graph_compiler/graph/edge_arcs.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/wide3.hpp"

namespace haptic::tools {

/// A turn by a quaternion x, y, z, w, of any length.
class WideTurn {
 public:
  explicit WideTurn(const std::array<double, 4>& q_xyzw);
  [[nodiscard]] Wide3 operator()(const Wide3& v) const;

 private:
  Wide3 row_[3];
};

/// A piece of the moving part with vertices, normals and edges turned.
[[nodiscard]] WidePiece turned(const WidePiece& piece, const WideTurn& turn);

/// Planes and nodes of one pair; FixedPlane::node_begin counts from the pair's first node.
struct FixedObstacle {
  std::vector<FixedPlane> planes;
  std::vector<FixedNode> nodes;
  std::uint32_t bounding_count = 0;
  bool hidden = false;  ///< some basic contact that applies or can be near only separates
};

/// Planes of all faces, of the edge pairs that apply at this orientation (ties within the tolerance
/// of the core's search included), and of those whose violation is below `epsilon_m`; nodes with a
/// violation below `epsilon_m`, a rise below kMaxRise epsilon, and of those that `marks` leave
/// exposed. `a` is turned. `marks`: of the pair, or null. Deterministic on every compiler. Cost:
/// O(E_A E_B), and O(V_A + V_B) for each plane.
[[nodiscard]] FixedObstacle fixed_obstacle(const WidePiece& a, const WidePiece& b, double epsilon_m,
                                           double size_m, const PairMarks* marks);

}  // namespace haptic::tools
