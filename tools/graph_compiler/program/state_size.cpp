// SPDX-License-Identifier: Apache-2.0
// Prints the bytes of state that the core it is linked with needs for the embedded scene: the size
// of an image's `rt_state`. Exit code 3 and the reason when the core refuses the scene.

#include <cstddef>
#include <cstdio>
#include <span>

#include "rt_core/haptic_core.hpp"

extern "C" {
extern const std::byte rt_scene_blob[];
extern const std::byte rt_scene_blob_end[];
}

int main() {
  const std::span<const std::byte> blob(
      rt_scene_blob, static_cast<std::size_t>(rt_scene_blob_end - rt_scene_blob));
  haptic::SceneView view;
  const haptic::RtStatus status = haptic::SceneView::open(blob, view);
  if (status != haptic::RtStatus::kOk) {
    std::fprintf(stderr, "state size: %s\n", haptic::to_text(status));
    return 3;
  }
  std::printf("%zu\n", haptic::HapticCore::state_bytes(view));
  return 0;
}
