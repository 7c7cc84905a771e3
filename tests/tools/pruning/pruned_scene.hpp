// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Scenes for tests of the pruning, from exact bodies or from the shared real parts.

#include <string>
#include <vector>

#include "tests/tools/polyhedron/solid_builder.hpp"
#include "tools/graph_compiler/pruning/scene_pruning.hpp"

namespace haptic::tools::test {

/// A body as the compiler would hand it on.
struct PreparedBody {
  PlacedBody placed;
  std::vector<PieceExposure> exposure;
};
/// Decomposes the body.
PreparedBody prepared(FlatBody& body, const std::string& name);
/// Takes the pieces as they are; `seen`: those that the exposure knows of (all when empty).
PreparedBody prepared_pieces(const FlatBody& body, const std::vector<Solid>& pieces,
                             const std::string& name, const std::vector<Solid>& seen = {});

/// Grip at the centre of volume.
SceneDescription scene_of(const PreparedBody& moving, const PreparedBody& fixed);

/// Shared parts that the compiler takes, empty where they are absent; the scene of one of them at
/// its assembled pose.
std::vector<std::string> shared_names();
SceneDescription shared_scene(const std::string& name);

/// A pruned scene with the shapes that the marks were made from.
struct PrunedScene {
  SceneDescription description;
  PruningAccount account;
  std::vector<PieceShape> moving, fixed;
  [[nodiscard]] const PairMarks& marks(std::size_t a, std::size_t b) const {
    return description.marks[a * fixed.size() + b];
  }
};
PrunedScene pruned(SceneDescription description);

/// Envelope of `max_angle_rad` about the start pose.
OrientationEnvelope about_start(const SceneDescription& description, double max_angle_rad);

}  // namespace haptic::tools::test
