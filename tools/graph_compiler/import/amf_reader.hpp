// SPDX-License-Identifier: Apache-2.0
#pragma once
/// AMF (ISO/ASTM 52915) in double precision, by a reader of our own: assimp 5.2 drops all volumes
/// of a mesh but one and takes turns of an instance for shifts.

#include <span>
#include <string>

#include "tools/graph_compiler/import/mesh_import.hpp"

namespace haptic::tools {

/// Reads AMF as text or as a ZIP archive of one. An object that no constellation names is taken as
/// it is; others at each place that constellations give them: turns about the fixed axes x, y, z,
/// then the shift; constellations may hold others. Every volume at every place is a group. Curved
/// triangles (normals, edges) are taken as flat; colours, materials and textures are skipped.
/// @throws InputError "file:line: defect; fix".
/// Cost: linear in the text and in the triangles of all places, which are limited.
ImportedMesh read_amf(std::span<const char> bytes, const std::string& file);

}  // namespace haptic::tools
