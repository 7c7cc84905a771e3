// SPDX-License-Identifier: Apache-2.0
/// Any bytes as what the child of an importer says: a mesh with finite corners and indices in
/// range, which says the same bytes again, or refused with InputError.
#include <cmath>
#include <string>

#include "tests/fuzz/mesh_judge.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const haptic::tools::ImportedMesh imported = haptic::tools::mesh_of_message(text, "fuzz");
    haptic::fuzz::check_raw_mesh(imported.mesh);
    require(std::isfinite(imported.unit_m) && imported.unit_m > 0.0, "the unit is a length");
    const std::string again = haptic::tools::message_of(imported);
    require(again.size() == text.size(), "a mesh says as much as was read");
    if (imported.deflection) require(again == text, "a mesh says what was read");
  } catch (const haptic::tools::InputError& error) {
    haptic::fuzz::check_refusal(error.what());
  }
  return 0;
}
