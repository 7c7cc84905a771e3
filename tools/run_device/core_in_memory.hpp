// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene, the memory of a core, and the core over both; of a scene with two hands, its hands.

#include <cstddef>
#include <memory>
#include <span>

#include "rt_core/haptic_core.hpp"
#include "tools/common/held_parts.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

struct CoreInMemory {
  SceneBytes scene, state;
  SceneView view;
  HapticCore* core = nullptr;
  std::unique_ptr<HeldParts> parts;  ///< null: one hand, which holds its part all through

  [[nodiscard]] RtStatus open(std::span<const std::byte> bytes) {
    scene = SceneBytes(bytes);
    RtStatus opened = SceneView::open(scene.span(), view);
    if (opened != RtStatus::kOk) return opened;
    opened = HeldParts::open(view, parts);
    if (opened != RtStatus::kOk) return opened;
    if (parts != nullptr && parts->scenes.hands() > 1) return opened;
    parts.reset();
    state = SceneBytes(static_cast<std::size_t>(view.header().capacity.state_bytes));
    return HapticCore::create(state.span(), view, core);
  }
  /// The scene of a hand.
  [[nodiscard]] const SceneView& view_of(std::size_t hand) const {
    return parts != nullptr ? parts->hands.hand(static_cast<std::uint32_t>(hand)).scene() : view;
  }
};

}  // namespace haptic::tools
