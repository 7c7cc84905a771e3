// SPDX-License-Identifier: Apache-2.0
// The drive of linker/image_run.hpp in an ordinary program whose core is placed by
// linker/rt_sections.ld. Prints the same first line as the freestanding image.

#include <cinttypes>
#include <cstddef>
#include <cstdio>
#include <span>

#include "linker/image_run.hpp"

extern "C" {
extern const std::byte rt_scene_blob[];
extern const std::byte rt_scene_blob_end[];
extern std::byte rt_state[];
extern std::byte rt_state_end[];
[[gnu::weak]] extern const haptic::Real rt_motion[];
[[gnu::weak]] extern const haptic::Real rt_motion_end[];
}

int main() {
  const std::span<const std::byte> blob(
      rt_scene_blob, static_cast<std::size_t>(rt_scene_blob_end - rt_scene_blob));
  const std::span<std::byte> state(rt_state, static_cast<std::size_t>(rt_state_end - rt_state));
  const std::span<const haptic::Real> motion(rt_motion,
                                             static_cast<std::size_t>(rt_motion_end - rt_motion));
  const haptic::ImageReport report = haptic::run_image(blob, state, motion);
  std::printf("verdict %u ticks %" PRIu32 " contact %" PRIu32 " hash %016" PRIx64 "\n",
              static_cast<unsigned>(report.verdict), report.ticks, report.contact_ticks,
              report.hash);
  return static_cast<int>(report.verdict);
}
