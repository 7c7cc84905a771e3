// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counts heap calls inside a scope: malloc, free and their kin are interposed in the test program,
/// and operator new calls malloc.

#include <cstdint>

namespace haptic::test {

/// While one is alive, heap calls of this thread are counted.
class RtGuard {
 public:
  RtGuard();
  ~RtGuard();
  RtGuard(const RtGuard&) = delete;
  RtGuard& operator=(const RtGuard&) = delete;
  [[nodiscard]] std::uint64_t heap_calls() const;
};

}  // namespace haptic::test
