// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Volumes, centres and thickness of solids from their boundary chains, in local units.

#include "tools/graph_compiler/polyhedron/chain.hpp"

namespace haptic::tools {

/// Exact volume; negative for an inward boundary. Sums of many unlike fractions: expensive for
/// large solids.
Rational volume(const ExactWorld& world, const Solid& solid);

/// Sign of the volume; in double where that is safe.
int volume_sign(const ExactWorld& world, const Solid& solid);

/// Volume and first moment (integral of x) of a solid.
struct Measure {
  Rational volume;
  Rational3 first_moment;
};

/// Computed exactly from coordinates cut off at 2^-320: right to far more digits than a double
/// keeps, at a cost that does not depend on the bits of the coordinates.
Measure measure(const ExactWorld& world, const Solid& solid);

/// Least width of a convex piece among the directions of its face normals.
double thickness(const ExactWorld& world, const Solid& piece);

/// Diagonal of the bounding box.
double diagonal(const ExactWorld& world, const std::vector<std::uint32_t>& vertices);

}  // namespace haptic::tools
