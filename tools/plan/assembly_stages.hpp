// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stages of an assembly as scenes of one moving part: that of a stage brings its part from
/// where it starts to its goal, while the parts of earlier stages stand at their goals and all
/// others where they start, as a hand that puts one part after the other in place meets them.

#include <cstddef>
#include <string>
#include <vector>

#include "rt_core/scene/part_scenes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"

namespace haptic::tools {

/// The ends of a stage's plan lie where its part starts and at its goal, but for this share of the
/// part's radius.
inline constexpr double kSamePlanEnd = 1.0e-4;

/// The scene in which `part` moves and the others stand at `places`, by part.
/// @throws InputError where the part may not be held, or a place is none.
[[nodiscard]] SceneBytes scene_with_places(const PartScenes& parts, std::uint32_t part,
                                           const std::vector<PartPlace>& places);

class AssemblyStages {
 public:
  /// `scene` must outlive it. @throws InputError where it has no parts, or its stages are refused;
  /// `file`: for the message.
  AssemblyStages(const SceneView& scene, const std::string& file);

  [[nodiscard]] const std::vector<Stage>& stages() const { return stages_; }
  [[nodiscard]] const PartScenes& parts() const { return parts_; }
  [[nodiscard]] std::string name(std::size_t stage) const;
  /// Where all parts are as a stage begins.
  [[nodiscard]] std::vector<PartPlace> places_at(std::size_t stage) const;
  /// The scene of a stage.
  [[nodiscard]] SceneBytes scene_at(std::size_t stage) const;

 private:
  PartScenes parts_;
  std::vector<Stage> stages_;
};

}  // namespace haptic::tools
