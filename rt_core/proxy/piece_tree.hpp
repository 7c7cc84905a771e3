// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A binary tree of spheres over convex pieces, so that a group that is far away costs one
/// comparison.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Sphere round a piece or a group of them, in the axes of its tree's user.
struct PieceSphere {
  Vec3 centre = Vec3::Zero();
  Real radius_m = 0;
};

/// Box round a piece or a group of them, along the axes of its tree's user.
struct PieceBox {
  Vec3 middle = Vec3::Zero(), half = Vec3::Zero();
};

/// A leaf holds one piece; any other node two children, one behind the other.
struct PieceNode {
  PieceSphere sphere;       ///< round all pieces of the node
  std::uint32_t begin = 0;  ///< of its pieces in the tree's order
  std::uint32_t count = 0;  ///< of them; 1: a leaf
  std::uint32_t child = 0;  ///< the first of its two children; 0: none
};

/// Nodes on the way from the root of a tree over `pieces` to any of its leaves, at most.
[[nodiscard]] constexpr std::uint32_t tree_depth(std::uint32_t pieces) noexcept {
  std::uint32_t depth = 1;
  for (std::uint32_t part = pieces; part > 1; part = (part + 1) / 2) ++depth;
  return depth;
}

class PieceTree {
 public:
  /// Room for a tree over `pieces` > 0 pieces; `boxed`: with a box for each node.
  void place(Arena& arena, std::uint32_t pieces, bool boxed) noexcept {
    nodes_ = arena.take<PieceNode>(2 * std::size_t{pieces} - 1);
    if (boxed) boxes_ = arena.take<PieceBox>(2 * std::size_t{pieces} - 1);
    order_ = arena.take<std::uint32_t>(pieces);
  }
  /// Builds the tree over `spheres`, one by piece, and `boxes` where it has them: halves of equal
  /// number along the longest side, level by level. Not for the servo loop. Cost: O(n log n).
  void build(std::span<const PieceSphere> spheres, std::span<const PieceBox> boxes) noexcept;

  /// The root is node 0.
  [[nodiscard]] const PieceNode& node(std::uint32_t index) const noexcept { return nodes_[index]; }
  /// Of a tree that has boxes.
  [[nodiscard]] const PieceBox& box(std::uint32_t index) const noexcept { return boxes_[index]; }
  /// The piece of a leaf.
  [[nodiscard]] std::uint32_t piece(const PieceNode& leaf) const noexcept {
    return order_[leaf.begin];
  }

 private:
  std::span<PieceNode> nodes_;
  std::span<PieceBox> boxes_;       ///< by node, or none
  std::span<std::uint32_t> order_;  ///< pieces, those of each node together
};

}  // namespace haptic
