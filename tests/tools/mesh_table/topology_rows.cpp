// SPDX-License-Identifier: Apache-2.0
/// Which faces meet: open, turned, one-sided, touching, nested, doubled; each in every format.
#include <algorithm>

#include "tests/tools/mesh_table/awkward_solids.hpp"

namespace haptic::tools::test {
namespace {

constexpr const char* kCloseMend = "close the hole in the CAD program";
constexpr const char* kSeparateMend = "separate the solids that touch there";

MeshBuilder cube() { return box_mesh({0, 0, 0}, {1, 1, 1}); }

MeshBuilder two_boxes(const Point3& low, const Point3& high, const Point3& other_low,
                      const Point3& other_high, bool other_outward = true) {
  MeshBuilder mesh = box_mesh(low, high);
  mesh.box(other_low, other_high, other_outward);
  return mesh;
}

void reverse(std::vector<std::uint32_t>& loop) { std::reverse(loop.begin(), loop.end()); }

void add_turned(FormRows& t) {
  t.good("cube", cube(), 1, 1, 1.0, 8);
  t.good("inside-out", box_mesh({0, 0, 0}, {1, 1, 1}, false), 1, 1, 1.0, 8);
  MeshBuilder one = cube();
  reverse(one.faces[3]);
  t.good("one face flipped", one, 1, 1, 1.0, 8);
  MeshBuilder half = cube();
  for (std::size_t f = 0; f < 6; f += 2) {
    reverse(half.faces[f]);
  }
  t.good("every second face flipped", half, 1, 1, 1.0, 8);
  t.good("a ring of quads", square_ring(), 1, 4, 8.0, 16);
}

void add_open(FormRows& t) {
  MeshBuilder open = cube();
  open.faces.erase(open.faces.begin() + 1);
  t.bad("one face missing", open, Stage::kClean, "longest hole at (0.5, 0.5, 1) m (4 edges",
        kCloseMend);
  MeshBuilder flap = cube();
  flap.face({6, 7, flap.vertex({0.5, 1, 2})});
  t.bad("a flap on a cube", flap, Stage::kClean, "longest hole at (0.5, 1, 1.5) m (2 edges",
        kCloseMend);
  MeshBuilder triangle;
  triangle.vertices = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
  triangle.face({0, 1, 2});
  // The perimeter's centre: each edge's middle weighted with its length.
  t.bad("a single triangle", triangle, Stage::kClean, "longest hole at (1, 1.5, 0) m (3 edges",
        kCloseMend);
  t.bad("Moebius strip", moebius_strip(12), Stage::kClean, "open: 24 edges without a partner",
        kCloseMend);
  t.bad("Klein bottle", klein_bottle(), Stage::kClean,
        "cannot be oriented: the surface is one-sided", "repair the mesh");
  MeshBuilder wall = cube();
  wall.face({0, 3, 7, 4});
  wall.faces[0] = {0, 2, 3};
  wall.face({0, 3, 1});
  wall.faces[1] = {4, 5, 7};
  wall.face({4, 7, 6});
  t.bad("an edge with three faces", wall, Stage::kClean, "edge with 3 faces at (", kSeparateMend);
}

void add_shells(FormRows& t) {
  t.good("two disjoint shells", two_boxes({0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}), 2, 2, 2.0,
         16);
  t.good("disjoint, one inside-out", two_boxes({0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}, false),
         2, 2, 2.0, 16);
  t.good("a void", two_boxes({0, 0, 0}, {3, 3, 3}, {1, 1, 1}, {2, 2, 2}, false), 1, 6, 26.0, 16);
  t.good("a nested shell the same way round", two_boxes({0, 0, 0}, {3, 3, 3}, {1, 1, 1}, {2, 2, 2}),
         2, 2, 28.0, 16);
  t.each_last([](Row& row) { row.with_warning("lies inside another solid"); });
  MeshBuilder island = two_boxes({0, 0, 0}, {5, 5, 5}, {1, 1, 1}, {4, 4, 4}, false);
  island.box({2, 2, 2}, {3, 3, 3});
  t.good("an island in a void", island, 2, 7, 125.0 - 27.0 + 1.0, 24);
  t.good("overlapping solids", two_boxes({0, 0, 0}, {2, 2, 2}, {1, 1, 1}, {3, 3, 3}), 2, 2, 16.0,
         16);
  t.each_last([](Row& row) { row.with_warning("overlap"); });
  t.good("an inside-out shell that sticks out of another",
         two_boxes({0, 0, 0}, {2, 2, 2}, {1, 1, 1}, {3, 3, 3}, false), 2, 2, 16.0, 16);
  t.each_last([](Row& row) { row.with_warning("overlap"); });
  // Groups keep the two apart, so that the second is no duplicate face by face.
  MeshBuilder twice = box_mesh({0, 0, 0}, {1, 1, 1});
  twice.group = 1;
  twice.box({0, 0, 0}, {1, 1, 1});
  t.good("a solid twice, in two groups", twice, 2, 2, 2.0, 8);
  t.each_last([](Row& row) { row.with_warning("overlap"); });
  // OFF and binary STL have no groups, but OFF keeps apart what shares no vertex.
  t.last(Written::kStlBinary) =
      accepted("a solid twice, binary stl", "m.stl", stl_binary(twice), 1, 1, 1.0, 8);
  MeshBuilder void_twice = two_boxes({0, 0, 0}, {3, 3, 3}, {1, 1, 1}, {2, 2, 2}, false);
  void_twice.group = 1;
  void_twice.box({1, 1, 1}, {2, 2, 2}, false);
  t.bad("a void twice, in two groups", void_twice, Stage::kDecompose, "solid 1 of 1 near (1.5, ",
        "must be repaired");
  t.last(Written::kStlBinary) =
      accepted("a void twice, binary stl", "m.stl", stl_binary(void_twice), 1, 6, 26.0, 16);
  MeshBuilder crossing = two_boxes({0, 0, 0}, {5, 5, 5}, {1, 1, 1}, {3, 3, 3}, false);
  crossing.box({2, 2, 2}, {4, 4, 4}, false);
  t.bad("two voids that overlap", crossing, Stage::kDecompose, "solid 1 of 1 near (", "repair");
}

void add_touching(FormRows& t) {
  t.good("touching at a vertex", two_boxes({0, 0, 0}, {1, 1, 1}, {1, 1, 1}, {2, 2, 2}), 2, 2, 2.0,
         15);
  t.good("touching along an edge", two_boxes({0, 0, 0}, {1, 1, 1}, {1, 1, 0}, {2, 2, 1}), 2, 2, 2.0,
         14);
  // STL keeps no solids apart: the common wall goes, and with it the four corners in straight
  // edges.
  t.good("touching on a whole face", two_boxes({0, 0, 0}, {1, 1, 1}, {1, 0, 0}, {2, 1, 1}), 2, 2,
         2.0, 12);
  for (const Written form : {Written::kStlText, Written::kStlBinary}) {
    Row& row = t.last(form);
    row.solids = row.pieces = 1;
    row.vertices = 8;
  }
  t.good("touching on a part of a face", two_boxes({0, 0, 0}, {3, 3, 1}, {1, 1, 1}, {2, 2, 2}), 2,
         2, 10.0, 16);
}

void add_doubled(FormRows& t) {
  MeshBuilder twice = cube();
  twice.face(twice.faces[1]);
  t.good("one face twice", twice, 1, 1, 1.0, 8);
  MeshBuilder back = cube();
  back.face(back.faces[1]);
  reverse(back.faces[6]);
  // As triangles the second square has the other diagonal: no duplicate, but a wall of its own.
  t.good("one face twice, from both sides", back, 1, 1, 1.0, 8);
  for (const Written form : {Written::kStlText, Written::kStlBinary}) {
    Row& row = t.last(form);
    row = refused(row.name, row.file, row.bytes, Stage::kClean, "edge with 3 faces at (",
                  kSeparateMend);
  }
  std::rotate(back.faces[6].begin(), back.faces[6].end() - 1, back.faces[6].end());
  t.good("one face twice, from both sides, cut alike", back, 1, 1, 1.0, 8);
  MeshBuilder all = cube();
  for (std::size_t f = 0; f < 6; ++f) {
    all.face(all.faces[f]);
  }
  t.good("all faces twice", all, 1, 1, 1.0, 8);

  MeshBuilder split = box_mesh({0, 0, 0}, {2, 1, 1});
  const std::uint32_t a = split.vertex({1, 0, 1});
  const std::uint32_t b = split.vertex({1, 1, 1});
  split.faces[1] = {4, a, b, 6};
  split.face({a, 5, 7, b});
  t.good("T-junctions", split, 1, 1, 2.0, 8);
  split.faces[2] = {0, 1, 5, a, 4};
  split.faces[3] = {2, 6, b, 7, 3};
  t.good("n-gons with a vertex in a straight edge", split, 1, 1, 2.0, 8);

  MeshBuilder degenerate = cube();
  degenerate.face({0, 1, 1});
  degenerate.face({6, degenerate.vertex({0.5, 1, 1}), 7});
  t.good("degenerate triangles", degenerate, 1, 1, 1.0, 8);
}

}  // namespace

std::vector<Row> topology_rows() {
  FormRows t;
  add_turned(t);
  add_open(t);
  add_shells(t);
  add_touching(t);
  add_doubled(t);
  return t.rows;
}

}  // namespace haptic::tools::test
