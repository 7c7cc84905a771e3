// SPDX-License-Identifier: Apache-2.0
/// The certificate must hold for what the decomposition makes and fail for every mutation of it.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/tools/polyhedron/solid_builder.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

using test::AffineMap;

struct Sample {
  FlatBody body;
  std::vector<Solid> pieces;
  std::vector<std::uint32_t> owner;

  [[nodiscard]] Certificate check() { return certify(body.world, body.solids, pieces, owner); }
};

// A plate with two polygonal holes in general position: eight and more pieces.
Sample plate() {
  Sample sample;
  const AffineMap map = AffineMap::rotation(7, 2, -3, 5, 1000);
  test::add_solid(sample.body, test::prism(sample.body,
                                           {{{-900, -500}, {900, -500}, {900, 500}, {-900, 500}},
                                            test::reversed(test::polygon(5, -450, 30, 300)),
                                            test::reversed(test::polygon(4, 420, -20, 310))},
                                           0, 200, map));
  const Decomposition result = decompose(sample.body, "plate", {});
  sample.pieces = result.pieces;
  sample.owner = result.piece_solid;
  return sample;
}

TEST_SUITE("tools.certificate") {
  TEST_CASE("certify: holds for the pieces as made") {
    Sample sample = plate();
    CHECK(sample.pieces.size() >= 8);
    const Certificate c = sample.check();
    CHECK(c.convex);
    CHECK(c.partition);
    CHECK(c.disjoint);
    CHECK(c.volume_equal);
    CHECK_FALSE(c.cover);
    CHECK(c.nonzero_counts == 0);
    CHECK(c.holds());
  }

  TEST_CASE("certify: a dropped piece leaves counts and volume") {
    const Sample original = plate();
    for (std::size_t i = 0; i < original.pieces.size(); ++i) {
      Sample sample = original;
      sample.pieces.erase(sample.pieces.begin() + static_cast<std::ptrdiff_t>(i));
      sample.owner.pop_back();
      const Certificate c = sample.check();
      CHECK_FALSE(c.partition);
      CHECK_FALSE(c.volume_equal);
      CHECK(c.nonzero_counts > 10);
      CHECK(c.convex);
      CHECK(c.disjoint);
    }
  }

  TEST_CASE("certify: a doubled piece leaves counts and overlaps itself") {
    const Sample original = plate();
    for (std::size_t i = 0; i < original.pieces.size(); ++i) {
      Sample sample = original;
      sample.pieces.push_back(sample.pieces[i]);
      sample.owner.push_back(0);
      const Certificate c = sample.check();
      CHECK_FALSE(c.partition);
      CHECK_FALSE(c.disjoint);
      CHECK_FALSE(c.volume_equal);
    }
  }

  TEST_CASE("certify: a corner moved by 2^-40 leaves counts") {
    const Sample original = plate();
    for (std::size_t i = 0; i < original.pieces.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Sample sample = original;
        const std::uint32_t v = sample.pieces[i].faces[0].edges[0].first;
        Rational3 x = sample.body.world.vertices[v].x;
        x[axis] += Rational(std::ldexp(1.0, -40));
        const std::uint32_t moved = sample.body.world.find_or_add_vertex(x);
        for (ExactFace& face : sample.pieces[i].faces) {
          for (ChainEdge& e : face.edges) {
            if (e.first == v) e.first = moved;
            if (e.second == v) e.second = moved;
          }
        }
        const Certificate c = sample.check();
        CHECK_FALSE(c.partition);
        CHECK_FALSE(c.holds());
        CHECK(c.nonzero_counts > 0);
      }
    }
  }

  TEST_CASE("certify: a corner moved in every piece that has it still fails") {
    Sample sample = plate();
    const std::uint32_t v = sample.pieces[0].faces[0].edges[0].first;
    Rational3 x = sample.body.world.vertices[v].x;
    x[1] += Rational(std::ldexp(1.0, -40));
    const std::uint32_t moved = sample.body.world.find_or_add_vertex(x);
    for (Solid& piece : sample.pieces) {
      for (ExactFace& face : piece.faces) {
        for (ChainEdge& e : face.edges) {
          if (e.first == v) e.first = moved;
          if (e.second == v) e.second = moved;
        }
      }
    }
    CHECK_FALSE(sample.check().holds());
  }

  TEST_CASE("certify: a flipped facet makes a piece that is not convex") {
    const Sample original = plate();
    for (std::size_t i = 0; i < original.pieces.size(); ++i) {
      for (std::size_t f = 0; f < original.pieces[i].faces.size(); ++f) {
        Sample sample = original;
        sample.pieces[i].faces[f].sign *= -1;
        CHECK_FALSE(sample.check().convex);
      }
    }
  }

  TEST_CASE("certify: a facet on another plane, a facet left out, a piece of another solid") {
    Sample other_plane = plate();
    Solid& piece = other_plane.pieces[0];
    piece.faces[0].plane = piece.faces[1].plane;
    CHECK_FALSE(other_plane.check().convex);

    Sample open = plate();
    open.pieces[0].faces.pop_back();
    CHECK_FALSE(open.check().convex);
    CHECK_FALSE(open.check().partition);

    Sample none = plate();
    none.pieces.clear();
    none.owner.clear();
    CHECK_FALSE(none.check().holds());
  }

  TEST_CASE("certify: pieces united across a cut into something not convex fail the first part") {
    Sample sample = plate();
    // The whole plate as one "piece": counts agree, convexity does not.
    sample.pieces = {sample.body.solids[0].solid};
    sample.owner = {0};
    const Certificate c = sample.check();
    CHECK(c.partition);
    CHECK(c.volume_equal);
    CHECK_FALSE(c.convex);
    CHECK_FALSE(c.holds());
  }
}

}  // namespace
}  // namespace haptic::tools
