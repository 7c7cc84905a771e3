// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {
namespace {

MeshBuilder unit_box() {
  MeshBuilder mesh;
  mesh.box({0, 0, 0}, {1, 2, 3});
  return mesh;
}

/// Largest distance of a surface vertex from its vertex in the file, in units of the last place of
/// the largest coordinate.
double largest_ulps(const RawMesh& raw, const Surface& surface) {
  double largest = 0.0;
  double off = 0.0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double file = raw.vertices[surface.source_vertex[v]][i];
      largest = std::max(largest, std::abs(file));
      off = std::max(off, std::abs(surface.vertices[v][i] + surface.centre_m[i] - file));
    }
  }
  return off / (std::nextafter(largest, 2 * largest) - largest);
}

}  // namespace

TEST_SUITE("tools.mesh_cleaning") {
  TEST_CASE("a clean mesh keeps its polygons and its vertices, near and far from the origin") {
    for (const double offset : {0.0, 0.3, 7.7, 1.0e4, -1.0e4}) {
      CAPTURE(offset);
      std::mt19937 random(3);
      MeshBuilder mesh;
      mesh.box({0.01, -0.02, 0.0}, {0.06, 0.03, 0.04});
      for (Point3& p : mesh.vertices) {
        for (double& x : p) {
          x += offset + 1.0e-4 * static_cast<double>(random() % 1000) / 1000.0;
        }
      }
      const RawMesh raw = mesh.raw();
      const Surface surface = clean(raw);
      CHECK(violation(surface) == "");
      CHECK(surface.vertices.size() == 8);
      CHECK(surface.faces.size() == 6);
      CHECK(surface.solid_count == 1);
      CHECK(largest_ulps(raw, surface) <= 4.0);
      CHECK(surface.warnings.empty());
    }
  }

  TEST_CASE("tolerance: size, printed digits, coarse digits, binary files, the caller's own") {
    CHECK(plane_tolerance(2.0, 0.0) == doctest::Approx(1.0e-5));
    CHECK(plane_tolerance(0.05, 1.0e-6) == doctest::Approx(1.5e-6));
    CHECK(plane_tolerance(1.0, 1.0) == doctest::Approx(5.0e-6));
    RawMesh raw = unit_box().raw();
    raw.print_resolution = 1.0e-4;
    CHECK(clean(raw).plane_tolerance_m == doctest::Approx(1.5e-4));
    raw.print_resolution = 1.0;
    CHECK(clean(raw).plane_tolerance_m == doctest::Approx(5.0e-6 * std::sqrt(14.0)));
    raw.print_resolution = 0.1;
    CHECK(clean(raw).warnings.empty());  // no plane is another for it
    raw.places_are_lines = false;
    for (Point3& p : raw.vertices) {
      p[0] += 1000.0;  // single precision steps of 6e-5 m there
    }
    CHECK(clean(raw).plane_tolerance_m == doctest::Approx(1.5 * 1001.0 / 8388608.0));
    CHECK(clean_surface(raw, {.plane_tolerance_m = 1.0e-3}).plane_tolerance_m == 1.0e-3);
  }

  TEST_CASE("scale: metres per unit, along each axis") {
    const Surface surface = clean_surface(unit_box().raw(), {.scale_to_m = {0.001, 0.002, 0.01}});
    CHECK(volume(surface) == doctest::Approx(6.0 * 2.0e-8));
    CHECK(surface.diagonal_m == doctest::Approx(std::sqrt(1e-6 + 16e-6 + 9e-4)));
  }

  TEST_CASE("weld: jittered duplicates of every corner, movement within half a tolerance") {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      CAPTURE(seed);
      std::mt19937 random(seed);
      MeshBuilder mesh = unit_box();
      mesh.unshare();
      for (Point3& p : mesh.vertices) {
        for (double& x : p) {
          x += 4.0e-6 * (static_cast<double>(random() % 1000) / 1000.0 - 0.5);
        }
      }
      const Surface surface = clean(mesh.raw());
      CHECK(violation(surface) == "");
      CHECK(surface.vertices.size() == 8);
      CHECK(step_count(surface, "weld") == 16);
      for (const CleaningStep& step : surface.steps) {
        CHECK(step.largest_move_m <= 0.5 * surface.plane_tolerance_m);
      }
      CHECK(clean(mesh.raw(false)).vertices.size() == 8);
    }
  }

  TEST_CASE("degenerate and duplicate faces go, the holes of degenerate ones are stitched") {
    MeshBuilder mesh = unit_box();
    // A needle along the edge 0-1: its middle corner 8 belongs to the lower face, the front face
    // spans it.
    const std::uint32_t middle = mesh.vertex({0.5, 0, 0});
    mesh.faces[0] = {0, 2, 3, 1, middle};
    mesh.face({middle, 1, 0});
    mesh.face(mesh.faces[3]);
    mesh.face({1, 1, 1});
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.faces.size() == 6);
    CHECK(step_count(surface, "degenerate faces") == 2);
    CHECK(step_count(surface, "duplicate faces") == 1);
    CHECK(step_count(surface, "T-junctions") == 1);
    CHECK(volume(surface) == doctest::Approx(6.0));
  }

  TEST_CASE("a mesh given from both sides keeps one side") {
    MeshBuilder mesh = unit_box();
    const std::size_t count = mesh.faces.size();
    for (std::size_t f = 0; f < count; ++f) {
      std::vector<std::uint32_t> loop = mesh.faces[f];
      std::reverse(loop.begin(), loop.end());
      mesh.face(loop);
    }
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.faces.size() == 6);
    CHECK(volume(surface) == doctest::Approx(6.0));
  }

  TEST_CASE("cubes wall to wall: one solid without groups, two where the file keeps them apart") {
    MeshBuilder mesh;
    mesh.box({0, 0, 0}, {1, 1, 1});
    mesh.group = 1;
    mesh.box({1, 0, 0}, {2, 1, 1});
    const Surface apart = clean(mesh.raw());
    CHECK(apart.solid_count == 2);
    CHECK(volume(apart) == doctest::Approx(2.0));
    mesh.unshare();
    CHECK(clean(mesh.raw(false)).solid_count == 2);
    std::fill(mesh.groups.begin(), mesh.groups.end(), 0U);
    const Surface united = clean(mesh.raw(false));
    CHECK(violation(united) == "");
    CHECK(united.solid_count == 1);
    CHECK(united.faces.size() == 10);
    CHECK(step_count(united, "inner walls") == 2);
    CHECK(volume(united) == doctest::Approx(2.0));
  }

  TEST_CASE("T-junctions: subdivided edges meet whole ones") {
    MeshBuilder mesh = unit_box();
    const std::uint32_t a = mesh.vertex({1.0 / 3.0, 0, 1.0e-6});
    const std::uint32_t b = mesh.vertex({2.0 / 3.0, 0, 0});
    mesh.faces[0] = {0, 2, 3, 1, b, a};
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(step_count(surface, "T-junctions") == 2);
    CHECK(surface.vertices.size() == 10);
    CHECK(surface.faces.size() == 6);
  }

  TEST_CASE("T-junctions on both sides of an edge") {
    MeshBuilder mesh = unit_box();
    const std::uint32_t a = mesh.vertex({0.25, 0, 0});
    const std::uint32_t b = mesh.vertex({0.75, 0, 0});
    mesh.faces[0] = {0, 2, 3, 1, b};
    mesh.faces[2] = {0, a, 1, 5, 4};
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(step_count(surface, "T-junctions") == 2);
  }

  TEST_CASE("orientation: one face flipped, and inside out") {
    MeshBuilder mesh = unit_box();
    std::reverse(mesh.faces[4].begin(), mesh.faces[4].end());
    Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(step_count(surface, "turned faces") == 1);
    CHECK(step_count(surface, "inside-out shells") == 0);
    MeshBuilder inverted;
    inverted.box({0, 0, 0}, {1, 2, 3}, false);
    surface = clean(inverted.raw());
    CHECK(violation(surface) == "");
    CHECK(step_count(surface, "turned faces") == 6);
    CHECK(step_count(surface, "inside-out shells") == 1);
    CHECK(volume(surface) == doctest::Approx(6.0));
  }

  TEST_CASE("nesting: cavity, island in the cavity, and their parents in any order") {
    for (const bool whole_part_inverted : {false, true}) {
      MeshBuilder mesh;
      mesh.box({4, 4, 4}, {5, 5, 5}, !whole_part_inverted);
      mesh.box({3, 3, 3}, {6, 6, 6}, whole_part_inverted);
      mesh.box({0, 0, 0}, {9, 9, 9}, !whole_part_inverted);
      const Surface surface = clean(mesh.raw());
      CHECK(violation(surface) == "");
      REQUIRE(surface.shells.size() == 3);
      CHECK(surface.solid_count == 2);
      CHECK(surface.shells[1].is_void);
      CHECK(surface.shells[1].parent == 2);
      CHECK_FALSE(surface.shells[0].is_void);
      CHECK(volume(surface) == doctest::Approx(729.0 - 27.0 + 1.0));
      CHECK(surface.warnings.empty());
    }
  }

  TEST_CASE(
      "nesting: a shell that is not inverted inside another one overlaps it, with a warning") {
    MeshBuilder mesh;
    mesh.box({0, 0, 0}, {9, 9, 9});
    mesh.box({3, 3, 3}, {6, 6, 6});
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    REQUIRE(surface.shells.size() == 2);
    CHECK(surface.solid_count == 2);
    CHECK_FALSE(surface.shells[1].is_void);
    CHECK(surface.warnings.size() == 1);
  }

  TEST_CASE("a cavity whose corners lie on the outer surface") {
    MeshBuilder mesh;
    mesh.box({0, 0, 0}, {2, 2, 2});
    const std::uint32_t first = mesh.vertex({1, 1, 0});
    for (const Point3& p :
         {Point3{1, 1, 2}, Point3{0, 1, 1}, Point3{1, 0, 1}, Point3{2, 1, 1}, Point3{1, 2, 1}}) {
      mesh.vertex(p);
    }
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t a = first + 2 + k;
      const std::uint32_t b = first + 2 + (k + 1) % 4;
      mesh.face({first, a, b});
      mesh.face({first + 1, b, a});
    }
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.solid_count == 1);
    CHECK(volume(surface) == doctest::Approx(8.0 - 4.0 / 3.0));
  }

  TEST_CASE("disjoint and overlapping shells are separate solids") {
    MeshBuilder mesh;
    mesh.box({0, 0, 0}, {1, 1, 1});
    mesh.box({3, 0, 0}, {4, 1, 1});
    CHECK(clean(mesh.raw()).solid_count == 2);
    // These share half of an edge and part of a face with the first: welded, they could not be
    // distinguished.
    mesh.box({0, 0, 0}, {0.5, 2, 1});
    mesh.box({0.5, 0.5, 0.5}, {3.5, 0.75, 0.75});
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.solid_count == 4);
    CHECK(volume(surface) == doctest::Approx(1.0 + 1.0 + 1.0 + 3.0 / 16.0));
  }

  TEST_CASE(
      "solids touching on an edge or in a corner are split, with and without shared indices") {
    for (const bool corner : {false, true}) {
      for (const bool unshared : {false, true}) {
        CAPTURE(corner);
        CAPTURE(unshared);
        MeshBuilder mesh;
        mesh.box({0, 0, 0}, {1, 1, 1});
        mesh.box({1, 1, corner ? 1.0 : 0.0}, {2, 2, corner ? 2.0 : 1.0});
        // Same indices at the common places, so that nothing but geometry separates the cubes.
        for (std::vector<std::uint32_t>& loop : mesh.faces) {
          for (std::uint32_t& v : loop) {
            v = corner ? (v == 8 ? 7 : v) : (v == 8 ? 3 : v == 12 ? 7 : v);
          }
        }
        std::reverse(mesh.faces[7].begin(), mesh.faces[7].end());
        if (unshared) {
          mesh.unshare();
        }
        const Surface surface = clean(mesh.raw(!unshared));
        CHECK(violation(surface) == "");
        CHECK(surface.solid_count == 2);
        CHECK(surface.vertices.size() == 16);
        CHECK(volume(surface) == doctest::Approx(2.0));
        CHECK(step_count(surface, "touching edges") == (corner ? 0 : 1));
        CHECK(step_count(surface, "touching corners") == (corner ? 1 : 2));
      }
    }
  }

  TEST_CASE("a solid that touches itself along an edge") {
    // Two cubes on an edge, both standing on one slab: the edge ends in the slab's top.
    MeshBuilder mesh = unit_box();
    mesh = MeshBuilder{};
    const auto square = [&](const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
      const std::uint32_t first = mesh.vertex(a);
      mesh.vertex(b);
      mesh.vertex(c);
      mesh.vertex(d);
      mesh.face({first, first + 1, first + 2, first + 3});
    };
    for (const double s : {0.0, 1.0}) {
      const double t = s + 1.0;
      square({s, s, 2}, {t, s, 2}, {t, t, 2}, {s, t, 2});
      square({s, s, 1}, {t, s, 1}, {t, s, 2}, {s, s, 2});
      square({t, s, 1}, {t, t, 1}, {t, t, 2}, {t, s, 2});
      square({t, t, 1}, {s, t, 1}, {s, t, 2}, {t, t, 2});
      square({s, t, 1}, {s, s, 1}, {s, s, 2}, {s, t, 2});
    }
    square({1, 0, 1}, {2, 0, 1}, {2, 1, 1}, {1, 1, 1});
    square({0, 1, 1}, {1, 1, 1}, {1, 2, 1}, {0, 2, 1});
    square({0, 0, 0}, {0, 2, 0}, {2, 2, 0}, {2, 0, 0});
    square({0, 0, 0}, {2, 0, 0}, {2, 0, 1}, {0, 0, 1});
    square({2, 0, 0}, {2, 2, 0}, {2, 2, 1}, {2, 0, 1});
    square({2, 2, 0}, {0, 2, 0}, {0, 2, 1}, {2, 2, 1});
    square({0, 2, 0}, {0, 0, 0}, {0, 0, 1}, {0, 2, 1});
    const Surface surface = clean(mesh.raw(false));
    CHECK(violation(surface) == "");
    CHECK(surface.solid_count == 1);
    CHECK(volume(surface) == doctest::Approx(6.0));
    CHECK(step_count(surface, "touching edges") == 1);
  }

  TEST_CASE("one shell cut into groups is one part") {
    MeshBuilder mesh = unit_box();
    mesh.unshare();
    for (std::uint32_t f = 0; f < 6; ++f) {
      mesh.groups[f] = f;
    }
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.vertices.size() == 8);
  }

  TEST_CASE("a polygon that touches itself in a point is split") {
    // Prism over two triangles that meet in a point, its caps given as one loop each.
    MeshBuilder mesh;
    for (const double z : {0.0, 1.0}) {
      for (const Point3& p : {Point3{0, 0, z}, Point3{1, 1, z}, Point3{-1, 1, z}, Point3{-1, -1, z},
                              Point3{1, -1, z}}) {
        mesh.vertex(p);
      }
    }
    mesh.face({5, 6, 7, 5, 8, 9});
    mesh.face({0, 2, 1, 0, 4, 3});
    const std::uint32_t around[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {3, 4}, {4, 0}};
    for (const auto& [a, b] : around) {
      mesh.face({a, b, b + 5, a + 5});
    }
    const Surface surface = clean(mesh.raw());
    CHECK(violation(surface) == "");
    CHECK(surface.solid_count == 2);
    CHECK(step_count(surface, "touching loops") == 2);
    CHECK(volume(surface) == doctest::Approx(2.0));
  }

  TEST_CASE("vertices that no face uses count for nothing") {
    MeshBuilder mesh = unit_box();
    mesh.vertex({1.0e9, 0, 0});
    const Surface surface = clean(mesh.raw());
    CHECK(surface.vertices.size() == 8);
    CHECK(surface.diagonal_m == doctest::Approx(std::sqrt(14.0)));
  }
}

}  // namespace haptic::tools::test
