// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_collada_text: the COLLADA of the tests, as a convex mesh, and as the hull of one.
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/tools/import/import_files.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  const std::string plain = tools::test::tetrahedron_dae("<unit meter=\"0.5\"/>");
  std::string convex = plain, hull = plain;
  for (std::size_t at = 0; (at = convex.find("mesh>", at)) != std::string::npos; at += 12) {
    convex.insert(at, "convex_");
  }
  hull.insert(hull.find("<geometry "),
              "<geometry id=\"h\"><convex_mesh convex_hull_of=\"#g\"/></geometry>");
  hull.replace(hull.find("url=\"#g\""), 8, "url=\"#h\"");
  return {{"plain", plain}, {"convex", convex}, {"hull", hull}};
}

}  // namespace haptic::fuzz
