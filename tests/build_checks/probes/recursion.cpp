// SPDX-License-Identifier: Apache-2.0
// Violates the core's rule: no recursion.
int use(int value);

int recursion(int depth) {
  return depth == 0 ? 0 : use(recursion(depth - 1)) + recursion(depth / 2);
}
