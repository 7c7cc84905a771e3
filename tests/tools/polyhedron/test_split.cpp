// SPDX-License-Identifier: Apache-2.0
/// Cuts on boundary chains: every case that a cut can meet, checked by exact volume and closedness.
#include <doctest/doctest.h>

#include "tests/tools/polyhedron/solid_builder.hpp"
#include "tools/graph_compiler/polyhedron/components.hpp"
#include "tools/graph_compiler/polyhedron/cuts.hpp"
#include "tools/graph_compiler/polyhedron/measure.hpp"
#include "tools/graph_compiler/polyhedron/split.hpp"

namespace haptic::tools {
namespace {

using test::AffineMap;
using test::Cell;

std::set<Cell> block(int nx, int ny, int nz) {
  std::set<Cell> cells;
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      for (int z = 0; z < nz; ++z) cells.insert({x, y, z});
    }
  }
  return cells;
}

std::uint32_t plane_of(ExactWorld& world, long nx, long ny, long nz, const Rational& d) {
  int sign = 1;
  return world.find_or_add_plane({Rational(nx), Rational(ny), Rational(nz)}, d, sign);
}

// Cuts and checks what holds of every cut: closed parts on the right sides whose volumes add up.
Halves checked_split(ExactWorld& world, const Solid& solid, std::uint32_t plane) {
  std::optional<Halves> halves = Splitter(world).split(solid, plane);
  REQUIRE(halves.has_value());
  Rational sum = 0;
  for (const auto& [parts, side] : {std::pair(&halves->below, -1), std::pair(&halves->above, 1)}) {
    REQUIRE(!parts->empty());
    for (const Solid& part : *parts) {
      CHECK(is_closed(part));
      for (const std::uint32_t v : vertices_of(part)) CHECK(world.side(v, plane) * side >= 0);
      const Rational part_volume = volume(world, part);
      CHECK(part_volume > 0);
      sum += part_volume;
    }
  }
  CHECK(sum == volume(world, solid));
  return std::move(*halves);
}

// Cuts parts along faces at their reflex edges until none is left; the sum of the volumes of the
// pieces.
Rational cut_by_face_planes(ExactWorld& world, std::vector<Solid> open) {
  Rational sum = 0;
  for (int cuts = 0; !open.empty(); ++cuts) {
    REQUIRE(cuts < 100);
    const Solid part = open.back();
    open.pop_back();
    const std::vector<ReflexEdge> reflex = reflex_edges(world, part);
    if (reflex.empty()) {
      sum += volume(world, part);
      continue;
    }
    const Halves next = checked_split(world, part, part.faces[reflex[0].f].plane);
    open.insert(open.end(), next.below.begin(), next.below.end());
    open.insert(open.end(), next.above.begin(), next.above.end());
  }
  return sum;
}

