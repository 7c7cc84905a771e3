// SPDX-License-Identifier: Apache-2.0
/// Stands in for the reader of STEP in a build without Open CASCADE.
#include "tools/graph_compiler/import/import_readers.hpp"

namespace haptic::tools {

bool can_import_step() { return false; }

ImportedMesh import_step(std::span<const char>, const std::string& file, const ImportOptions&) {
  refuse_unbuilt(file,
                 "install libocct-data-exchange-dev, configure and build again; or convert the "
                 "part to 3MF or STL");
}

}  // namespace haptic::tools
