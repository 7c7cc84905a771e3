// SPDX-License-Identifier: Apache-2.0
/// Any bytes as OBJ, STL, OFF or PLY: read, or refused with InputError; nothing else.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/mesh_input.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  haptic::fuzz::parse_input(data, size);
  return 0;
}
