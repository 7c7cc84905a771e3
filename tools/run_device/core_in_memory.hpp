// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene, the memory of a core, and the core over both.

#include <cstddef>
#include <span>

#include "rt_core/haptic_core.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

struct CoreInMemory {
  SceneBytes scene, state;
  SceneView view;
  HapticCore* core = nullptr;

  [[nodiscard]] RtStatus open(std::span<const std::byte> bytes) {
    scene = SceneBytes(bytes);
    const RtStatus opened = SceneView::open(scene.span(), view);
    if (opened != RtStatus::kOk) return opened;
    state = SceneBytes(static_cast<std::size_t>(view.header().capacity.state_bytes));
    return HapticCore::create(state.span(), view, core);
  }
};

}  // namespace haptic::tools
