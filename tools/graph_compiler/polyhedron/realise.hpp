// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exact planes and corners such that every incidence between them holds exactly, also at corners
/// that lie on more than three planes (METHOD section 3, "Corners on more than three
/// planes"). Local units: about 1 wide.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"
#include "tools/graph_compiler/polyhedron/exact.hpp"

namespace haptic::tools {

/// A plane as wanted: (normal + normal_tail) . x = offset + offset_tail, near unit normal.
struct WantedPlane {
  Point3 normal{0, 0, 0};
  Point3 normal_tail{0, 0, 0};
  double offset = 0.0;
  double offset_tail = 0.0;
  int axis = -1;  ///< 0..2: exactly x_axis = offset
};

/// A corner within the tolerance of a plane that it does not bound. Where such wishes hold, a plane
/// that is extended by a cut meets the corner exactly, instead of leaving a sliver next to it.
struct WishedIncidence {
  std::uint32_t corner = 0;
  std::uint32_t plane = 0;
  double distance = 0.0;
};

struct CornerPlaneGraph {
  std::vector<Point3> corners;                            ///< as wanted
  std::vector<std::vector<std::uint32_t>> corner_planes;  ///< incidences that must hold, ascending
  std::vector<WishedIncidence> wishes;
  std::vector<WantedPlane> planes;
};

/// Which planes the peeling takes off at a time, where several can go.
enum class PeelOrder {
  kBestFirst,  ///< the best conditioned one: least movement, but chains as long as the surface
  kLayers      ///< all of them: chains of placements grow with the logarithm of the surface only
};

struct RealiseRules {
  PeelOrder order = PeelOrder::kBestFirst;
  /// Normals with largest component 1 to 2^-normal_bits, offsets to 2^-(normal_bits + 4).
  int normal_bits = 32;
  /// Free coordinates of corners to 2^-position_bits; 0: the double itself.
  int position_bits = 36;
  bool wishes = true;
  std::size_t max_bits = 4000;  ///< numerator plus denominator of any coordinate
};

enum class RealiseOutcome {
  kDone,
  kStuck,       ///< planes and corners form a core that no order resolves
  kTooManyBits  ///< a coordinate passed max_bits
};

struct Realisation {
  RealiseOutcome outcome = RealiseOutcome::kDone;
  std::vector<Rational3> corners;
  std::vector<Rational3> normals;
  std::vector<Rational> offsets;
  std::size_t largest_bits = 0;
  std::size_t stuck_count = 0;                ///< planes and corners left when stuck
  std::vector<std::uint32_t> failed_corners;  ///< where it failed, at most a few
  std::size_t wishes_kept = 0;
};

/// Peels the bipartite graph of corners and planes and places in the reverse order.
/// Cost: quadratic in planes in the worst case, near linear in practice, plus exact arithmetic on
/// growing numbers.
Realisation realise(const CornerPlaneGraph& graph, const RealiseRules& rules);

/// Keeps all corners exactly as they are, where all incidences (and all wishes, if asked for) then
/// hold exactly: axis-aligned boxes, upright prisms, triangulated surfaces. Returns false where
/// they do not.
bool realise_unmoved(const CornerPlaneGraph& graph, bool wishes, Realisation& out);

/// Plane through three exact points, n.x = d with the largest component of n equal to 1; false
/// where they are in line.
bool plane_through(const Rational3& a, const Rational3& b, const Rational3& c, Rational3& n,
                   Rational& d);

}  // namespace haptic::tools
