// SPDX-License-Identifier: Apache-2.0
#pragma once
/// 3MF in double precision, by a reader of our own: assimp 5.2 stops at a picture in the archive,
/// knows no further models in it, and takes supports and what is not to be printed for material.

#include <span>
#include <string>

#include "tools/graph_compiler/import/mesh_import.hpp"

namespace haptic::tools {

/// Reads the items of the build, each at its place, with their components, from all models of the
/// archive (production extension). Every mesh at every place is a group; mirrored ones are turned.
/// Objects of type "model" and "surface" are material; supports, "other", items that are not to be
/// printed, modifiers of slicers and objects that no item names are left out, and
/// `mesh.warnings` says so. Colours, materials, textures and pictures are skipped.
/// @throws InputError "file:line: defect; fix": damaged, encrypted, nothing is material, geometry
/// that is no mesh (beams, slices, fields), a volume that is to be cut out of another.
/// Cost: linear in the text and in the triangles of all places, which are limited.
ImportedMesh read_3mf(std::span<const char> bytes, const std::string& file);

}  // namespace haptic::tools
