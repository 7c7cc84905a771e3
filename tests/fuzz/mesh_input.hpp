// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inputs of the mesh targets: one byte for the format, then the bytes of the file.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "tools/graph_compiler/mesh/mesh_reader.hpp"

namespace haptic::fuzz {

/// Parses the input; empty if it is refused with InputError. Checks what surface.hpp promises about
/// a RawMesh.
std::optional<tools::RawMesh> parse_input(const std::uint8_t* data, std::size_t size);

}  // namespace haptic::fuzz
