// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What must hold of every mesh that a reader accepts, and of every refusal.

#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::fuzz {

inline void check_raw_mesh(const tools::RawMesh& mesh) {
  require(!mesh.faces.empty(), "an accepted mesh has a face");
  require(mesh.vertex_places.size() == mesh.vertices.size(), "each vertex has a place");
  require(std::isfinite(mesh.print_resolution) && mesh.print_resolution >= 0.0,
          "the print resolution is a length");
  for (const tools::Point3& p : mesh.vertices) {
    require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]),
            "coordinates are finite");
  }
  for (const tools::RawFace& face : mesh.faces) {
    require(face.vertices.size() >= 3, "a face has three corners");
    for (const std::uint32_t v : face.vertices) {
      require(v < mesh.vertices.size(), "corners refer to vertices");
    }
  }
}

/// The text of an InputError about the file "fuzz".
inline void check_refusal(std::string_view text) {
  require(text.starts_with("fuzz:"), "a refusal begins with the file");
  require(text.find("; ") != std::string_view::npos, "a refusal names the fix");
  require(text.size() < 1000, "a refusal is readable");
}

}  // namespace haptic::fuzz
