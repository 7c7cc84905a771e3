// SPDX-License-Identifier: Apache-2.0
/// Any text as a robot description: the collision mesh of link "a" with finite corners and indices
/// in range, or refused with InputError. Meshes come from the fuzzers' own folder.
#include <cmath>
#include <string>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const haptic::tools::RawMesh mesh =
        haptic::tools::link_mesh_of(text, "fuzz", HAPTIC_FUZZ_MESH_DIR, "a");
    require(!mesh.faces.empty(), "an accepted link has a face");
    for (const haptic::tools::Point3& p : mesh.vertices) {
      require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
              "coordinates are finite");
    }
    for (const haptic::tools::RawFace& face : mesh.faces) {
      require(face.vertices.size() >= 3, "a face has three corners");
      for (const std::uint32_t v : face.vertices) {
        require(v < mesh.vertices.size(), "corners refer to vertices");
      }
    }
  } catch (const haptic::tools::InputError& error) {
    require(std::string(error.what()).find("; ") != std::string::npos, "a refusal names the fix");
  }
  return 0;
}
