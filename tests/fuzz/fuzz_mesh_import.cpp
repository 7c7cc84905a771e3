// SPDX-License-Identifier: Apache-2.0
/// Any bytes as 3MF, glTF, GLB, COLLADA, AMF or STEP: a mesh with finite corners and indices in
/// range, or refused with InputError. The libraries run in a child, whose crash is a refusal; what
/// the child says is checked in this process.
#include <cmath>
#include <span>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  using haptic::tools::ImportFormat;
  if (size == 0) {
    return 0;
  }
  constexpr ImportFormat kFormats[] = {ImportFormat::k3mf, ImportFormat::kGltf,
                                       ImportFormat::kGlb, ImportFormat::kDae,
                                       ImportFormat::kAmf, ImportFormat::kStep};
  const std::span<const char> bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const haptic::tools::ImportedMesh imported =
        haptic::tools::import_bytes(bytes, kFormats[data[0] % 6], "fuzz", {});
    const haptic::tools::RawMesh& mesh = imported.mesh;
    require(std::isfinite(imported.unit_m) && imported.unit_m > 0.0, "the unit is a length");
    require(!mesh.faces.empty(), "an accepted mesh has a face");
    require(mesh.vertex_places.size() == mesh.vertices.size(), "each vertex has a place");
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
    const std::string_view text = error.what();
    require(text.starts_with("fuzz:"), "a refusal begins with the file");
    require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
  }
  return 0;
}
