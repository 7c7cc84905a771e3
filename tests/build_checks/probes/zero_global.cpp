// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no writable globals, zero ones included.
unsigned tick_count;

unsigned next_tick() { return ++tick_count; }
