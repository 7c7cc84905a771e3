// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The surface that mesh reading and cleaning would make of parts.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools::parts {

/// Surface of one or more parts, each one shell; `void_of[k]` >= 0 makes part k a cavity of that
/// part.
inline Surface surface_of(const std::vector<Part>& all, double tolerance_m = 0.0,
                          const std::vector<int>& void_of = {}) {
  Surface s;
  s.file = "part.obj";
  vec::Box bounds;
  for (const Part& part : all) {
    for (const Point3& v : part.vertices) bounds.include(v);
  }
  s.diagonal_m = bounds.diagonal();
  s.plane_tolerance_m = tolerance_m > 0.0 ? tolerance_m : 5e-6 * s.diagonal_m;
  // A coarse binary grid keeps the differences exact.
  const double grid = std::ldexp(1.0, std::ilogb(s.diagonal_m) - 3);
  for (std::size_t i = 0; i < 3; ++i) {
    s.centre_m[i] = grid * std::round(0.5 * (bounds.low[i] + bounds.high[i]) / grid);
  }
  for (std::uint32_t k = 0; k < all.size(); ++k) {
    const auto base = static_cast<std::uint32_t>(s.vertices.size());
    Shell shell;
    const bool is_void = k < void_of.size() && void_of[k] >= 0;
    shell.is_void = is_void;
    shell.parent = is_void ? static_cast<std::uint32_t>(void_of[k]) : k;
    shell.solid =
        is_void ? s.shells[shell.parent].solid : static_cast<std::uint32_t>(s.solid_count++);
    for (const Point3& v : all[k].vertices) {
      s.source_vertex.push_back(static_cast<std::uint32_t>(s.vertices.size()));
      s.vertices.push_back(vec::sub(v, s.centre_m));
    }
    for (const auto& loop : all[k].faces) {
      SurfaceFace face;
      for (const std::uint32_t v : loop) face.vertices.push_back(base + v);
      if (is_void) std::reverse(face.vertices.begin(), face.vertices.end());
      face.shell = k;
      face.source_face = static_cast<std::uint32_t>(s.faces.size());
      shell.faces.push_back(face.source_face);
      s.faces.push_back(face);
    }
    s.shells.push_back(shell);
  }
  return s;
}

}  // namespace haptic::tools::parts
