// SPDX-License-Identifier: Apache-2.0
#include "tools/common/held_parts.hpp"

#include <utility>

namespace haptic::tools {

RtStatus HeldParts::open(const SceneView& scene, std::unique_ptr<HeldParts>& parts) {
  parts.reset();
  auto opened = std::make_unique<HeldParts>();
  RtStatus status = PartScenes::open(scene, opened->scenes);
  if (status != RtStatus::kOk || opened->scenes.count() == 0) return status;
  for (std::size_t k = 0; k < opened->scene.size(); ++k) {
    opened->scene[k] = SceneBytes(opened->scenes.most_bytes());
    opened->state[k] = SceneBytes(opened->scenes.most_state_bytes());
  }
  status = opened->begin();
  if (status == RtStatus::kOk) parts = std::move(opened);
  return status;
}

RtStatus HeldParts::begin() noexcept {
  return hand.begin(scenes, {scene[0].span(), state[0].span()}, {scene[1].span(), state[1].span()});
}

}  // namespace haptic::tools
