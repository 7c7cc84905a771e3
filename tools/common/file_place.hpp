// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A place in a file, for messages about what stands there.

#include <cstdint>

namespace haptic::tools {

/// Where something stands in a file, both from 1.
struct FilePlace {
  std::uint32_t line = 0, column = 0;
};

}  // namespace haptic::tools
