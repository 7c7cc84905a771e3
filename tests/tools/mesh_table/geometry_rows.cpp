// SPDX-License-Identifier: Apache-2.0
/// Where the vertices are: bent, crossing, thin, tiny, huge, far away, jittered; each in every
/// format that can hold it.
#include <cmath>

#include "tests/tools/mesh_table/awkward_solids.hpp"

namespace haptic::tools::test {
namespace {

constexpr const char* kThinMend = "give --plane-tolerance below a tenth of the thickness";
constexpr const char* kSplitMend = "split the face into triangles";

/// Rows for the two formats that hold n-gons.
void good_as_ngons(FormRows& t, const std::string& name, const MeshBuilder& mesh,
                   std::size_t pieces, double volume_m3, std::size_t vertices) {
  t.rows.push_back(
      accepted(name + ", obj", "m.obj", obj_text(mesh), 1, pieces, volume_m3, vertices));
  t.rows.push_back(
      accepted(name + ", off", "m.off", off_text(mesh), 1, pieces, volume_m3, vertices));
}
void bad_as_ngons(FormRows& t, const std::string& name, const MeshBuilder& mesh, Stage stage,
                  const std::string& place, const std::string& fix) {
  t.rows.push_back(refused(name + ", obj", "m.obj", obj_text(mesh), stage, place, fix));
  t.rows.push_back(refused(name + ", off", "m.off", off_text(mesh), stage, place, fix));
}

/// What a binary STL keeps of a coordinate.
double as_float(double x) { return static_cast<double>(static_cast<float>(x)); }

void add_ngons(FormRows& t) {
  const std::vector<Point3> ell = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0},
                                   {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  good_as_ngons(t, "concave n-gons", prism_mesh(ell, 1.0, false), 2, 3.0, 12);
  const std::vector<Point3> comb = {{0, 0, 0}, {5, 0, 0}, {5, 2, 0}, {4, 2, 0},
                                    {4, 1, 0}, {3, 1, 0}, {3, 2, 0}, {2, 2, 0},
                                    {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
  good_as_ngons(t, "n-gons with two notches", prism_mesh(comb, 1.0, false), 4, 8.0, 24);
  MeshBuilder bow = box_mesh({0, 0, 0}, {1, 1, 1});
  std::swap(bow.faces[2][0], bow.faces[2][1]);
  bad_as_ngons(t, "bow-tie quad", bow, Stage::kClean, "face 3 (line ", kSplitMend);
  bad_as_ngons(t, "pentagram prism of n-gons", prism_mesh(star_polygon(5, 2, 1.0), 1.0, false),
               Stage::kClean, "face 6 (line ", kSplitMend);
  MeshBuilder bridged = box_mesh({0, 0, 0}, {1, 1, 1});
  const std::uint32_t h = bridged.vertex({0.3, 0.3, 1});
  bridged.vertex({0.3, 0.6, 1});
  bridged.vertex({0.6, 0.6, 1});
  bridged.faces[1] = {4, 5, 7, 6, 4, h, h + 1, h + 2, h};
  bad_as_ngons(t, "a hole bridged into an n-gon", bridged, Stage::kClean, "face 2 (line ",
               kSplitMend);
  MeshBuilder bent = box_mesh({0, 0, 0}, {1, 1, 1});
  bent.vertices[7] = {1, 1, 1.01};
  bad_as_ngons(t, "n-gons that are not flat", bent, Stage::kFlatten, "is not flat", kSplitMend);
  MeshBuilder nearly = box_mesh({0, 0, 0}, {1, 1, 1});
  nearly.vertices[7] = {1, 1, 1.000002};
  good_as_ngons(t, "n-gons bent by less than the tolerance", nearly, 1, 1.0, 8);
  for (std::size_t i = t.rows.size() - 2; i < t.rows.size(); ++i) {
    t.rows[i].moved(1e-5);
  }
}

void add_self_crossing(FormRows& t) {
  // Closed and oriented, but its core is enclosed twice.
  t.bad("pentagram prism of triangles", prism_mesh(star_polygon(5, 2, 1.0), 1.0, true),
        Stage::kDecompose, "solid 1 of 1 near (", "repair");
  // A dent that comes out at the bottom.
  MeshBuilder dent = box_mesh({0, 0, 0}, {1, 1, 1});
  const std::uint32_t apex = dent.vertex({0.5, 0.5, -1});
  dent.faces[1] = {4, 5, apex};
  dent.face({5, 7, apex});
  dent.face({7, 6, apex});
  dent.face({6, 4, apex});
  t.bad("a shell that passes through itself", dent, Stage::kDecompose, "solid 1 of 1 near (",
        "repair");
  t.bad("more than 300 reflex edges", prism_mesh(toothed_polygon(310, 1.0, 0.9), 0.2, true),
        Stage::kFlatten, "310 reflex edges, limit 300", "--simplify DISTANCE");
}

void add_thin(FormRows& t) {
  MeshBuilder sheet;
  sheet.vertices = {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}};
  sheet.face({0, 1, 2, 3});
  sheet.face({3, 2, 1, 0});
  t.bad("flat sheet of two sides", sheet, Stage::kClean, "at (2, 0, 0) m", "flat sheets are no");
  t.bad("a box without height", box_mesh({5, 0, 0}, {6, 1, 0}), Stage::kClean, "at (5, 0, 0) m",
        "flat sheets are no");
  t.bad("a box lower than the weld radius", box_mesh({5, 0, 0}, {6, 1, 1e-6}), Stage::kClean,
        "at (5, 0, 0) m", "flat sheets are no");
  t.bad("a plate thinner than the limit", box_mesh({5, 0, 0}, {6, 1, 5e-5}), Stage::kClean,
        "at (5, 0, 0) m", kThinMend);
  t.good("a thin plate that is thick enough", box_mesh({0, 0, 0}, {1, 1, 0.0009765625}), 1, 1,
         0.0009765625, 8);
  t.good("a needle", box_mesh({0, 0, 0}, {1, 0.0009765625, 0.0009765625}), 1, 1,
         0.0009765625 * 0.0009765625, 8);
  // A triangle so narrow that its normal means little, between two wide ones.
  MeshBuilder sliver = box_mesh({0, 0, 0}, {1, 1, 1});
  const std::uint32_t a = sliver.vertex({0.5, 0.5, 1});
  const std::uint32_t b = sliver.vertex({0.5, 0.50006103515625, 1});
  sliver.faces[1] = {4, 5, a};
  for (const auto& loop : {std::array{5U, 7U, b}, std::array{5U, b, a}, std::array{7U, 6U, b},
                           std::array{6U, 4U, a}, std::array{6U, a, b}}) {
    sliver.face({loop[0], loop[1], loop[2]});
  }
  t.good("sliver triangles", sliver, 1, 1, 1.0, 8);
}

void add_sizes(FormRows& t) {
  const char* const fix = "check the scale: metres per unit of the file";
  t.bad("below the smallest size", box_mesh({0, 0, 0}, {5e-7, 5e-7, 5e-7}), Stage::kClean,
        "smallest 1e-06 m", fix);
  const double tiny = 0x1p-20;
  t.good("above the smallest size", box_mesh({0, 0, 0}, {tiny, tiny, tiny}), 1, 1,
         tiny * tiny * tiny, 8);
  t.bad("above the largest size", box_mesh({0, 0, 0}, {6000, 6000, 6000}), Stage::kClean,
        "largest 1e+04 m", fix);
  t.good("below the largest size", box_mesh({0, 0, 0}, {5000, 5000, 5000}), 1, 1, 1.25e11, 8);
  const double far = 10000.0;
  const double edge = far + 0.1;
  t.good("0.1 m at 1e4 m", box_mesh({far, far, far}, {edge, edge, edge}), 1, 1,
         std::pow(edge - far, 3), 8);
  t.last(Written::kStlBinary).volume_m3 = std::pow(as_float(edge) - far, 3);
  t.good("0.125 m at 1e7 m", box_mesh({1e7, 0, 0}, {1e7 + 0.125, 0.125, 0.125}), 1, 1,
         std::pow(0.125, 3), 8);
  // Single precision has steps of 1 m there: nothing is left of the width.
  Row& lost = t.last(Written::kStlBinary);
  lost = refused(lost.name, lost.file, lost.bytes, Stage::kClean, "at (10000000, ",
                 "flat sheets are no");
}

/// Faces with vertices of their own, moved by up to `size` in each coordinate.
MeshBuilder jittered(double size) {
  MeshBuilder mesh = box_mesh({0, 0, 0}, {1, 1, 1});
  mesh.unshare();
  unsigned state = 1;
  for (Point3& p : mesh.vertices) {
    for (double& x : p) {
      state = (state * 1103515245U + 12345U) % 2147483648U;
      x += size * (static_cast<double>(state >> 16) / 16384.0 - 1.0);
    }
  }
  return mesh;
}

void add_jitter(FormRows& t) {
  // The weld radius of the unit cube is 4.3e-6 m.
  t.good("vertices jittered inside the weld radius", jittered(8e-7), 1, 1, 1.0, 8);
  t.each_last([](Row& row) { row.moved(2e-5); });
  t.bad("vertices jittered outside the weld radius", jittered(3e-4), Stage::kClean,
        "longest hole at (", "close the hole");
  MeshBuilder unshared = box_mesh({0, 0, 0}, {1, 1, 1});
  unshared.unshare();
  t.good("every face with vertices of its own", unshared, 1, 1, 1.0, 8);
}

}  // namespace

std::vector<Row> geometry_rows() {
  FormRows t;
  add_ngons(t);
  add_self_crossing(t);
  add_thin(t);
  add_sizes(t);
  add_jitter(t);
  return t.rows;
}

}  // namespace haptic::tools::test
