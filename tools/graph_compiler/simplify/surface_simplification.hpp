// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A surface part with the fewest facets that edge collapse finds within a tolerance.

#include <functional>
#include <string>

#include "tools/graph_compiler/simplify/edge_collapse.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools {

struct SimplifiedPart {
  SurfacePart part;
  SurfaceAccount found;  ///< what was found in the given mesh, and the facets of the result
  CollapseAccount collapsed;
};

/// The part as make_surface_part() makes it, simplified within `tolerance_m`.
/// @param tell  the part of the work that is done, in [0, 1].
/// @throws InputError of make_surface_part, and with the place where a hole, gap or wall is no
/// wider than two tolerances, so that its sides could come to lie on each other.
SimplifiedPart simplified_surface(const RawMesh& raw, const SurfaceOptions& options,
                                  double tolerance_m, const std::function<void(double)>& tell);

/// One sentence for people: the facets and the proved distances.
std::string collapse_text(const CollapseAccount& account);

}  // namespace haptic::tools
