// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/shapes/solid_facts.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/shapes/fasteners.hpp"
#include "tools/graph_compiler/shapes/mating.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

constexpr double kPi = std::numbers::pi;

/// Area of a regular polygon by the distance of its corners.
double polygon_area(double radius, double corners) {
  return 0.5 * corners * radius * radius * std::sin(2.0 * kPi / corners);
}

double radius_of(const Point3& p) { return std::hypot(p[0], p[1]); }

struct Solid {
  Shape shape;
  long euler;
  double volume_m3;  ///< by a formula of the polyhedron
};

std::vector<Solid> flat_solids() {
  const double tube = polygon_area(0.03, 24) - polygon_area(0.01 / std::cos(kPi / 24), 24);
  return {{BoxShape{{0.01, 0.02, 0.05}}, 2, 0.01 * 0.02 * 0.05},
          {PrismShape{0.01, 0.03, 3}, 2, polygon_area(0.01, 3) * 0.03},
          {PrismShape{0.01, 0.03, 6}, 2, polygon_area(0.01, 6) * 0.03},
          {CylinderShape{0.02, 0.05, 32}, 2, polygon_area(0.02, 32) * 0.05},
          {CylinderShape{0.02, 0.05, 7}, 2, polygon_area(0.02, 7) * 0.05},
          {ConeShape{0.02, 0.05, 24}, 2, polygon_area(0.02, 24) * 0.05 / 3.0},
          {SphereShape{0.02, 4}, 2, 4.0 / 3.0 * 0.02 * 0.02 * 0.02},
          {CapsuleShape{0.02, 0.05, 4}, 2,
           4.0 / 3.0 * 0.02 * 0.02 * 0.02 + polygon_area(0.02, 4) * 0.01},
          {TubeShape{0.01, 0.03, 0.04, 24}, 0, tube * 0.04}};
}

