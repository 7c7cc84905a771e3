// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_mesh_import: the tetrahedron of the tests in every format, and a box in STEP.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tests/tools/import/step_files.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  using namespace haptic::tools::test;
  const std::string two_items =
      "<item objectid=\"1\"/><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 20 30\"/>";
  return {
      {"3mf", std::string(1, '\0') + archive_of_3mf(model_of_3mf("unit=\"inch\"", two_items))},
      {"packed_3mf", std::string(1, '\0') + archive_of_3mf(model_of_3mf(), Packing::kDeflated)},
      {"gltf", '\1' + tetrahedron_gltf("\"scale\":[1,1,-2],")},
      {"nodes", '\1' + gltf_of_nodes("{\"name\":\"a\",\"mesh\":0,\"children\":[1]},{\"name\":\"b\","
                                     "\"mesh\":0},{\"name\":\"b\",\"mesh\":0}",
                                     "0,2")},
      {"glb", '\2' + tetrahedron_glb()},
      {"dae", '\3' + tetrahedron_dae("<unit meter=\"0.5\"/><up_axis>Y_UP</up_axis>",
                                     "<translate>10 20 30</translate>")},
      {"amf", '\4' + tetrahedron_amf("unit=\"feet\"")},
      {"step", '\5' + step_box({1, 2, 3})},
      {"step_assembly", '\5' + step_assembly()}};
}

}  // namespace haptic::fuzz
