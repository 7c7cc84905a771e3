// SPDX-License-Identifier: Apache-2.0
// Violates the image's rule: nobody runs constructors before _start.
[[gnu::noinline]] static int initial_value() {
  volatile int value = 7;
  return value;
}

extern const int kStart;
const int kStart = initial_value();
