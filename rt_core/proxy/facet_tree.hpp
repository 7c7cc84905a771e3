// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The facets of the obstacles in a tree of boxes with eight children, in single precision about
/// the middle of all: which of them are within a range of a triangle. Eight facets that are near
/// each other are one leaf, and are numbered one after the other.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/float_lanes.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic {

/// A facet of an obstacle, along the axes of W.
struct StaticFacet {
  Vec3 normal = Vec3::Zero();  ///< unit
  Real offset_m = 0;           ///< normal . corner
  std::uint32_t begin = 0;     ///< of its corners, in the order of its loop
  std::uint32_t count = 0;
};

/// Leaves of a tree over `facets` > 0, and nodes above them.
[[nodiscard]] constexpr std::uint64_t facet_tree_leaves(std::uint64_t facets) noexcept {
  return (facets + kFloatLanes - 1) / kFloatLanes;
}
[[nodiscard]] constexpr std::uint64_t facet_tree_nodes(std::uint64_t facets) noexcept {
  std::uint64_t nodes = 0;
  for (std::uint64_t level = facet_tree_leaves(facets); level > 1; level = (level + 7) / 8)
    nodes += (level + 7) / 8;
  return nodes > 0 ? nodes : 1;
}

/// A triangle at a pose, along the axes of W.
struct TriangleShape {
  Vec3 corner_w[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  Vec3 normal_w = Vec3::Zero();                                    ///< unit
  Vec3 outward_w[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< in its plane, off its edges
};

/// Eight boxes, from the middle of the tree.
struct alignas(32) TreeBoxes {
  float low[3][kFloatLanes], high[3][kFloatLanes];
};
struct TreeNode {
  TreeBoxes boxes;
  std::uint32_t child[kFloatLanes];  ///< node, or leaf and kTreeLeaf
};
inline constexpr std::uint32_t kTreeLeaf = 0x80000000u;
/// Corners of a facet in a leaf; one with more is judged by its box and its plane.
inline constexpr std::uint32_t kLeafCorners = 4;
struct TreeLeaf {
  TreeBoxes boxes;
  float normal[3][kFloatLanes], offset[kFloatLanes];
  float corner[kLeafCorners][3][kFloatLanes];
  float unknown[kFloatLanes];  ///< 0, or far below where not all corners are here
};
/// A triangle in the frame of the tree, all of it in single precision.
struct TreeQuery {
  float corner[3][3];       ///< corner, axis
  float low[3], high[3];    ///< its box
  float normal[3], offset;  ///< its plane
  float outward[3][3], side[3];
  float range_m;
};
struct TreeFound {
  std::uint32_t count = 0;              ///< facets within range
  std::uint32_t nodes = 0, leaves = 0;  ///< looked at
  float others_m = 0,
        others2_m2 = 0;  ///< no other one is nearer: by its planes; by its box, squared
};
/// Levels of a tree over 2^31 facets.
inline constexpr std::uint32_t kMostTreeLevels = 11;
inline constexpr std::uint32_t kMostTreeWaiting = 7 * kMostTreeLevels + 1;

struct FacetSet;

class FacetTree {
 public:
  /// Room for a tree over `facets` > 0.
  void place(Arena& arena, std::uint32_t facets) noexcept;
  /// Not for the servo loop. Cost: O(n log n).
  void build(std::span<const StaticFacet> facets, std::span<const Vec3> corners_w) noexcept;
  /// Queries take the loops for AVX2 or not; after build() they do where the processor has them.
  void set_wide(bool wide) noexcept { is_wide_ = wide; }
  /// The facet that was given to build(), by its number in the tree.
  [[nodiscard]] std::span<const std::uint32_t> order() const noexcept { return order_; }

  /// Facets that no plane of either, and no side of the triangle, has farther off than `range_m`.
  struct Found {
    std::uint32_t count = 0;
    std::uint32_t nodes = 0, leaves = 0;  ///< looked at
    Real others_m = 0;  ///< no other facet is nearer; a lower bound, and at least `range_m`
  };
  /// `found`: room for all facets, gets their numbers in the tree. Cost: the nodes and leaves of
  /// the tree within range, eight at a time.
  [[nodiscard]] Found find(const TriangleShape& triangle, Real range_m,
                           std::span<std::uint32_t> found) const noexcept;

 private:
  void fill_box(TreeBoxes& boxes, std::uint32_t k, std::span<const std::uint32_t> in,
                const FacetSet& set) const noexcept;
  void fill_leaf(TreeLeaf& leaf, std::span<const std::uint32_t> in,
                 const FacetSet& set) const noexcept;

  std::span<TreeNode> nodes_;
  std::span<TreeLeaf> leaves_;
  std::span<std::uint32_t> order_;
  std::span<std::uint32_t> begin_;  ///< of the facets of each node, in that order
  Vec3 middle_w_ = Vec3::Zero();
  Real rounding_m_ = 0;   ///< of a distance in it
  bool is_wide_ = false;  ///< the processor has eight lanes
};

}  // namespace haptic
