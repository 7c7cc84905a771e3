// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no writable globals.
double tick_gain = 1.5;

void set_gain(double gain) { tick_gain = gain; }