TEST_SUITE("tools.split") {
  TEST_CASE("split: a cube in two prisms with six faces and eight corners each") {
    FlatBody body = test::empty_body();
    const Solid cube = test::cells(body, block(1, 1, 1), {});
    REQUIRE(cube.faces.size() == 6);
    const Halves halves = checked_split(body.world, cube, plane_of(body.world, 2, 0, 0, 1));
    REQUIRE(halves.below.size() == 1);
    REQUIRE(halves.above.size() == 1);
    CHECK(halves.below[0].faces.size() == 6);
    CHECK(vertices_of(halves.below[0]).size() == 8);
    CHECK(volume(body.world, halves.below[0]) == Rational(1) / 2);
  }

  TEST_CASE("split: planes that only touch do not cut") {
    FlatBody body = test::empty_body();
    const Solid cube = test::cells(body, block(1, 1, 1), {});
    Splitter splitter(body.world);
    CHECK_FALSE(splitter.split(cube, plane_of(body.world, 1, 0, 0, 1)));
    CHECK_FALSE(splitter.split(cube, plane_of(body.world, 1, 1, 0, 2)));
    CHECK_FALSE(splitter.split(cube, plane_of(body.world, 1, 1, 1, 3)));
    CHECK_FALSE(splitter.split(cube, plane_of(body.world, 1, 1, 1, 5)));
  }

  TEST_CASE("split: through corners and edges no vertex is new") {
    FlatBody body = test::empty_body();
    const Solid cube = test::cells(body, block(1, 1, 1), {});
    const std::size_t before = body.world.vertices.size();
    const Halves halves = checked_split(body.world, cube, plane_of(body.world, 1, -1, 0, 0));
    CHECK(body.world.vertices.size() == before);
    CHECK(halves.below[0].faces.size() == 5);
    CHECK(vertices_of(halves.below[0]).size() == 6);
  }

  TEST_CASE("split: the cap has a hole where the plane passes a cavity, and both halves lose it") {
    FlatBody body = test::empty_body();
    std::set<Cell> cells = block(3, 3, 3);
    cells.erase({1, 1, 1});
    const Solid solid = test::cells(body, cells, {});
    const std::uint32_t plane = plane_of(body.world, 0, 0, 2, 3);
    const Halves halves = checked_split(body.world, solid, plane);
    REQUIRE(halves.below.size() == 1);
    for (const ExactFace& face : halves.below[0].faces) {
      if (face.plane == plane) CHECK(trace_loops(body.world, face).size() == 2);
    }
    CHECK(halves.below[0].faces.size() == 11);
  }

  TEST_CASE("split: next to a cavity the cavity stays with its solid") {
    FlatBody body = test::empty_body();
    std::set<Cell> cells = block(5, 3, 3);
    cells.erase({1, 1, 1});
    cells.erase({3, 1, 1});
    const Solid solid = test::cells(body, cells, {});
    const Halves halves = checked_split(body.world, solid, plane_of(body.world, 2, 0, 0, 5));
    REQUIRE(halves.below.size() == 1);
    REQUIRE(halves.above.size() == 1);
    CHECK(volume(body.world, halves.below[0]) == Rational(43) / 2);
  }

  TEST_CASE("split: parts that the cut separates come out one by one") {
    FlatBody body = test::empty_body();
    // A comb: three teeth on a bar.
    std::set<Cell> cells = block(5, 1, 1);
    for (int x = 0; x < 5; x += 2) {
      for (int y = 1; y < 4; ++y) cells.insert({x, y, 0});
    }
    const Solid comb = test::cells(body, cells, {});
    CHECK(reflex_edges(body.world, comb).size() == 4);
    const Halves halves = checked_split(body.world, comb, plane_of(body.world, 0, 1, 0, 1));
    CHECK(halves.below.size() == 1);
    CHECK(halves.above.size() == 3);
    for (const Solid& part : halves.above) CHECK(reflex_edges(body.world, part).empty());
  }

  TEST_CASE("split: a face in the plane of the cut joins the cap without a seam") {
    FlatBody body = test::empty_body();
    // An L: the cut along the top of the foot extends that face under the shank.
    std::set<Cell> cells = block(3, 1, 1);
    cells.insert({0, 1, 0});
    const Solid solid = test::cells(body, cells, {});
    const Halves halves = checked_split(body.world, solid, plane_of(body.world, 0, 1, 0, 1));
    CHECK(halves.below[0].faces.size() == 6);
    CHECK(vertices_of(halves.below[0]).size() == 8);
  }

  TEST_CASE("split: a groove whose tip lies in the plane of the cut") {
    // The tip of a roof-shaped groove touches the cap from below along a line; later cuts through
    // that line must find their edges divided alike on both sides.
    FlatBody body = test::empty_body();
    ExactWorld& world = body.world;
    const Solid solid =
        test::prism(body, {{{0, 0}, {4, 0}, {6, 4}, {8, 0}, {12, 0}, {12, 8}, {0, 8}}}, 0, 10, {});
    Solid whole = solid;
    normalise(whole);
    const Halves halves = checked_split(world, whole, plane_of(world, 0, 1, 0, 4));
    REQUIRE(halves.below.size() >= 1);
    CHECK(cut_by_face_planes(world, halves.below) == Rational((12 * 4 - 8) * 10));
  }

  TEST_CASE("split: a groove that ends inside, its tip in the plane of the cut") {
    FlatBody body = test::empty_body();
    ExactWorld& world = body.world;
    // The same groove, closed at one end by solid: the tip ends in the middle of the cap.
    Solid solid =
        test::prism(body, {{{0, 0}, {4, 0}, {6, 4}, {8, 0}, {12, 0}, {12, 8}, {0, 8}}}, 0, 10, {});
    const Solid plug =
        test::prism(body, {{{0, 0}, {4, 0}, {8, 0}, {12, 0}, {12, 8}, {0, 8}}}, -6, 0, {});
    solid.faces.insert(solid.faces.end(), plug.faces.begin(), plug.faces.end());
    // The common wall z = 0: opposite faces cancel, except for the mouth of the groove, which
    // becomes its end.
    std::vector<ExactFace> kept;
    Chain wall;
    std::uint32_t wall_plane = plane_of(world, 0, 0, 1, 0);
    for (const ExactFace& face : solid.faces) {
      if (face.plane == wall_plane) {
        wall.insert(wall.end(), face.edges.begin(), face.edges.end());
      } else {
        kept.push_back(face);
      }
    }
    cancel(wall);
    REQUIRE(wall.size() == 3);
    ExactFace end;
    end.plane = wall_plane;
    end.sign = world.planes[wall_plane].n[2] > 0 ? 1 : -1;
    end.edges = wall;
    kept.push_back(end);
    solid.faces = kept;
    normalise(solid);
    drop_straight_vertices(solid);
    REQUIRE(is_closed(solid));
    REQUIRE(volume(world, solid) == Rational(12 * 8 * 16 - 16 / 2 * 10));
    const Halves first = checked_split(world, solid, plane_of(world, 0, 1, 0, 4));
    std::vector<Solid> open = first.below;
    open.insert(open.end(), first.above.begin(), first.above.end());
    CHECK(cut_by_face_planes(world, open) == volume(world, solid));
  }

  TEST_CASE("components: solids on a common edge or corner are two") {
    for (const Cell& other : {Cell{1, 1, 0}, Cell{1, 1, 1}}) {
      FlatBody body = test::empty_body();
      const Solid solid = test::cells(body, {{0, 0, 0}, other}, {});
      const std::vector<Solid> parts = components(body.world, solid);
      REQUIRE(parts.size() == 2);
      for (const Solid& part : parts) {
        CHECK(part.faces.size() == 6);
        CHECK(volume(body.world, part) == 1);
      }
    }
  }

  TEST_CASE("components: a solid inside a cavity, its cavity inside it") {
    FlatBody body = test::empty_body();
    std::set<Cell> cells = block(9, 9, 9);
    for (int x = 1; x < 8; ++x) {
      for (int y = 1; y < 8; ++y) {
        for (int z = 1; z < 8; ++z) cells.erase({x, y, z});
      }
    }
    for (int x = 3; x < 6; ++x) {
      for (int y = 3; y < 6; ++y) {
        for (int z = 3; z < 6; ++z) cells.insert({x, y, z});
      }
    }
    cells.erase({4, 4, 4});
    const std::vector<Solid> parts = components(body.world, test::cells(body, cells, {}));
    REQUIRE(parts.size() == 2);
    CHECK(volume(body.world, parts[0]) + volume(body.world, parts[1]) == 729 - 343 + 26);
    CHECK(parts[0].faces.size() == 12);
    CHECK(parts[1].faces.size() == 12);
  }

  TEST_CASE("components: an open boundary is refused") {
    FlatBody body = test::empty_body();
    Solid cube = test::cells(body, block(1, 1, 1), {});
    cube.faces.pop_back();
    CHECK_THROWS_AS(components(body.world, cube), BrokenChain);
  }

  TEST_CASE("measure: agrees with the exact volume and with the centre by symmetry") {
    FlatBody body = test::empty_body();
    const Solid solid = test::cells(body, block(2, 3, 4), {});
    const Measure m = measure(body.world, solid);
    CHECK(to_double(m.volume) == 24.0);
    CHECK(to_double(m.first_moment[0]) == 24.0);
    CHECK(to_double(m.first_moment[1]) == 36.0);
    CHECK(to_double(m.first_moment[2]) == 48.0);
    CHECK(volume(body.world, solid) == 24);
    CHECK(thickness(body.world, solid) == 2.0);
  }
}

}  // namespace
}  // namespace haptic::tools
