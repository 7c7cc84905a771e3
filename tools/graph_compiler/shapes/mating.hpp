// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Checks whether the facets of two round shapes that fit into each other are fine enough for the
/// clearance between them.

#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools {

/// One sentence for each outer surface of one shape and hole of the other that fit (equal pitch
/// where they are threads; the hole not smaller) with a clearance below the two chord errors
/// together. There the play depends on how the facets stand, and the parts ratchet when they turn.
/// @param names  of the two shapes, for the sentences.
std::vector<std::string> fit_warnings(const Shape& a, const Shape& b, const std::string& name_a,
                                      const std::string& name_b);

/// Smallest distance between the round surfaces of two shapes that fit into each other at one axis,
/// absent where none do. Of threads: across the flanks, half of what it is along the radius.
std::optional<double> least_clearance_m(const Shape& a, const Shape& b);

}  // namespace haptic::tools
