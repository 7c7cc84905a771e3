// SPDX-License-Identifier: Apache-2.0
#include "rt_core/base/status.hpp"

namespace haptic {

const char* to_text(RtStatus status) noexcept {
  static constexpr const char* kTexts[] = {
      "ok",
      "pose is not finite",
      "pose quaternion is not of unit length",
      "scene blob is too small or truncated",
      "scene blob is not aligned to 64 bytes",
      "not a compiled scene (wrong magic)",
      "scene was compiled for another format version; compile it again",
      "scene was compiled for the other scalar (double or float); compile it again",
      "scene content does not match its hash; the file is damaged",
      "scene table of sections is damaged",
      "scene lacks a required table",
      "scene holds a count that is out of range or does not fit another",
      "scene holds an index that points outside its table",
      "scene holds a number that is not finite or out of its range",
      "scene piece has vertices, edges and faces that do not fit together",
      "scene graph is not that of its two pieces",
      "scene capacities differ from what its tables need",
      "memory for the core is too small",
      "memory for the core is not aligned to 64 bytes",
      "scene is not the one that this image was compiled for",
      "the part may not be held, or the hand holds one still",
  };
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) == static_cast<std::size_t>(RtStatus::kCount));
  return status < RtStatus::kCount ? kTexts[static_cast<std::size_t>(status)] : "invalid status";
}

}  // namespace haptic
