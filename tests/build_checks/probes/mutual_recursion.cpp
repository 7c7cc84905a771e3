// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no recursion, through other functions either.
int use(int value);
int first(int depth);

[[gnu::noinline]] int second(int depth) { return use(first(depth - 1)) + 1; }
[[gnu::noinline]] int first(int depth) { return depth == 0 ? 0 : use(second(depth - 1)) + 2; }
