// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene whose parts are held, one after another by one hand or one by each of two, with the
/// memory that its hands need.

#include <array>
#include <memory>

#include "rt_core/hands.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

/// Not movable: the hands point into it.
struct HeldParts {
  PartScenes scenes;
  std::array<SceneBytes, 2> scene, state, law;
  Hands hands;

  /// The first one.
  [[nodiscard]] PartHand& hand() noexcept { return hands.hand(0); }
  [[nodiscard]] const PartHand& hand() const noexcept { return hands.hand(0); }

  /// With the parts held that are held at first. `scene` must outlive `parts`.
  /// @return kOk, with null for a scene of one moving part; as PartScenes::open, Hands::begin.
  [[nodiscard]] static RtStatus open(const SceneView& scene, std::unique_ptr<HeldParts>& parts);
  /// With each part where it starts, and those held that are held at first; as Hands::begin.
  [[nodiscard]] RtStatus begin() noexcept;
};

}  // namespace haptic::tools
