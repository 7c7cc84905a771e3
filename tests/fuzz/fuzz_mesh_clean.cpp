// SPDX-License-Identifier: Apache-2.0
/// Any mesh that the reader accepts: cleaned to a surface that keeps every promise of surface.hpp,
/// or refused with InputError.
#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/mesh_input.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"

namespace {

/// Beyond these a single run is too slow under the sanitizers to find anything.
constexpr std::size_t kMostFaces = 400;
constexpr std::size_t kMostCorners = 1600;

bool is_small(const haptic::tools::RawMesh& mesh) {
  std::size_t corners = 0;
  for (const haptic::tools::RawFace& face : mesh.faces) {
    corners += face.vertices.size();
  }
  return mesh.faces.size() <= kMostFaces && corners <= kMostCorners;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using haptic::fuzz::require;
  const auto mesh = haptic::fuzz::parse_input(data, size);
  if (!mesh || !is_small(*mesh)) {
    return 0;
  }
  try {
    const haptic::tools::Surface surface = haptic::tools::clean_surface(*mesh, {});
    const std::string violation = haptic::tools::test::violation(surface);
    require(violation.empty(), violation.c_str());
    for (const haptic::tools::Point3& p : surface.vertices) {
      require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
              "coordinates are finite");
    }
    require(surface.plane_tolerance_m > 0.0 && surface.diagonal_m > 0.0, "lengths are positive");
  } catch (const haptic::tools::InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("fuzz:"), "a refusal begins with the file");
    require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
  }
  return 0;
}
