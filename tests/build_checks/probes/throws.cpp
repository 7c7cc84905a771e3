// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no exceptions.
void check(int value) {
  if (value < 0) throw value;
}
