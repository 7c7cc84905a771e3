// SPDX-License-Identifier: Apache-2.0
/// Whole decompositions of parts made by formula: numbers of pieces, certificate, limits, refusals,
/// determinism.
#include <doctest/doctest.h>

#include "tests/tools/polyhedron/body_bytes.hpp"
#include "tests/tools/polyhedron/families.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

using test::AffineMap;
using test::general_map;

AffineMap straight(long size) { return {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, size}; }

// `decompose` throws unless its certificate holds; here it is computed again, from scratch.
std::size_t certified_pieces(FlatBody body) {
  const Decomposition result = decompose(body, "part", {});
  CHECK(result.warnings.empty());
  CHECK(result.face_plane_only_pieces >= result.pieces.size());
  CHECK(result.work > 0.0);
  const Certificate again = certify(body.world, body.solids, result.pieces, result.piece_solid);
  CHECK(again.holds());
  CHECK_FALSE(again.cover);
  CHECK(again.volume_m3 == result.certificate.volume_m3);
  return result.pieces.size();
}

std::string refusal(FlatBody body, const DecompositionLimits& limits = {}) {
  try {
    decompose(body, "part.obj", limits);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_SUITE("tools.decomposition") {
  TEST_CASE("decompose: a convex part is one piece, untouched") {
    FlatBody body = test::empty_body();
    test::add_solid(body, test::cells(body, {{0, 0, 0}, {1, 0, 0}}, general_map(3)));
    const std::size_t vertices = body.world.vertices.size();
    const std::size_t planes = body.world.planes.size();
    CHECK(certified_pieces(body) == 1);
    CHECK(body.world.vertices.size() == vertices);
    CHECK(body.world.planes.size() == planes);
  }

  TEST_CASE("decompose: an L is two pieces, a hollow cube six") {
    for (const bool turned : {false, true}) {
      CHECK(certified_pieces(test::l_prism(turned ? general_map(60) : straight(60))) == 2);
      CHECK(certified_pieces(test::hollow_cube(turned ? general_map(3) : straight(3))) == 6);
    }
  }

  TEST_CASE("decompose: a hole of n corners comes out as n walls") {
    for (std::size_t n = 3; n <= 16; ++n) {
      CAPTURE(n);
      CHECK(certified_pieces(test::plate_with_hole(n, general_map(10000))) == n);
    }
  }

  TEST_CASE("decompose: plates with k x k square holes need no more pieces than measured before") {
    // tools/graph_compiler/METHOD.md section 8: 16, 36, 64 reflex edges.
    const std::array<std::size_t, 3> at_most{7, 12, 23};
    for (int k = 2; k <= 4; ++k) {
      CAPTURE(k);
      CHECK(certified_pieces(test::plate_with_grid(k, general_map(100))) <=
            at_most[static_cast<std::size_t>(k - 2)]);
    }
    CHECK(certified_pieces(test::plate_with_turned_holes(2, 2, general_map(2000))) <= 13);
  }

  TEST_CASE("decompose: solids that touch along an edge or in a corner stay two") {
    for (const test::Cell& other : {test::Cell{1, 1, 0}, test::Cell{1, 1, 1}}) {
      FlatBody body = test::empty_body();
      test::add_solid(body, test::cells(body, {{0, 0, 0}, other}, general_map(2)));
      CHECK(certified_pieces(body) == 2);
      FlatBody apart = test::empty_body();
      test::add_solid(apart, test::cells(apart, {{0, 0, 0}}, general_map(2)));
      test::add_solid(apart, test::cells(apart, {other}, general_map(2)));
      CHECK(certified_pieces(apart) == 2);
    }
  }

  TEST_CASE("decompose: a ring that meets itself along an edge") {
    FlatBody body = test::empty_body();
    test::add_solid(body, test::cells(body,
                                      {{0, 0, 0},
                                       {1, 0, 0},
                                       {1, 0, 1},
                                       {1, 1, 1},
                                       {0, 1, 1},
                                       {0, 1, 2},
                                       {0, 0, 2},
                                       {1, 0, 2}},
                                      general_map(3)));
    CHECK(certified_pieces(body) <= 5);
  }

  TEST_CASE("decompose: random unions of boxes are certified") {
    for (std::uint64_t seed = 1000; seed < 1040; ++seed) {
      CAPTURE(seed);
      CHECK(certified_pieces(test::random_boxes(seed)) >= 1);
    }
  }

  TEST_CASE("decompose: random cells that touch along edges and in corners are certified") {
    for (std::uint64_t seed = 5000; seed < 5020; ++seed) {
      CAPTURE(seed);
      CHECK(certified_pieces(test::random_cells(seed)) >= 1);
    }
  }

  TEST_CASE("decompose: [long] many random parts are certified") {
    for (std::uint64_t seed = 20000; seed < 20300; ++seed) {
      CAPTURE(seed);
      CHECK(certified_pieces(test::random_boxes(seed)) >= 1);
      CHECK(certified_pieces(test::random_cells(seed)) >= 1);
    }
    for (int k = 5; k <= 8; ++k) {
      CAPTURE(k);
      CHECK(certified_pieces(test::plate_with_grid(k, general_map(30L * k))) <= 70);
    }
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      CAPTURE(seed);
      CHECK(certified_pieces(test::plate_with_turned_holes(4, seed, general_map(4000))) <= 60);
    }
  }

  TEST_CASE("decompose: a pentagram prism passes through itself and is refused") {
    FlatBody body = test::empty_body();
    const std::vector<test::Point2i> corners = test::polygon(5, 0, 0, 1000);
    std::vector<test::Point2i> star;
    for (std::size_t i = 0; i < 5; ++i) star.push_back(corners[(2 * i) % 5]);
    test::add_solid(body, test::prism(body, {star}, 0, 500, general_map(1000)));
    const std::string text = refusal(body);
    CHECK(contains(text, "part.obj"));
    CHECK(contains(text, "not convex"));
    CHECK(contains(text, "passes through itself"));
  }

  TEST_CASE("decompose: one solid made of two boxes that overlap is refused") {
    FlatBody body = test::empty_body();
    Solid both = test::prism(body, {{{0, 0}, {20, 0}, {20, 10}, {0, 10}}}, 0, 10, general_map(20));
    const Solid other =
        test::prism(body, {{{5, 3}, {15, 3}, {15, 18}, {5, 18}}}, 2, 15, general_map(20));
    both.faces.insert(both.faces.end(), other.faces.begin(), other.faces.end());
    test::add_solid(body, both);
    CHECK(contains(refusal(body), "pieces of one solid overlap"));
  }

  TEST_CASE("decompose: an open solid is refused") {
    FlatBody body = test::l_prism(general_map(60));
    body.solids[0].solid.faces.pop_back();
    CHECK(contains(refusal(body), "open"));
    FlatBody nothing = test::empty_body();
    CHECK(contains(refusal(nothing), "no solid"));
  }

  TEST_CASE(
      "decompose: solids that overlap become a cover with a warning, solids that touch do not") {
    FlatBody body = test::empty_body();
    test::add_solid(
        body, test::prism(body, {{{0, 0}, {20, 0}, {20, 10}, {0, 10}}}, 0, 10, general_map(20)));
    test::add_solid(
        body, test::prism(body, {{{0, 0}, {10, 0}, {10, 20}, {0, 20}}}, 0, 8, general_map(20)));
    test::add_solid(
        body, test::prism(body, {{{20, 0}, {30, 0}, {30, 10}, {20, 10}}}, 0, 10, general_map(20)));
    const Decomposition result = decompose(body, "part.obj", {});
    CHECK(result.pieces.size() == 3);
    CHECK(result.certificate.holds());
    CHECK(result.certificate.cover);
    REQUIRE(result.warnings.size() == 1);
    CHECK(contains(result.warnings[0], "(1 and 2)"));
  }

  TEST_CASE("decompose: crossed beams that no face separates are distinguished exactly") {
    // Edge against edge: a gap of 2^-40 that only a plane along both edges shows.
    for (const bool overlap : {false, true}) {
      FlatBody body = test::empty_body();
      const Rational gap = Rational(overlap ? -1 : 1) / Rational(Integer(1) << 40);
      const auto roof = [&](bool upper) {
        Solid solid;
        const auto at = [&](long a, long b, long h) {
          const Rational height = Rational(upper ? -h : h) / 8 + (upper ? gap : Rational(0));
          if (upper) return Rational3{Rational(b) / 8, Rational(a) / 8, height};
          return Rational3{Rational(a) / 8, Rational(b) / 8, height};
        };
        std::vector<std::vector<Rational3>> faces;
        faces.push_back({at(-4, -1, -2), at(4, -1, -2), at(4, 0, 0), at(-4, 0, 0)});
        faces.push_back({at(4, 1, -2), at(-4, 1, -2), at(-4, 0, 0), at(4, 0, 0)});
        faces.push_back({at(-4, -1, -2), at(-4, 1, -2), at(4, 1, -2), at(4, -1, -2)});
        faces.push_back({at(4, -1, -2), at(4, 1, -2), at(4, 0, 0)});
        faces.push_back({at(-4, 1, -2), at(-4, -1, -2), at(-4, 0, 0)});
        for (const std::vector<Rational3>& face : faces) test::add_face(body, solid, {face});
        return solid;
      };
      test::add_solid(body, roof(false));
      test::add_solid(body, roof(true));
      const Decomposition result = decompose(body, "beams", {});
      CHECK(result.certificate.holds());
      CHECK(result.certificate.cover == overlap);
    }
  }

  TEST_CASE("decompose: limits refuse with their number and a way out") {
    FlatBody tight = test::plate_with_grid(3, general_map(100));
    tight.world.work_limit = tight.world.work + 20000.0;
    const std::string work = refusal(tight);
    CHECK(contains(work, "work limit"));
    CHECK(contains(work, "--simplify DISTANCE"));
    DecompositionLimits limits;
    limits.max_pieces = 5;
    const std::string pieces = refusal(test::plate_with_grid(2, general_map(100)), limits);
    CHECK(contains(pieces, "more than 5 convex pieces"));
  }

  TEST_CASE("decompose: at the work limit the best result so far is used and said") {
    FlatBody body = test::plate_with_grid(3, general_map(100));
    FlatBody copy = body;
    DecompositionLimits one;
    one.strategies = 1;
    const double needed = decompose(copy, "part", one).work;
    body.world.work_limit = body.world.work + 1.2 * needed;
    const Decomposition result = decompose(body, "part", {});
    CHECK(result.certificate.holds());
    REQUIRE(result.warnings.size() == 1);
    CHECK(contains(result.warnings[0], "best result so far"));
  }

  TEST_CASE("decompose: progress rises from 0 to 1") {
    FlatBody body = test::plate_with_hole(6, general_map(10000));
    std::vector<double> seen;
    decompose(body, "part", {}, [&](double f) { seen.push_back(f); });
    REQUIRE(seen.size() > 2);
    CHECK(seen.front() == 0.0);
    CHECK(seen.back() == 1.0);
    for (std::size_t i = 1; i < seen.size(); ++i) CHECK(seen[i - 1] <= seen[i]);
  }

  TEST_CASE("decompose: two runs give the same bytes") {
    for (int which = 0; which < 3; ++which) {
      const auto run = [&] {
        FlatBody body = which == 0   ? test::plate_with_hole(9, general_map(10000))
                        : which == 1 ? test::plate_with_turned_holes(2, 7, general_map(2000))
                                     : test::random_cells(5003);
        const Decomposition result = decompose(body, "part", {});
        return test::body_text(to_body(body, result, "part"));
      };
      CHECK(run() == run());
    }
  }
}

}  // namespace
}  // namespace haptic::tools
