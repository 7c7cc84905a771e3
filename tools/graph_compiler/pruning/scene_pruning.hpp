// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pruning of a whole scene: envelope, exposure and workspace of every pair of pieces.

#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/pruning/pruning_account.hpp"

namespace haptic::tools {

/// Fills `description.marks` from its bodies, `exposure`, `orientation` and `workspace`, or
/// `description.open` where pairs are not listed; clears them and the exposure when `prune` is
/// false. Motion of one tick: from the speeds of its parameters, where given. The account counts
/// every node either way.
/// @throws InputError when a piece is not one closed polyhedron. Cost: see prune_pair.
PruningAccount prune_scene(SceneDescription& description);

}  // namespace haptic::tools
