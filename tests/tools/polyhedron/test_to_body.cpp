// SPDX-License-Identifier: Apache-2.0
/// The one rounding: exact pieces to doubles.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/tools/polyhedron/families.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

using test::general_map;

using Vector = std::array<double, 3>;

double dot3(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Vector cross3(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Body rounded(FlatBody& body) {
  const Decomposition result = decompose(body, "part", {});
  return to_body(body, result, "part");
}

// What every consumer relies on. `size` [m]: largest coordinate or part extent, for rounding.
void check_body(const Body& body, double size) {
  std::vector<int> used(body.planes.size(), 0);
  double sum = 0.0;
  for (const BodyPlane& plane : body.planes) {
    CHECK(std::abs(dot3(plane.normal, plane.normal) - 1.0) < 4.0e-16);
  }
  for (const ConvexPiece& piece : body.pieces) {
    CHECK(piece.source_vertex.size() == piece.vertices.size());
    CHECK(piece.volume_m3 > 0.0);
    sum += piece.volume_m3;
    std::size_t corners = 0;
    for (const PieceFace& face : piece.faces) {
      REQUIRE(face.plane < body.planes.size());
      ++used[face.plane];
      corners += face.loop.size();
      REQUIRE(face.loop.size() >= 3);
      for (const std::uint32_t v : face.loop) CHECK(v >= face.loop.front());
      const BodyPlane& plane = body.planes[face.plane];
      for (const Vector& x : piece.vertices) {
        CHECK(face.sign * (dot3(plane.normal, x) - plane.offset_m) <= 4.0e-16 * size);
      }
      const Vector& o = piece.vertices[face.loop[0]];
      double area = 0.0;
      for (std::size_t i = 0; i < face.loop.size(); ++i) {
        CHECK(std::abs(dot3(plane.normal, piece.vertices[face.loop[i]]) - plane.offset_m) <=
              4.0e-16 * size);
        const Vector a = minus(piece.vertices[face.loop[i]], o);
        const Vector b = minus(piece.vertices[face.loop[(i + 1) % face.loop.size()]], o);
        area += dot3(plane.normal, cross3(a, b));
      }
      CHECK(face.sign * area > 0.0);
    }
    // Euler: every edge has two sides.
    CHECK(piece.vertices.size() + piece.faces.size() == corners / 2 + 2);
  }
  for (const int count : used) CHECK(count > 0);
  CHECK(sum == doctest::Approx(body.volume_m3).epsilon(1.0e-14));
}

TEST_SUITE("tools.to_body") {
  TEST_CASE("to_body: planes, loops and volumes of a plate with holes") {
    FlatBody body = test::plate_with_turned_holes(2, 3, general_map(2000));
    const Body result = rounded(body);
    check_body(result, 1.0);
    CHECK(result.name == "part");
    for (std::size_t i = 1; i < result.pieces.size(); ++i) CHECK(result.pieces[i].volume_m3 > 0.0);
  }

  TEST_CASE("to_body: a box has its exact volume, centre and corners") {
    FlatBody body = test::empty_body();
    test::add_solid(body, test::prism(body, {{{0, 0}, {2, 0}, {2, 1}, {0, 1}}}, 0, 4, {}));
    const Body result = rounded(body);
    check_body(result, 4.0);
    CHECK(result.volume_m3 == 8.0);
    CHECK(result.centre_of_volume_m == Vector{1.0, 0.5, 2.0});
    REQUIRE(result.pieces.size() == 1);
    CHECK(result.pieces[0].vertices.size() == 8);
    CHECK(result.pieces[0].faces.size() == 6);
    for (const PieceFace& face : result.pieces[0].faces) CHECK(face.source_face >= 0);
  }

  TEST_CASE("to_body: far from the origin and tiny, planes are rounded in the file frame once") {
    for (const auto& [scale, centre, size] :
         {std::tuple{1.0, Vector{1.0e4, -2.0e4, 3.0e4}, 4.0e4},
          std::tuple{0x1p28, Vector{0.0, 0.0, 0.0}, 0x1p-28},
          std::tuple{0x1p4, Vector{12.5, 0.125, -3.75}, 16.0}}) {
      FlatBody body = test::plate_with_hole(5, general_map(10000));
      body.world.scale = scale;
      body.world.centre_m = centre;
      const Body result = rounded(body);
      CHECK(result.pieces.size() == 5);
      check_body(result, size);
    }
  }

  TEST_CASE("to_body: faces know the face of the file they lie in, cuts are marked") {
    FlatBody body = test::l_prism(general_map(60));
    const Body result = rounded(body);
    REQUIRE(result.pieces.size() == 2);
    int cuts = 0;
    std::vector<bool> seen(body.solids[0].solid.faces.size(), false);
    for (const ConvexPiece& piece : result.pieces) {
      for (const PieceFace& face : piece.faces) {
        if (face.source_face < 0) {
          ++cuts;
        } else {
          seen[static_cast<std::size_t>(face.source_face)] = true;
        }
      }
    }
    // The cut extends a face of the L: one side of it is new, the other is partly that face or
    // wholly new.
    CHECK(cuts >= 1);
    CHECK(cuts <= 2);
    for (const bool s : seen) CHECK(s);
  }

  TEST_CASE("to_body: both sides of every seam name one plane with opposite signs") {
    FlatBody body = test::plate_with_hole(4, general_map(10000));
    const Body result = rounded(body);
    for (std::size_t i = 0; i < result.pieces.size(); ++i) {
      // Every wall of the hole has a neighbour on each side.
      std::size_t neighbours = 0;
      for (std::size_t k = 0; k < result.pieces.size(); ++k) {
        bool seam = false;
        for (const PieceFace& f : result.pieces[i].faces) {
          for (const PieceFace& g : result.pieces[k].faces) {
            seam = seam || (i != k && f.plane == g.plane && f.sign == -g.sign);
          }
        }
        if (seam) ++neighbours;
      }
      CHECK(neighbours >= 2);
    }
  }

  TEST_CASE("to_body: pieces come in the order of their centres") {
    FlatBody body = test::plate_with_grid(2, {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 100});
    const Body result = rounded(body);
    std::vector<Vector> centres;
    for (const ConvexPiece& piece : result.pieces) {
      Vector low = piece.vertices[0];
      Vector high = piece.vertices[0];
      for (const Vector& x : piece.vertices) {
        for (std::size_t i = 0; i < 3; ++i) {
          low[i] = std::min(low[i], x[i]);
          high[i] = std::max(high[i], x[i]);
        }
      }
      // All pieces of this part are boxes.
      centres.push_back({(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2});
    }
    for (std::size_t i = 1; i < centres.size(); ++i)
      CHECK(centres[i - 1][0] <= centres[i][0] + 1e-15);
  }
}

}  // namespace
}  // namespace haptic::tools
