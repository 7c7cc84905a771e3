// SPDX-License-Identifier: Apache-2.0
#include "tools/common/changed_scene.hpp"

#include <cstring>
#include <string>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "rt_core/scene/capacity.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {

SceneBytes changed_scene(const SceneView& scene,
                         const std::function<void(SceneParameters&)>& change, std::uint32_t visits,
                         const std::function<void(BodyRecord&)>& change_body) {
  SceneBytes bytes(scene.blob());
  std::byte* const blob = bytes.span().data();
  const auto* parameters = reinterpret_cast<const std::byte*>(&scene.parameters());
  SceneParameters changed = scene.parameters();
  change(changed);
  std::memcpy(blob + (parameters - scene.blob().data()), &changed, sizeof changed);
  std::vector<BodyRecord> bodies(scene.bodies().begin(), scene.bodies().end());
  if (change_body) {
    for (BodyRecord& body : bodies) change_body(body);
    const auto* const first = reinterpret_cast<const std::byte*>(scene.bodies().data());
    std::memcpy(blob + (first - scene.blob().data()), bodies.data(),
                bodies.size() * sizeof(BodyRecord));
  }
  SceneHeader header = scene.header();
  header.capacity = scene_capacity(bodies, scene.pieces(), scene.listed_pairs(), scene.marks(),
                                   visits > 0 ? visits : header.capacity.max_pair_visits, changed);
  const auto seal = [&] {
    std::memcpy(blob, &header, sizeof header);
    header.content_hash = scene_content_hash(bytes.span());
    std::memcpy(blob, &header, sizeof header);
  };
  seal();
  SceneView opened;  // the size of the state depends on the opened scene
  const RtStatus status = SceneView::open(bytes.span(), opened);
  if (status != RtStatus::kOk) {
    throw InputError(std::string("the changed scene is refused: ") + to_text(status) +
                     "; give other values");
  }
  header.capacity.state_bytes = HapticCore::state_bytes(opened);
  seal();
  return bytes;
}

}  // namespace haptic::tools
