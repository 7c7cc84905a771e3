// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: a local static with a constructor takes a lock at first use.
int initial_value();

int value() {
  static const int kept = initial_value();
  return kept;
}
