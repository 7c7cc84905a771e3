// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which facets of a surface part meet where: mesh edges, rings, and seams whose two sides are
/// divided differently.

#include "tools/graph_compiler/surface/surface_part.hpp"

namespace haptic::tools {

/// Fills rings, edges, inward directions and `closed` of a part whose vertices and facets are
/// there, and the edges, shells and crack of the account.
/// Open edges that lie within `weld_radius_m` of each other over a length overlap.
/// Cost: O(n log n), and O(log n) for each open edge that few others are near.
void find_neighbourhood(SurfacePart& part, double weld_radius_m, SurfaceAccount& account);

}  // namespace haptic::tools
