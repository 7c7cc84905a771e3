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
}

namespace {
[[gnu::section(".bss.rt_state"), gnu::aligned(64)]] std::byte state[HAPTIC_IMAGE_STATE_BYTES];
}

int main() {
  const std::span<const std::byte> blob(
      rt_scene_blob, static_cast<std::size_t>(rt_scene_blob_end - rt_scene_blob));
  const haptic::ImageReport report = haptic::run_image(blob, state);
  std::printf("verdict %u ticks %" PRIu32 " contact %" PRIu32 " hash %016" PRIx64 "\n",
              static_cast<unsigned>(report.verdict), report.ticks, report.contact_ticks,
              report.hash);
  return static_cast<int>(report.verdict);
}
