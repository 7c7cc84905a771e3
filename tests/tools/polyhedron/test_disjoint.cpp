// SPDX-License-Identifier: Apache-2.0
/// Solids that overlap, cut apart: the union is what it was, and every point of it is in one piece.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

using parts::Part;
using parts::Random;

/// A whole number in [low, high].
int between(Random& random, int low, int high) {
  return std::min(high, static_cast<int>(std::floor(random.uniform(low, high + 1.0))));
}

Decomposition cut_apart(FlatBody& body) {
  DecompositionLimits limits;
  limits.disjoint = true;
  return decompose(body, "part.obj", limits);
}

/// Pieces that have the point, which must be on none of their planes.
std::size_t pieces_around(const Body& body, const Point3& p) {
  std::size_t count = 0;
  for (const ConvexPiece& piece : body.pieces) {
    bool inside = true;
    for (const PieceFace& face : piece.faces) {
      const BodyPlane& plane = body.planes[face.plane];
      inside = inside && face.sign * (vec::dot(plane.normal, p) - plane.offset_m) < 0.0;
    }
    count += inside ? 1 : 0;
  }
  return count;
}

constexpr int kGrid = 6;  // cells along each axis

struct GridBox {
  std::array<int, 3> low{}, high{};
  [[nodiscard]] bool has(const std::array<int, 3>& cell) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (cell[i] < low[i] || cell[i] >= high[i]) return false;
    }
    return true;
  }
};

std::vector<GridBox> random_boxes(Random& random, int count) {
  std::vector<GridBox> boxes(static_cast<std::size_t>(count));
  for (GridBox& box : boxes) {
    for (std::size_t i = 0; i < 3; ++i) {
      box.low[i] = between(random, 0, kGrid - 2);
      box.high[i] = between(random, box.low[i] + 1, kGrid);
    }
  }
  return boxes;
}

TEST_SUITE("tools.disjoint") {
  TEST_CASE("disjoint: random boxes, the volume of their cells, each cell in one piece") {
    std::size_t overlapping = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      CAPTURE(seed);
      Random random(seed);
      const std::vector<GridBox> boxes = random_boxes(random, 2 + static_cast<int>(seed % 4));
      std::vector<Part> solids;
      for (const GridBox& b : boxes) {
        solids.push_back(parts::box({1.0 * b.low[0], 1.0 * b.low[1], 1.0 * b.low[2]},
                                    {1.0 * b.high[0], 1.0 * b.high[1], 1.0 * b.high[2]}));
      }
      FlatBody flat = flatten(parts::surface_of(solids), {});
      const Decomposition apart = cut_apart(flat);
      REQUIRE(apart.certificate.holds());
      CHECK_FALSE(apart.certificate.cover);
      overlapping += apart.certificate.removed > 0 ? 1 : 0;
      const Body body = to_body(flat, apart, "part");
      int cells = 0;
      for (int k = 0; k < kGrid * kGrid * kGrid; ++k) {
        const std::array<int, 3> cell{k % kGrid, k / kGrid % kGrid, k / (kGrid * kGrid)};
        const bool filled =
            std::any_of(boxes.begin(), boxes.end(), [&](const GridBox& b) { return b.has(cell); });
        cells += filled ? 1 : 0;
        const Point3 middle{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5};
        CHECK(pieces_around(body, middle) == (filled ? 1 : 0));
      }
      CHECK(body.volume_m3 == doctest::Approx(cells).epsilon(1e-12));
    }
    CHECK(overlapping > 10);
  }

  TEST_CASE("disjoint: turned prisms, every point of the union in one piece, of nothing else") {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      CAPTURE(seed);
      Random random(seed);
      std::vector<Part> solids;
      for (int k = 0; k < 3; ++k) {
        Part prism = parts::prism(parts::regular_outline(between(random, 3, 7), 1.0), -0.7, 0.7);
        prism.transform(parts::random_rotation(random), 1.0,
                        {0.1 * between(random, -5, 5), 0.1 * between(random, -5, 5), 0.2 * k});
        solids.push_back(std::move(prism));
      }
      FlatBody flat = flatten(parts::surface_of(solids), {});
      FlatBody same = flatten(parts::surface_of(solids), {});
      const Decomposition apart = cut_apart(flat);
      const Decomposition cover = decompose(same, "part.obj", {});
      REQUIRE(apart.certificate.holds());
      CHECK(cover.certificate.cover);
      CHECK(apart.certificate.removed > 0);
      CHECK(apart.certificate.volume_m3 < cover.certificate.volume_m3);
      const Body pieces = to_body(flat, apart, "part"), solid = to_body(same, cover, "part");
      std::size_t filled = 0;
      for (int k = 0; k < 2000; ++k) {
        Point3 p{};
        for (double& x : p) x = random.uniform(-2.0, 2.0);
        const bool within = pieces_around(solid, p) > 0;
        filled += within ? 1 : 0;
        CHECK(pieces_around(pieces, p) == (within ? 1 : 0));
      }
      CHECK(filled > 100);
    }
  }

  TEST_CASE("disjoint: the certificate misses a removed part, and one that no piece covers") {
    FlatBody flat = flatten(
        parts::surface_of({parts::box({0, 0, 0}, {2, 2, 2}), parts::box({1, 1, 1}, {3, 3, 3})}),
        {});
    const Decomposition cover = decompose(flat, "part.obj", {});
    const DisjointPieces good = make_disjoint(flat.world, cover.pieces, cover.piece_solid);
    REQUIRE(good.removed.size() == 1);
    const auto check = [&](const DisjointPieces& apart) {
      return certify(flat.world, flat.solids, apart.pieces, apart.piece_solid, &apart);
    };
    CHECK(check(good).holds());
    DisjointPieces lost = good;
    lost.removed.clear();
    lost.removed_solid.clear();
    CHECK_FALSE(check(lost).partition);
    DisjointPieces uncovered = good;
    // The piece that covers it counts as removed, too: both solids are whole, the union is not.
    const auto owner = std::find(uncovered.piece_solid.begin(), uncovered.piece_solid.end(), 0U);
    const auto at = owner - uncovered.piece_solid.begin();
    uncovered.removed.push_back(uncovered.pieces[static_cast<std::size_t>(at)]);
    uncovered.removed_solid.push_back(0);
    uncovered.pieces.erase(uncovered.pieces.begin() + at);
    uncovered.piece_solid.erase(owner);
    CHECK_FALSE(check(uncovered).holds());
    DisjointPieces kept = good;
    kept.pieces.push_back(good.removed[0]);
    kept.piece_solid.push_back(good.removed_solid[0]);
    kept.removed.clear();
    kept.removed_solid.clear();
    CHECK_FALSE(check(kept).disjoint);
  }
}

}  // namespace
}  // namespace haptic::tools
