// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene whose parts the hand holds one after another, with the memory that its hand needs.

#include <array>
#include <memory>

#include "rt_core/part_hand.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

/// Not movable: the hand points into it.
struct HeldParts {
  PartScenes scenes;
  std::array<SceneBytes, 2> scene, state, law;
  PartHand hand;

  /// With the part held that is held at first. `scene` must outlive `parts`.
  /// @return kOk, with null for a scene of one moving part; as PartScenes::open, PartHand::begin.
  [[nodiscard]] static RtStatus open(const SceneView& scene, std::unique_ptr<HeldParts>& parts);
  /// With each part where it starts, and the one held that is held at first; as PartHand::begin.
  [[nodiscard]] RtStatus begin() noexcept;
};

}  // namespace haptic::tools
