// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two parts of a scene that both move, as the law sees them: one moves, and the other stands at
/// its mesh frame.

#include <string>

#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::tools {

struct PartPair {
  std::string a, b;  ///< A moves
  SceneBytes bytes;
  SceneView view;
  Pose a_seen_from_b;  ///< mesh frames
};

/// @param names   "peg,socket", in either order.
/// @param pose_a  of the mesh frame of the first of them, as pose_from_text takes it; `pose_b` of
///                the second.
/// @throws UsageError  a scene of one moving part, no such part, two that have no scene of their
///                     own: what the option needs instead.
[[nodiscard]] PartPair part_pair_of(const SceneView& scene, const std::string& names,
                                    const std::string& pose_a, const std::string& pose_b);

}  // namespace haptic::tools
