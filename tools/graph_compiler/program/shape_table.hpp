// SPDX-License-Identifier: Apache-2.0
#pragma once
/// `shape = "..."` of a part in the scene file, and its dimensions.

#include <string_view>
#include <vector>

#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools {

/// Keys of all shapes, `shape` first.
const std::vector<std::string_view>& shape_keys();

/// Reads the shape of a table that has the key `shape`.
/// @throws InputError "file:line:column: defect; fix": an unknown word, a key of another shape, a
/// dimension that is missing or makes no solid.
Shape read_shape(const TomlTable& table);

}  // namespace haptic::tools
