// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/assembly_stages.hpp"

#include "tools/common/error.hpp"

namespace haptic::tools {

SceneBytes scene_with_places(const PartScenes& parts, std::uint32_t part,
                             const std::vector<PartPlace>& places) {
  SceneBytes memory(parts.most_bytes());
  SceneView view;
  const RtStatus status = parts.place(part, places, memory.span(), view);
  if (status != RtStatus::kOk) {
    throw InputError("the scene in which '" + std::string(parts.name(part)) +
                     "' is held is refused: " + to_text(status));
  }
  return SceneBytes{view.blob()};
}

AssemblyStages::AssemblyStages(const SceneView& scene, const std::string& file) {
  const RtStatus status = PartScenes::open(scene, parts_);
  if (status != RtStatus::kOk)
    throw InputError(file + ": the parts of the scene are refused: " + to_text(status));
  if (parts_.count() == 0)
    throw InputError(file +
                     ": has one moving part and no stages; compile a scene with [[part]] tables");
  stages_ = stages_of(scene);
}

std::string AssemblyStages::name(std::size_t stage) const {
  return std::string(parts_.name(stages_[stage].part));
}

std::vector<PartPlace> AssemblyStages::places_at(std::size_t stage) const {
  std::vector<PartPlace> places;
  for (std::uint32_t k = 0; k < parts_.count(); ++k) places.push_back(parts_.start_of(k));
  for (std::size_t k = 0; k < stage; ++k) places[stages_[k].part] = stages_[k].goal;
  return places;
}

SceneBytes AssemblyStages::scene_at(std::size_t stage) const {
  return scene_with_places(parts_, stages_[stage].part, places_at(stage));
}

}  // namespace haptic::tools
