// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The exploded view as a Wavefront OBJ with its MTL, for any viewer: one group per piece, in
/// metres, static bodies where they stand, the moving part above them.

#include <string>
#include <vector>

#include "tools/scene_inspect/exploded_view.hpp"

namespace haptic::tools {

/// A material of an MTL file.
std::string material_line(const std::string& name, const std::array<double, 3>& colour);
/// Colour of a piece, by its number within its body; components 0 to 1.
std::array<double, 3> piece_colour(std::uint32_t number);
/// Colour of faces that lie inside a part.
inline constexpr std::array<double, 3> kSeamColour{0.93, 0.42, 0.16};

/// `material_file` as the OBJ names it. Faces keep their polygons; seam faces have a material of
/// their own.
std::string exploded_obj(const std::vector<ExplodedBody>& bodies, const std::string& material_file);
std::string exploded_mtl(const std::vector<ExplodedBody>& bodies);

}  // namespace haptic::tools
