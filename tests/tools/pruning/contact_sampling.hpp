// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Basic contacts at sampled poses, by heights of vertices over planes alone (rt_core/METHOD.md
/// section 2): an oracle that knows nothing of cones, arcs or seams.

#include <string>
#include <vector>

#include "tests/tools/polyhedron/solid_builder.hpp"
#include "tools/graph_compiler/pruning/scene_pruning.hpp"

namespace haptic::tools::test {

// Scenes for tests of the pruning, from exact bodies or from the shared real parts.

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

Direction random_direction(TestRandom& random);
/// Angle to the middle of the envelope at most `angle_rad`, or exactly that on the rim.
Rotation random_rotation(const Rotation& middle, double angle_rad, bool on_rim, TestRandom& random);

/// C-face plane of an applicable node: the value at grip point x is n.x - offset.
struct ContactPlane {
  std::size_t node = 0;
  Direction n{};
  double offset_m = 0.0;
};
/// Every node of the pair that is applicable at orientation `r` (A's axes to W), heights up to
/// `tolerance_m` counting as none.
std::vector<ContactPlane> applicable_planes(const PieceShape& a, const PieceShape& b,
                                            const Rotation& r, double tolerance_m);

struct OccurrenceCount {
  std::size_t occurrences = 0;
  std::size_t lost = 0;     ///< of nodes that are not reachable by the marks
  double kept_share = 0.0;  ///< of the reachable nodes, those that occurred
};
/// Applicable nodes at random orientations of the envelope, a third of them on its rim.
OccurrenceCount count_occurrences(const PrunedScene& scene, const OrientationEnvelope& envelope,
                                  std::size_t orientations, std::uint64_t seed);

struct TouchCount {
  std::size_t touches = 0;
  std::size_t dropped = 0;  ///< first touches of which no node is live
};
/// First touches of translations along random rays, from outside and from where the part stands.
/// `hidden_piece`: a static piece that is left out, for probes; none when beyond the pieces.
TouchCount count_touches(const PrunedScene& scene, const OrientationEnvelope& envelope,
                         std::size_t orientations, std::size_t rays, std::uint64_t seed,
                         std::size_t hidden_piece = static_cast<std::size_t>(-1));

}  // namespace haptic::tools::test
