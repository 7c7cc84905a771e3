// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_scene_view: what the scene writer makes of a few convex bodies.
#include <cstring>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/shapes.hpp"

namespace haptic::fuzz {
namespace {

std::string blob_of(const tools::Body& moving, const std::vector<tools::Body>& statics) {
  const std::vector<std::byte> bytes = tools::write_scene(test::scene_of(moving, statics));
  std::string text(bytes.size(), '\0');
  std::memcpy(text.data(), bytes.data(), bytes.size());
  return text;
}

}  // namespace

std::vector<Seed> seeds() {
  const tools::Body tetrahedron = test::tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03},
                                                    {-0.03, -0.04, -0.03}, {0, 0, 0.06});
  const tools::Body small = test::tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const tools::Body table = test::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0});
  const tools::Body step = test::box({-0.1, -0.1, 0}, {0, 0.1, 0.05});
  return {{"two_tetrahedra", blob_of(small, {small})},
          {"tetrahedron_box", blob_of(tetrahedron, {table})},
          {"tetrahedron_step", blob_of(tetrahedron, {test::join({table, step})})},
          {"two_statics", blob_of(tetrahedron, {tetrahedron, step})}};
}

}  // namespace haptic::fuzz
