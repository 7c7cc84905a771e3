// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scene and the motion that the tests of the worst-case report measure.

#include <cstddef>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "tests/host_sim/sample_scenes.hpp"

namespace haptic::sim::test {

/// A tetrahedron over a box, with a core of its own.
struct WcetScene {
  std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
  CoreSession session{bytes, "test"};
};

/// 60 ticks near the box.
[[nodiscard]] inline std::vector<MotionSample> short_motion() {
  PathShape shape;
  shape.centre_m[2] = 0.08;
  return smooth_path(3, 60, shape);
}

}  // namespace haptic::sim::test
