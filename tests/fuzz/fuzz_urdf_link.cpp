// SPDX-License-Identifier: Apache-2.0
/// Any text as a robot description: the collision mesh of link "a" with finite corners and indices
/// in range, or refused with InputError. Meshes come from the fuzzers' own folder.
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    haptic::fuzz::check_raw_mesh(
        haptic::tools::link_mesh_of(text, "fuzz", HAPTIC_FUZZ_MESH_DIR, "a"));
  } catch (const haptic::tools::InputError& error) {
    const std::string refusal = error.what();
    // A mesh of the link may be what is wrong.
    const bool is_of_mesh = refusal.starts_with(HAPTIC_FUZZ_MESH_DIR);
    haptic::fuzz::check_refusal(is_of_mesh ? "fuzz: " + refusal : refusal);
  }
  return 0;
}
