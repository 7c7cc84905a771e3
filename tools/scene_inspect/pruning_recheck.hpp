// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pruning of a compiled scene, reported and repeated: which basic contacts each pair has,
/// which can occur, which can carry a force, and what leaving out the rest has saved. Counts come
/// from the marks of the scene; what hides a feature is found again from the geometry, and the
/// whole decision is made again to see that nothing is missing.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/pruning/node_marks.hpp"
#include "tools/graph_compiler/pruning/pruning_account.hpp"

namespace haptic::tools {

/// Basic contacts of one pair by type. `open`: neither feature is hidden, regardless of the
/// envelope.
struct PairPruning {
  std::uint32_t piece_a = 0, piece_b = 0;
  bool in_scene = true;  ///< false: the workspace never brings the two together
  bool marked = false;   ///< false: all nodes are kept
  PairCounts counts;
  std::uint64_t missing = 0;  ///< nodes that are needed and left out; 0 in a sound scene
};

/// Features of one piece that other pieces of its body hide.
struct PieceHidden {
  HiddenCount faces, edges, vertices;
  std::size_t partly_covered_faces = 0;
};

/// Memory and work of the same pieces with every basic contact kept.
struct UnprunedScene {
  std::uint64_t bytes = 0;  ///< of the blob; contact graphs stored as far as they fit into 8 MiB
  SceneCapacity capacity{};
};

struct PruningRecheck {
  std::vector<PieceHidden> pieces;      ///< by piece of the scene
  std::vector<PieceExposure> exposure;  ///< by piece; what the drawing shows
  /// Every pair of pieces, also those left out; none where the scene does not list them.
  std::vector<PairPruning> pairs;
  /// The scene has surfaces: which of their contacts carry a force is told in the tick, and nothing
  /// is counted here.
  bool has_facets = false;
  PairCounts counts;             ///< of all pairs
  std::uint64_t mark_bytes = 0;  ///< what the marks themselves take
  std::uint64_t needed = 0;      ///< live nodes by the repeated decision
  std::uint64_t missing = 0;     ///< of all pairs; features where none are listed
  /// Index into `pairs`, or of the piece where pairs are not listed; where missing > 0.
  std::size_t first_missing = 0;
  std::optional<UnprunedScene> unpruned;  ///< absent: nothing was left out, or not comparable
  std::string not_compared;               ///< why `unpruned` is absent though something was
  [[nodiscard]] bool holds() const { return missing == 0; }
  [[nodiscard]] bool left_something_out() const { return counts.live.all() < counts.nodes.all(); }
};

/// The description that a scene was written from, as far as its bytes tell: bodies, pose,
/// parameters, envelope and workspace, without marks and exposure. Geometry as the scene has it:
/// the moving body about its grip, a static body about its reference.
SceneDescription description_of(const SceneView& view);

/// Cost: that of the pruning, and of writing the scene once where something was left out.
PruningRecheck recheck_pruning(const SceneView& view);

}  // namespace haptic::tools
