// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Static tree of axis-aligned boxes: finds the boxes that meet a box, a line or a segment.

#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {

/// Built once by median splits along the longest side. Build O(n log n); a query visits O(log n +
/// hits) nodes for boxes that do not overlap much. Results are ascending, so that callers do not
/// depend on the tree's shape.
class BoxTree {
 public:
  explicit BoxTree(std::vector<vec::Box> boxes);
  /// Indices of the boxes that meet `query`, ascending.
  void find(const vec::Box& query, std::vector<std::uint32_t>& out) const;
  /// Indices of the boxes, grown by `margin`, that the line through `origin` along `direction` (no
  /// component zero) meets at a parameter >= -margin, ascending.
  void find_ray(const Point3& origin, const Point3& direction, double margin,
                std::vector<std::uint32_t>& out) const;
  /// Indices of the boxes, grown by `margin`, that the segment from a to b meets, ascending.
  void find_segment(const Point3& a, const Point3& b, double margin,
                    std::vector<std::uint32_t>& out) const;

 private:
  struct Node {
    vec::Box box;
    std::uint32_t begin = 0;  ///< leaf: first entry of order_
    std::uint32_t count = 0;  ///< leaf: entries; 0 for an inner node
    std::uint32_t right = 0;  ///< inner node: second child; the first one follows the node
  };
  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  template <class Meets>
  void visit(const Meets& meets, std::vector<std::uint32_t>& out) const;
  std::vector<vec::Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace haptic::tools
