// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_import_message: a tetrahedron as assimp and as Open CASCADE give it.
#include "tests/fuzz/fuzz_target.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  tools::ImportedMesh imported;
  imported.unit_m = 1e-3;
  imported.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const std::vector<std::uint32_t>& loop :
       {std::vector<std::uint32_t>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    tools::RawFace face;
    face.vertices = loop;
    imported.mesh.faces.push_back(face);
  }
  std::vector<Seed> all{{"assimp", tools::message_of(imported)}};
  imported.mesh.warnings = {"left out: object '2' (line 4), since its type is 'support'", "more"};
  all.push_back({"warnings", tools::message_of(imported)});
  imported.mesh.nodes = {{"machine", tools::MeshNode::kNone, false}, {"bolt", 0, true}};
  imported.mesh.group_nodes = {1};
  all.push_back({"nodes", tools::message_of(imported)});
  imported.deflection = tools::Deflection{1e-4, 5e-5};
  imported.node_deflections = {{}, {1e-4, 5e-5}};
  all.push_back({"step", tools::message_of(imported)});
  return all;
}

}  // namespace haptic::fuzz
