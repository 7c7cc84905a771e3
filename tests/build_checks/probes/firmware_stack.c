/* SPDX-License-Identifier: Apache-2.0 */
/* A firmware that keeps a kilobyte of reports on the stack. */
#include <stdint.h>

uint32_t sum_of(const volatile uint32_t* reports);
uint32_t sum_of(const volatile uint32_t* reports) {
  volatile uint32_t kept[256];
  uint32_t sum = 0;
  int k;
  for (k = 0; k < 256; ++k) kept[k] = reports[k];
  for (k = 0; k < 256; ++k) sum += kept[k];
  return sum;
}
