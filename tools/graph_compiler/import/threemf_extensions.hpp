// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Extensions that a 3MF model cannot do without.

#include <string>

#include "tools/graph_compiler/import/xml_file.hpp"

namespace haptic::tools {

/// Those of materials, of production (parts in further models) and of triangle sets change no
/// geometry, or are read.
/// @throws InputError "file:line: defect; fix": another one is required.
void check_extensions(const tinyxml2::XMLElement& model, const std::string& file);

}  // namespace haptic::tools
