// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no heap.
int* take(int value) { return new int(value); }
