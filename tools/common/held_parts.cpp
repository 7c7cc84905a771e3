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
    opened->law[k] = SceneBytes(opened->scenes.most_law_bytes());
  }
  status = opened->begin();
  if (status == RtStatus::kOk) parts = std::move(opened);
  return status;
}

RtStatus HeldParts::begin() noexcept {
  const auto room = [&](std::size_t k) {
    return PartHand::Room{scene[k].span(), state[k].span(), law[k].span()};
  };
  return hands.begin(scenes, {room(0), room(1)});
}

}  // namespace haptic::tools
