// SPDX-License-Identifier: Apache-2.0
// A frame with a buffer, and a call of the C library that writes as much into it as it is given.
#include <cstdio>
#include <cstring>

int main(int argc, char** argv) {
  char text[16];
  std::memcpy(text, argv[argc - 1], std::strlen(argv[argc - 1]) + 1);
  return std::puts(text) >= 0 ? 0 : 1;
}
