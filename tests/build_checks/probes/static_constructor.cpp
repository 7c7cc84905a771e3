// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: nothing runs before main.
int initial_value();

extern const int kStart;
const int kStart = initial_value();
