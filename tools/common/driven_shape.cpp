// SPDX-License-Identifier: Apache-2.0
#include "tools/common/driven_shape.hpp"

namespace haptic::tools {

bool open_driven_shape(const PartScenes& parts, std::uint32_t driven, SceneView& scene) noexcept {
  for (std::uint32_t part = 0; part < parts.count(); ++part) {
    const std::span<const std::byte> bytes = parts.pair_scene(part, parts.driven()[driven].part);
    if (!bytes.empty()) return SceneView::open(bytes, scene) == RtStatus::kOk;
  }
  return false;
}

}  // namespace haptic::tools
