// SPDX-License-Identifier: Apache-2.0
/// Any bytes as 3MF, glTF, GLB, COLLADA, AMF or STEP: a mesh with finite corners and indices in
/// range, or refused with InputError. The libraries run in a child, whose crash is a refusal; what
/// the child says is checked in this process.
#include <cmath>
#include <span>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
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
    haptic::fuzz::check_raw_mesh(imported.mesh);
    haptic::fuzz::check_parts(imported.mesh);
    haptic::fuzz::require(std::isfinite(imported.unit_m) && imported.unit_m > 0.0,
                          "the unit is a length");
  } catch (const haptic::tools::InputError& error) {
    haptic::fuzz::check_refusal(error.what());
  }
  return 0;
}
