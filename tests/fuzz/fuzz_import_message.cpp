// SPDX-License-Identifier: Apache-2.0
/// Any bytes as what the child of an importer says: a mesh with finite corners and indices in
/// range, which says the same bytes again, or refused with InputError.
#include <cmath>
#include <string>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const haptic::tools::ImportedMesh imported = haptic::tools::mesh_of_message(text, "fuzz");
    const haptic::tools::RawMesh& mesh = imported.mesh;
    require(std::isfinite(imported.unit_m) && imported.unit_m > 0.0, "the unit is a length");
    require(!mesh.faces.empty(), "an accepted mesh has a face");
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
    const std::string again = haptic::tools::message_of(imported);
    require(again.size() == text.size(), "a mesh says as much as was read");
    if (imported.deflection) require(again == text, "a mesh says what was read");
  } catch (const haptic::tools::InputError& error) {
    const std::string refusal = error.what();
    require(refusal.starts_with("fuzz:"), "a refusal begins with the file");
    require(refusal.find("; ") != std::string::npos, "a refusal names the fix");
  }
  return 0;
}
