// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Finds what assimp overlooks in COLLADA, and makes the text that it reads instead.

#include <string>
#include <string_view>
#include <vector>

namespace haptic::tools {

struct ColladaText {
  double unit_m = 1.0;
  std::string changed;                ///< in place of the file; empty: it is read as it is
  std::vector<std::string> warnings;  ///< what is taken in another way than the file says
};

/// assimp knows no <convex_mesh>: one with faces becomes a <mesh>. One that is to be the convex
/// hull of another geometry is taken from there, with a warning, for no hull is made. Where no node
/// has a mesh the shapes of the rigid bodies become those of the nodes that they move, with a
/// warning. Pictures, effects and materials are left out: assimp refuses a mesh for them.
/// @throws InputError "file:line: defect; fix": no XML, a bad unit, a mesh that a controller bends;
/// a node with a geometry that is not there, is given by points alone, or is no mesh (brep).
/// Cost: linear in the text.
ColladaText collada_text(std::string_view text, const std::string& file);

}  // namespace haptic::tools
