/* SPDX-License-Identifier: Apache-2.0 */
/* A firmware that keeps its device on the heap. */
#include <stdlib.h>

void* device_of(unsigned long size);
void* device_of(unsigned long size) { return malloc(size); }