std::string refusal_of(const Shape& shape) {
  try {
    shape_mesh(shape, "part");
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_SUITE("tools.shapes") {
  TEST_CASE("shapes without round surfaces of two kinds: closed, oriented, volume of the formula") {
    for (const Solid& solid : flat_solids()) {
      CAPTURE(shape_word(solid.shape));
      const RawMesh mesh = shape_mesh(solid.shape, "part");
      CHECK(mesh.file == "part");
      CHECK(mesh.vertex_places.size() == mesh.vertices.size());
      CHECK(closed_defect(mesh, 1e-17) == "");
      CHECK(euler_characteristic(mesh) == solid.euler);
      CHECK(volume_m3(mesh) == doctest::Approx(solid.volume_m3).epsilon(1e-12));
    }
  }

  TEST_CASE("every shape is cleaned without a change") {
    std::vector<Shape> shapes{SphereShape{0.02, 32}, CapsuleShape{0.01, 0.05, 16}};
    for (const Solid& solid : flat_solids()) shapes.push_back(solid.shape);
    for (const Shape& shape : shapes) {
      CAPTURE(shape_word(shape));
      const RawMesh mesh = shape_mesh(shape, "part");
      const Surface surface = clean(mesh);
      CHECK(violation(surface) == "");
      CHECK(surface.vertices.size() == mesh.vertices.size());
      CHECK(surface.faces.size() == mesh.faces.size());
      CHECK(surface.solid_count == 1);
      CHECK(surface.warnings.empty());
    }
  }

  TEST_CASE("sphere and capsule: corners on the surface, convex, volume to second order") {
    double error_before = 0.0;
    for (const std::uint32_t segments : {16U, 32U, 64U}) {
      const RawMesh mesh = shape_mesh(SphereShape{0.5, segments}, "part");
      CHECK(closed_defect(mesh, 1e-15) == "");
      CHECK(euler_characteristic(mesh) == 2);
      CHECK(mesh.faces.size() == std::size_t{segments} * segments / 2);
      for (const Point3& p : mesh.vertices) CHECK(vec::norm(p) == doctest::Approx(0.5));
      double farthest = 0.0, out = 0.0;
      for (const RawFace& face : mesh.faces) {
        const Point3 n = vec::unit(vec::twice_area(mesh.vertices, face.vertices));
        const double plane = vec::dot(n, mesh.vertices[face.vertices[0]]);
        farthest = std::max(farthest, 0.5 - plane);
        for (const Point3& p : mesh.vertices) out = std::max(out, vec::dot(n, p) - plane);
      }
      CHECK(farthest == doctest::Approx(chord_error_m(SphereShape{0.5, segments})).epsilon(1e-9));
      CHECK(out < 1e-15);
      const double error = 4.0 / 3.0 * kPi * 0.125 - volume_m3(mesh);
      CHECK(error > 0.0);
      if (error_before > 0.0) CHECK(error_before / error == doctest::Approx(4.0).epsilon(0.06));
      error_before = error;
    }
    const RawMesh capsule = shape_mesh(CapsuleShape{0.01, 0.05, 16}, "part");
    CHECK(closed_defect(capsule, 1e-17) == "");
    CHECK(euler_characteristic(capsule) == 2);
    CHECK(volume_m3(capsule) == doctest::Approx(volume_m3(shape_mesh(SphereShape{0.01, 16}, "")) +
                                                polygon_area(0.01, 16) * 0.03));
    double top = 0.0;
    for (const Point3& p : capsule.vertices) top = std::max(top, p[2]);
    CHECK(top == 0.025);
  }

  TEST_CASE("mirror images have the same bits where the count allows") {
    for (const Shape& shape :
         {Shape{CylinderShape{0.02, 0.05, 32}}, Shape{SphereShape{0.3, 28}},
          Shape{CapsuleShape{0.01, 0.07, 12}}, Shape{TubeShape{0.1, 0.3, 0.2, 40}},
          Shape{BoxShape{{0.1, 0.3, 0.7}}}}) {
      CAPTURE(shape_word(shape));
      const RawMesh mesh = shape_mesh(shape, "part");
      CHECK(is_symmetric(mesh, {-1, 1, 1}));
      CHECK(is_symmetric(mesh, {1, -1, 1}));
      CHECK(is_symmetric(mesh, {1, 1, -1}));
    }
    const RawMesh odd = shape_mesh(CylinderShape{0.02, 0.05, 7}, "part");
    CHECK_FALSE(is_symmetric(odd, {-1, 1, 1}));
    CHECK(is_symmetric(odd, {1, -1, 1}));
    CHECK(shape_mesh(CylinderShape{1.0, 1.0, 8}, "").vertices[1][0] ==
          shape_mesh(CylinderShape{1.0, 1.0, 8}, "").vertices[1][1]);
  }

  TEST_CASE("facets lie in the part's own material: outside by corners, holes by facet middles") {
    const TubeShape tube{0.01, 0.03, 0.04, 24};
    const RawMesh mesh = shape_mesh(tube, "part");
    double nearest_hole = 1.0, farthest = 0.0;
    for (const RawFace& face : mesh.faces) {
      const Point3 n = vec::unit(vec::twice_area(mesh.vertices, face.vertices));
      const double plane = vec::dot(n, mesh.vertices[face.vertices[0]]);
      if (std::abs(n[2]) > 0.5) continue;
      if (plane < 0.0) nearest_hole = std::min(nearest_hole, -plane);
    }
    for (const Point3& p : mesh.vertices) farthest = std::max(farthest, radius_of(p));
    CHECK(nearest_hole == doctest::Approx(0.01).epsilon(1e-14));
    CHECK(farthest == doctest::Approx(0.03).epsilon(1e-14));
    CHECK(chord_error_m(tube) == doctest::Approx(std::max(0.03 * (1 - std::cos(kPi / 24)),
                                                          0.01 / std::cos(kPi / 24) - 0.01)));
    CHECK(chord_error_m(CylinderShape{0.01, 1.0, 60}) ==
          doctest::Approx(0.01 * (1 - std::cos(kPi / 60))));
    CHECK(chord_error_m(ConeShape{0.03, 0.04, 12}) ==
          doctest::Approx(0.03 * (1 - std::cos(kPi / 12)) * 0.8));
    CHECK(chord_error_m(SphereShape{3.0, 4}) == doctest::Approx(3.0 - std::sqrt(3.0)));
    CHECK(chord_error_m(BoxShape{{1, 1, 1}}) == 0.0);
    CHECK(segments_of(PrismShape{1, 1, 5}) == 0);
    CHECK(segments_of(tube) == 24);
  }

  TEST_CASE("dimensions that make no solid are refused with their key") {
    const std::pair<Shape, const char*> defects[] = {
        {BoxShape{{1, 0, 1}}, "size_m is 0"},
        {PrismShape{1, 1, 2}, "sides is 2"},
        {CylinderShape{-1, 1, 8}, "radius_m is -1"},
        {CylinderShape{1, NAN, 8}, "height_m is nan"},
        {CylinderShape{1, 1, 100000}, "segments is 100000"},
        {ConeShape{1, 1, 2}, "segments is 2"},
        {SphereShape{1, 30}, "segments is 30; give a multiple of 4"},
        {CapsuleShape{1, 2, 16}, "height_m is the height of the whole capsule"},
        {TubeShape{0.98, 1, 1, 8}, "inner_radius_m leaves no wall"},
        {TubeShape{1, 0.5, 1, 8}, "inner_radius_m leaves no wall"},
        {ThreadShape{0.008, 0.00125, 0.5}, "turns makes 0.5 turns"},
        {ThreadShape{0.008, 0.00125, NAN}, "turns makes nan turns"},
        {ThreadShape{0.008, 0.01, 4}, "pitch_m leaves no core"},
        {ThreadShape{0.008, 0.00125, 4, false, 0, 0.001}, "clearance_m is 0.001"},
        {ThreadShape{0.008, 0.00125, 4, true, 0.004}, "outer_radius_m leaves no wall"},
        {ThreadShape{0.008, 0.00125, 4, false, 0, 0, 7}, "segments is 7"},
        {NutShape{0.008, 0.00125, 0.008, 0.006}, "width_across_flats_m leaves no wall"},
        {BoltShape{0.008, 0.00125, 0.013, 0.005, 1.0}, "length_m makes 800 turns"}};
    for (const auto& [shape, says] : defects) {
      const std::string text = refusal_of(shape);
      CAPTURE(text);
      CHECK(text.starts_with("part: "));
      CHECK(contains(text, says));
      CHECK(contains(text, "; "));
    }
    CHECK(refusal_of(CylinderShape{1, 1, 3}).empty());
  }

  TEST_CASE("allowances of ISO 965-1") {
    CHECK(fit_clearance_m("6g", false, 1.25e-3).value() == doctest::Approx(14.375e-6));
    CHECK(fit_clearance_m("6g", false, 1e-3).value() == doctest::Approx(13e-6));
    CHECK(fit_clearance_m("6f", false, 1e-3).value() == doctest::Approx(20.5e-6));
    CHECK(fit_clearance_m("8e", false, 1e-3).value() == doctest::Approx(30.5e-6));
    CHECK(fit_clearance_m("6H", true, 1e-3).value() == 0.0);
    CHECK(fit_clearance_m("6G", true, 1e-3).value() == doctest::Approx(13e-6));
    CHECK(fit_clearance_m("6H/6g", false, 1e-3).value() == doctest::Approx(13e-6));
    CHECK(fit_clearance_m("6g/6H", true, 1e-3).value() == 0.0);
    for (const char* text :
         {"", "6", "g", "6x", "6H", "2g", "6g/", "/6g", "6g/6h", "6gg", "6H/6H"}) {
      CAPTURE(text);
      CHECK_FALSE(fit_clearance_m(text, false, 1e-3).has_value());
    }
    CHECK_FALSE(fit_clearance_m("6g", true, 1e-3).has_value());
    CHECK(fastener_size("M8")->pitch_m == 1.25e-3);
    CHECK(fastener_size("M7") == nullptr);
    CHECK(fastener_sizes().size() == 11);
  }

  TEST_CASE("parts that fit are warned of when their facets are coarser than the clearance") {
    const auto warnings = [](const Shape& a, const Shape& b) {
      return fit_warnings(a, b, "peg", "hole");
    };
    const TubeShape tube{0.0101, 0.02, 0.03, 32};
    const auto coarse = warnings(CylinderShape{0.01, 0.03, 32}, tube);
    // 48.15 um and 48.87 um together are below 100 um of clearance.
    CHECK(coarse.empty());
    const TubeShape close{0.01005, 0.02, 0.03, 32};
    const auto told = warnings(CylinderShape{0.01, 0.03, 32}, close);
    REQUIRE(told.size() == 1);
    CHECK(contains(told[0], "peg in hole: "));
    CHECK(contains(told[0], "up to 9.68e-05 m"));
    CHECK(contains(told[0], "clearance of 5e-05 m"));
    CHECK(contains(told[0], "segments = 48 or more"));
    CHECK(warnings(CylinderShape{0.01, 0.03, 48}, TubeShape{0.01005, 0.02, 0.03, 48}).empty());
    CHECK(warnings(CylinderShape{0.01, 0.03, 44}, TubeShape{0.01005, 0.02, 0.03, 44}).size() == 1);
    // The tube in the hand, over the peg.
    CHECK(contains(warnings(close, CylinderShape{0.01, 0.03, 32}).at(0), "hole in peg: "));
    // It does not fit, or is no round part.
    CHECK(warnings(CylinderShape{0.011, 0.03, 32}, close).empty());
    CHECK(warnings(BoxShape{{0.01, 0.01, 0.01}}, close).empty());
    CHECK(warnings(CylinderShape{0.01005, 0.03, 512}, close).size() == 1);
    CHECK(
        contains(warnings(CylinderShape{0.01005, 0.03, 512}, close)[0], "give a larger clearance"));

    const BoltShape bolt{8e-3, 1.25e-3, 13e-3, 5.3e-3, 20e-3, 14e-6, 32};
    const NutShape nut{8e-3, 1.25e-3, 13e-3, 6.8e-3, 0.0, 32};
    REQUIRE(warnings(bolt, nut).size() == 1);
    CHECK(contains(warnings(bolt, nut)[0], "clearance of 1.4e-05 m"));
    BoltShape loose = bolt;
    loose.clearance_m = 50e-6;
    CHECK(warnings(loose, nut).empty());
    NutShape other = nut;
    other.pitch_m = 1e-3;
    CHECK(warnings(bolt, other).empty());
  }

  TEST_CASE("the clearance of shapes that fit: along the radius, of threads across the flanks") {
    const TubeShape tube{0.0101, 0.02, 0.03, 32};
    CHECK(least_clearance_m(CylinderShape{0.01, 0.03, 32}, tube).value() ==
          doctest::Approx(1.0e-4).epsilon(1.0e-9).scale(0.0));
    CHECK(least_clearance_m(tube, CylinderShape{0.01, 0.03, 32}).has_value());
    CHECK_FALSE(least_clearance_m(CylinderShape{0.011, 0.03, 32}, tube).has_value());
    CHECK_FALSE(least_clearance_m(BoxShape{{0.01, 0.01, 0.01}}, tube).has_value());
    const BoltShape bolt{8e-3, 1.25e-3, 13e-3, 5.3e-3, 20e-3, 14e-6, 32};
    const NutShape nut{8e-3, 1.25e-3, 13e-3, 6.8e-3, 6e-6, 32};
    CHECK(least_clearance_m(bolt, nut).value() ==
          doctest::Approx(1.0e-5).epsilon(1.0e-9).scale(0.0));
  }
}
