// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no stack of variable size.
void fill(void* first);

void dynamic_frame(unsigned bytes) { fill(__builtin_alloca(bytes)); }
