// SPDX-License-Identifier: Apache-2.0
/// Prints every bit of the pieces of a few parts; built with each arithmetic back end, whose
/// outputs must be equal.
#include <cstdio>

#include "tests/tools/polyhedron/body_bytes.hpp"
#include "tests/tools/polyhedron/families.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

int main() {
  using namespace haptic::tools;
  std::vector<FlatBody> bodies;
  for (std::size_t n = 3; n <= 9; ++n) {
    bodies.push_back(test::plate_with_hole(n, test::general_map(10000)));
  }
  bodies.push_back(test::hollow_cube(test::general_map(3)));
  bodies.push_back(test::plate_with_turned_holes(2, 5, test::general_map(2000)));
  for (std::uint64_t seed = 1000; seed < 1010; ++seed) bodies.push_back(test::random_boxes(seed));
  for (std::uint64_t seed = 5000; seed < 5010; ++seed) bodies.push_back(test::random_cells(seed));
  for (FlatBody& body : bodies) {
    const Decomposition result = decompose(body, "part", {});
    std::printf("work %a\n", result.work);
    std::fputs(test::body_text(to_body(body, result, "part")).c_str(), stdout);
  }
  return 0;
}
