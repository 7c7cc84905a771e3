// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Results of the pruning of a scene: the figures of METHOD section 11, for a report.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/graph_compiler/pruning/node_marks.hpp"

namespace haptic::tools {

/// How many of a scene's features the other pieces of their body hide.
struct HiddenCount {
  std::size_t hidden = 0, all = 0;
  bool operator==(const HiddenCount&) const = default;
};

struct PruningAccount {
  bool pruned = true;  ///< false: everything was kept, as asked
  std::size_t moving_pieces = 0, static_pieces = 0;
  PairCounts counts;                                            ///< of all pairs
  std::size_t largest_pair_before = 0, largest_pair_after = 0;  ///< nodes; live nodes
  std::size_t pairs = 0, pairs_out_of_reach = 0;
  HiddenCount faces, edges, vertices;
  std::size_t partly_covered_faces = 0;
  double exposure_ms = 0.0;  ///< spent on the seams of the bodies; filled by who found them
  double marks_ms = 0.0;     ///< spent on the pairs
  /// Share of the nodes that are live.
  [[nodiscard]] double live_percent() const;
};

/// Everything but the times, so that equal scenes give equal text.
nlohmann::ordered_json account_as_json(const PruningAccount& account);
/// A few lines of the same, with the times.
std::string account_as_text(const PruningAccount& account);

}  // namespace haptic::tools
