// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The mesh and the numbers of a 3MF model, without their places.

#include <span>
#include <string>

#include "tools/graph_compiler/import/affine_map.hpp"
#include "tools/graph_compiler/import/left_out.hpp"
#include "tools/graph_compiler/import/slicer_marks.hpp"
#include "tools/graph_compiler/import/threemf_package.hpp"

namespace haptic::tools {

/// The map of an item or a component: its attribute "transform"; no move where it has none.
/// @throws InputError "file:line: ...": not twelve numbers, or a map that flattens.
AffineMap transform_of(const tinyxml2::XMLElement& element, const std::string& file);

/// The mesh of an object [units of the file]: only the corners that its triangles use, without the
/// triangles of `marked`, which `left_out` is told.
/// @throws InputError "file:line: ...": damaged, with beams, or with a volume that cuts others.
RawMesh mesh_of_3mf(const ThreemfModel& model, const tinyxml2::XMLElement& object,
                    std::span<const MarkedTriangles> marked, LeftOut& left_out);

/// "object '2' (line 4)", for messages.
std::string object_text(const ThreemfModel& model, const tinyxml2::XMLElement& object,
                        const std::string& file);

}  // namespace haptic::tools
