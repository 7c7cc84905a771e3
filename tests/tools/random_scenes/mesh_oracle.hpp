// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Do a convex polyhedron and a triangle mesh overlap? Decided exactly on the uncut mesh: rational
/// predicates behind a floating-point filter. Shares no code with the decomposition.

#include <array>
#include <cstdint>
#include <vector>

namespace haptic::tools::test {

using OraclePoint = std::array<double, 3>;
using OracleTriangle = std::array<std::uint32_t, 3>;

/// A closed, outward oriented triangle mesh; coordinates are taken as exact.
struct OracleMesh {
  std::vector<OraclePoint> points;
  std::vector<OracleTriangle> triangles;
};

struct OracleCounts {
  std::uint64_t signs = 0;  ///< orientation tests
  std::uint64_t exact = 0;  ///< of these, those that the filter left to rationals
};

/// Sign of the determinant (a - d, b - d, c - d), exact: on which side of the plane a, b, c the
/// point d lies.
int orientation(const OraclePoint& a, const OraclePoint& b, const OraclePoint& c,
                const OraclePoint& d, OracleCounts& counts);

/// True if the two solids share a point (`a` has one shell): a triangle of one meets a triangle of
/// the other, or one lies inside the other. Cost: pairs of triangles whose boxes meet.
bool meshes_meet(const OracleMesh& a, const OracleMesh& b, OracleCounts& counts);

/// True if the point is inside; it must not be on the surface. Counts the crossings of a ray whose
/// direction is drawn again until it meets no edge.
bool is_inside(const OraclePoint& point, const OracleMesh& mesh, OracleCounts& counts);

}  // namespace haptic::tools::test
