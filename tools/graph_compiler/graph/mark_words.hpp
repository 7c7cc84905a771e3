// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks of a pair's basic contacts as the words that a scene stores
/// (rt_core/scene/node_marks.hpp).

#include <cstdint>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"

namespace haptic::tools {

/// The four sets of bits of a pair: nodes and features, reachable and live. Empty where every node
/// is live, and where none is reachable, which says that nothing is known.
/// @throws InputError when the marks are not one per node. Cost: nodes.
std::vector<std::uint64_t> mark_words(const PieceView& a, const PieceView& b,
                                      const PairMarks& marks);

}  // namespace haptic::tools
