// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The facets of the obstacles in a tree of boxes with eight children, in single precision about
/// the middle of all: which of them are within a range of a triangle.

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

/// Nodes of a tree over `facets` > 0.
[[nodiscard]] constexpr std::uint64_t facet_tree_nodes(std::uint64_t facets) noexcept {
  std::uint64_t nodes = 0;
  for (std::uint64_t level = facets; level > 1; level = (level + 7) / 8) nodes += (level + 7) / 8;
  return nodes > 0 ? nodes : 1;
}

struct FacetSet;

class FacetTree {
 public:
  /// Room for a tree over `facets` > 0.
  void place(Arena& arena, std::uint32_t facets) noexcept;
  /// Not for the servo loop. Cost: O(n log n).
  void build(std::span<const StaticFacet> facets, std::span<const Vec3> corners_w) noexcept;

  /// Facets whose boxes and planes are within `range_m` of the triangle.
  struct Found {
    std::uint32_t count = 0;
    std::uint32_t visits = 0;  ///< nodes looked at
    Real others_m = 0;         ///< no other facet is nearer; a lower bound, and at least `range_m`
  };
  /// `found`: room for all facets. Cost: the nodes of the tree within range, eight at a time.
  [[nodiscard]] Found find(const Vec3 (&corners_w)[3], Real range_m,
                           std::span<std::uint32_t> found) const noexcept;

 private:
  struct alignas(64) Node {
    float low[3][kFloatLanes], high[3][kFloatLanes];
    float normal[3][kFloatLanes], offset[kFloatLanes];  ///< of a facet; zero: a node
    std::uint32_t child[kFloatLanes];                   ///< node, or facet and kFacet
  };
  static constexpr std::uint32_t kFacet = 0x80000000u;
  /// Levels of a tree over 2^31 facets.
  static constexpr std::uint32_t kMostLevels = 11;
  static constexpr std::uint32_t kMostWaiting = 7 * kMostLevels + 1;

  void fill(Node& node, std::uint32_t k, std::span<const std::uint32_t> in,
            const FacetSet& set) const noexcept;

  std::span<Node> nodes_;
  std::span<std::uint32_t> order_;
  std::span<std::uint32_t> begin_;  ///< of the facets of each node, in that order
  Vec3 middle_w_ = Vec3::Zero();
  Real rounding_m_ = 0;  ///< of a distance between boxes
};

}  // namespace haptic
