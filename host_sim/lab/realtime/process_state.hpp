// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What this process holds of the machine: memory, heap, descriptors, threads.

#include <cstdint>

namespace haptic::sim {

struct ProcessState {
  std::uint64_t resident_bytes = 0;  ///< VmRSS, which the kernel counts in batches of pages
  std::uint64_t heap_bytes = 0;      ///< handed out by malloc and not yet freed; 0: not glibc's
  unsigned descriptors = 0;          ///< open
  unsigned threads = 0;
};

/// Of now. Takes some ten microseconds, and the locks of the heap for a part of them. @throws
/// std::runtime_error  there is no /proc.
[[nodiscard]] ProcessState process_state();

}  // namespace haptic::sim
