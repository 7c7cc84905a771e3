// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A surface part as the pieces that the scene writer consumes: one for each facet, with two faces,
/// and the cones that tell which contacts of the facet can carry force.

#include <string>

#include "tools/graph_compiler/graph/convex_piece.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools {

/// Body in the frame of the part's vertices; its centre is that of the surface's area. `name`: for
/// people. A facet whose corners lie off one plane by more than rounding is an error of the caller:
/// the scene writer refuses it.
[[nodiscard]] Body surface_body(const SurfacePart& part, const std::string& name);

}  // namespace haptic::tools
