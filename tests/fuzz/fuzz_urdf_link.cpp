// SPDX-License-Identifier: Apache-2.0
/// Any text as a robot description: the collision mesh of link "a", and those of all links where
/// its joints have them, with finite corners and indices in range, or refused with InputError.
/// Meshes come from the fuzzers' own folder.
#include <functional>
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

namespace {

/// `size`: of the input, of which each byte may be shown by four in a name.
void check_reading(std::size_t size, const std::function<haptic::tools::RawMesh()>& read) {
  try {
    const haptic::tools::RawMesh mesh = read();
    haptic::fuzz::check_raw_mesh(mesh);
    haptic::fuzz::check_parts(mesh);
  } catch (const haptic::tools::InputError& error) {
    const std::string refusal = error.what();
    // A mesh of the link may be what is wrong.
    const bool is_of_mesh = refusal.starts_with(HAPTIC_FUZZ_MESH_DIR);
    haptic::fuzz::check_refusal(is_of_mesh ? "fuzz: " + refusal : refusal, 4 * size);
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace haptic::tools;
  const std::string text(reinterpret_cast<const char*>(data), size);
  check_reading(size, [&] {
    return link_mesh_of(text, "fuzz", HAPTIC_FUZZ_MESH_DIR, "a", LinkFrame::kLink);
  });
  check_reading(size, [&] {
    return link_mesh_of(text, "fuzz", HAPTIC_FUZZ_MESH_DIR, "a", LinkFrame::kRobot);
  });
  check_reading(size, [&] { return robot_mesh_of(text, "fuzz", HAPTIC_FUZZ_MESH_DIR); });
  return 0;
}
