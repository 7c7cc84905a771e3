// SPDX-License-Identifier: Apache-2.0
#include "tools/common/movers.hpp"

namespace haptic::tools {

std::uint32_t mover_count(const PartScenes& parts) noexcept {
  const std::uint32_t seconds = parts.hands() > 1 ? 1 : 0;
  return static_cast<std::uint32_t>(parts.driven().size()) + seconds;
}

bool is_held_by_second(const PartScenes& parts, std::uint32_t mover) noexcept {
  return mover == parts.driven().size() && parts.hands() > 1;
}

std::uint32_t part_of_mover(const PartScenes& parts, std::uint32_t mover) noexcept {
  return is_held_by_second(parts, mover) ? 1 : parts.driven()[mover].part;
}

bool open_mover_shape(const PartScenes& parts, std::uint32_t mover, SceneView& scene,
                      std::uint32_t& body) noexcept {
  if (is_held_by_second(parts, mover)) {
    body = 0;
    return SceneView::open(parts.scene_of(1), scene) == RtStatus::kOk;
  }
  const std::uint32_t own = parts.driven()[mover].part;
  if (parts[own].role == PartRole::kLoose) {
    body = 0;
    return SceneView::open(parts.scene_of(own), scene) == RtStatus::kOk;
  }
  body = 1;
  for (std::uint32_t part = 0; part < parts.count(); ++part) {
    const std::span<const std::byte> bytes = parts.pair_scene(part, parts.driven()[mover].part);
    if (!bytes.empty()) return SceneView::open(bytes, scene) == RtStatus::kOk;
  }
  return false;
}

}  // namespace haptic::tools
