// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counts the allocations of the program, of its libraries too, by standing in front of malloc.

#include <cstdint>

namespace haptic::sim {

/// Allocations (malloc, calloc, realloc and the aligned forms) of this thread since its start.
[[nodiscard]] std::uint64_t heap_calls_of_this_thread();

/// False under a sanitizer, which interposes the heap itself: nothing is counted.
[[nodiscard]] bool heap_calls_are_counted();

}  // namespace haptic::sim
