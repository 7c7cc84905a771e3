// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no heap.
#include <cstdlib>

void* take(std::size_t bytes) { return std::malloc(bytes); }
