// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One file with several parts as a scene: which of its nodes is in the hand, and what stands
/// around it.

#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/program/draft_mesh.hpp"

namespace haptic::tools {

struct AssemblyRequest {
  std::filesystem::path given;       ///< as draft_source has it; with a node: that in the hand
  std::optional<std::string> hand;   ///< node in the hand, by its name; absent: chosen
  std::optional<double> scale_to_m;  ///< of a file that states no unit; absent: guessed
};

struct Assembly {
  FileUnit unit;                     ///< guessed; with an empty name where the file states its own
  std::vector<DraftMesh> parts;      ///< that in the hand first, then the others as in the file
  std::vector<std::string> remarks;  ///< the parts with their sizes, what was chosen and left out
};

/// The parts are what the file keeps apart: nodes with meshes of a scene (glTF, COLLADA), items of
/// the build of a 3MF file, objects of AMF, products of a STEP file, objects of an OBJ file or its
/// groups, solids of an STL file, links of a robot description where its joints at 0 have them.
/// Where there is one alone, what it is made of, as far as that has names. Any node may be in the
/// hand; by default the smallest part that a hand can hold, or the largest where none is that
/// large, of those without open edges where there are such. Parts that hold it are taken apart.
/// Left out are nodes without faces and parts without area.
/// @throws InputError  the mesh cannot be read, no such node; UsageError: there is one part alone,
/// or nothing but the hand.
[[nodiscard]] Assembly read_assembly(const AssemblyRequest& request);

}  // namespace haptic::tools
