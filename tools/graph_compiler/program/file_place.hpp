// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A place in the scene file, for messages about what stands there.

#include <cstdint>

namespace haptic::tools {

/// Where something stands in the scene file, both from 1.
struct FilePlace {
  std::uint32_t line = 0, column = 0;
};

}  // namespace haptic::tools
