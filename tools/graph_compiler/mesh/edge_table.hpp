// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The half-edges of a mesh sorted by edge: which faces meet where.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/work_mesh.hpp"

namespace haptic::tools {

struct HalfEdge {
  std::uint32_t low = 0;   ///< smaller point index
  std::uint32_t high = 0;  ///< larger point index
  std::uint32_t face = 0;
  std::uint32_t corner = 0;  ///< position in the loop of the corner where it starts
  bool forward = false;      ///< runs from low to high in the loop of its face
};

/// Half-edges of one edge: [begin, end) of EdgeTable::half_edges.
struct EdgeRange {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t size() const { return end - begin; }
};

/// Sorted by (low, high, face, corner). Cost: O(n log n).
struct EdgeTable {
  explicit EdgeTable(const std::vector<WorkFace>& faces);
  std::vector<HalfEdge> half_edges;
  std::vector<EdgeRange> edges;
};

/// Disjoint sets with a parity against the root: `parity_of(a) ^ parity_of(b)` says whether two
/// members of a set are oriented against each other.
class ParitySets {
 public:
  explicit ParitySets(std::size_t size);
  std::uint32_t root_of(std::uint32_t element);
  /// Parity of an element against its root.
  bool parity_of(std::uint32_t element);
  /// Unites the sets such that a and b differ by `opposite`. False if they are united already and
  /// contradict it.
  bool unite(std::uint32_t a, std::uint32_t b, bool opposite);

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> parity_;  ///< against the parent
};

}  // namespace haptic::tools
