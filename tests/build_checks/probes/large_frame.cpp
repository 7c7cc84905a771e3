// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: a frame of at most 4096 bytes.
void fill(int* first);

int large_frame() {
  int room[2000];
  fill(room);
  return room[0];
}
