// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: the depth of a call through a pointer is unknown.
int call(int (*function)(int), int value) { return function(value) + 1; }
