// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The basic contacts of one pair that can occur, and those that can carry a force: marks by node
/// number from the cones of the features.

#include <cstddef>
#include <optional>

#include "tools/graph_compiler/pruning/feature_cones.hpp"

namespace haptic::tools {

/// Numbers of nodes by type.
struct NodeCounts {
  std::size_t a = 0, b = 0, c = 0;
  [[nodiscard]] std::size_t all() const { return a + b + c; }
  NodeCounts& operator+=(const NodeCounts& other);
  bool operator==(const NodeCounts&) const = default;
};

/// The nodes of one pair that can apply, by envelope and exposure; node numbers as in PairRecord.
/// Exposed are nodes of which neither feature is hidden and whose open cones come together in the
/// envelope. Cost: an angle per node, more where cones are restricted.
PairMarks prune_pair(const PieceShape& a, const PieceShape& b,
                     const std::optional<OrientationEnvelope>& envelope);

/// Marks of one pair for the loop, which weighs contacts that are near too: reachable are also
/// nodes that some orientation of the envelope brings within epsilon of applicable. Exposed are
/// nodes of open features in any orientation, also those of a vertex where an open edge ends
/// in a corner: a scene with an envelope treats each of its nodes as the scene without does. Cost:
/// as prune_pair.
PairMarks near_marks(const PieceShape& a, const PieceShape& b, const NearCones& near_a,
                     const NearCones& near_b, const std::optional<OrientationEnvelope>& envelope);

/// Counts of one pair. `open`: nodes of which neither feature is hidden, regardless of the
/// envelope.
struct PairCounts {
  NodeCounts nodes, reachable, open, live;
};
PairCounts count_nodes(const PieceShape& a, const PieceShape& b, const PairMarks& marks);

}  // namespace haptic::tools
