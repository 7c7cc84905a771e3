// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: each frame is within its limit, the chain of them is not.
void fill(int* first);

template <int kDepth>
[[gnu::noinline]] int chain(int value) {
  int room[900];
  fill(room);
  return chain<kDepth - 1>(room[value]) + room[0];
}
template <>
[[gnu::noinline]] int chain<0>(int value) {
  return value;
}

int deep_chain(int value) { return chain<12>(value); }
