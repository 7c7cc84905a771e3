// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exact solids for tests, made without any mesh: prisms over polygons with holes, unions of grid
/// cells, each under an affine map with whole-number coefficients, so that planes lie in general
/// position and all coordinates stay exact.

#include <functional>
#include <set>
#include <vector>

#include "tools/common/split_mix.hpp"
#include "tools/graph_compiler/polyhedron/chain.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools::test {

using Point2i = std::array<long, 2>;
using Cell = std::array<int, 3>;

/// x -> M x / divisor; the determinant of M must be positive.
struct AffineMap {
  std::array<std::array<long, 3>, 3> m{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  long divisor = 1;

  [[nodiscard]] Rational3 operator()(const Rational3& x) const;
  /// A rotation with rational entries (from a whole quaternion), times 1 / size.
  static AffineMap rotation(long w, long x, long y, long z, long size);
};

/// The same numbers on every platform.
class TestRandom {
 public:
  explicit TestRandom(std::uint64_t seed) : words_(seed) {}
  std::uint64_t next() { return words_.next(); }
  double uniform() { return words_.uniform(); }  ///< in [0, 1)
  long between(long low, long high);

 private:
  SplitMix64 words_;
};

/// A body with an identity frame (local = file in metres) and no solids yet.
FlatBody empty_body();

/// Adds a face given by loops of points, outer loops counter-clockwise seen from outside, holes
/// clockwise.
void add_face(FlatBody& body, Solid& solid, const std::vector<std::vector<Rational3>>& loops);

/// Prism over a polygon with holes (outer counter-clockwise, holes clockwise) between z = low and z
/// = high.
Solid prism(FlatBody& body, const std::vector<std::vector<Point2i>>& loops, long low, long high,
            const AffineMap& map);

/// Union of grid cells; cells that share a face are one solid there. Canonical, straight vertices
/// dropped.
Solid cells(FlatBody& body, const std::set<Cell>& occupied, const AffineMap& map);

/// Adds the solid to the body.
void add_solid(FlatBody& body, Solid solid);

/// A regular-like polygon with whole coordinates about (x, y), counter-clockwise, n corners.
std::vector<Point2i> polygon(std::size_t n, long x, long y, long radius);
std::vector<Point2i> reversed(std::vector<Point2i> loop);

}  // namespace haptic::tools::test
