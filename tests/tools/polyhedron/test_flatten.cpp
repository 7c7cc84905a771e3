// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "tests/tools/polyhedron/flatten_checks.hpp"
#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"
#include "tools/graph_compiler/polyhedron/realise.hpp"

namespace haptic::tools {
namespace {

using parts::Part;
using parts::Random;

FlatBody flattened(const Surface& s) {
  FlatBody body = flatten(s, FlattenLimits{});
  parts::check_body(body, s);
  return body;
}

TEST_SUITE("tools.flatten") {
  TEST_CASE("flatten: axis-aligned boxes keep every coordinate, also far from the origin") {
    for (const double offset : {0.0, 0.3, -17.7, 1e4}) {
      CAPTURE(offset);
      Part part = parts::box({0.1, -1.0 / 3.0, 0.02}, {0.7, 0.1, 1.0 / 7.0})
                      .move({offset, -offset, 0.5 * offset});
      const Surface s = parts::surface_of({part});
      FlatBody body = flattened(s);
      CHECK(body.merged_plane_count == 6);
      CHECK(body.world.vertices.size() == 8);
      CHECK(body.reflex_edge_count == 0);
      CHECK(body.largest_move_m == 0.0);
      CHECK(parts::moved_ulps(body, part.vertices) <= 1.0);
      for (const ExactPlane& plane : body.world.planes) {
        CHECK(std::abs(plane.unit_normal[0]) + std::abs(plane.unit_normal[1]) +
                  std::abs(plane.unit_normal[2]) ==
              1.0);
      }
    }
  }

  TEST_CASE("flatten: rotated boxes keep their vertices to within 4 ulp") {
    Random random(11);
    double worst = 0.0;
    for (int k = 0; k < 150; ++k) {
      CAPTURE(k);
      const double offset = k % 3 == 0 ? 0.0 : k % 3 == 1 ? 1.0 : 1e4;
      Part part = parts::box({-0.5, -0.5, -0.5},
                             {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)});
      part.transform(parts::random_rotation(random), random.uniform(0.01, 0.2),
                     {offset, -offset, offset / 3});
      const Surface s = parts::surface_of({part});
      FlatBody body = flattened(s);
      CHECK(body.merged_plane_count == 6);
      worst = std::max(worst, parts::moved_ulps(body, part.vertices));
    }
    CHECK(worst <= 4.0);
  }

  TEST_CASE("flatten: a clean box turned by less than the tolerance stays turned") {
    const double a = 1e-7;
    const parts::Rotation r{
        {{std::cos(a), -std::sin(a), 0}, {std::sin(a), std::cos(a), 0}, {0, 0, 1}}};
    Part part = parts::box({0, 0, 0}, {0.1, 0.07, 0.05}).transform(r, 1.0, {0, 0, 0});
    const Surface s = parts::surface_of({part});
    FlatBody body = flattened(s);
    CHECK(parts::moved_ulps(body, part.vertices) <= 4.0);
  }

  TEST_CASE(
      "flatten: regular prisms and pyramids keep their vertices, upright exactly and rotated to "
      "within 4 ulp") {
    Random random(12);
    for (int n = 3; n <= 24; ++n) {
      CAPTURE(n);
      Part upright = parts::prism(parts::regular_outline(n, 0.031), 0.1, 0.17);
      FlatBody body = flattened(parts::surface_of({upright}));
      CHECK(body.merged_plane_count == static_cast<std::size_t>(n) + 2);
      CHECK(body.steps[2].largest_move_m == 0.0);
      CHECK(parts::moved_ulps(body, upright.vertices) <= 1.0);
      Part rotated = parts::prism(parts::regular_outline(n, 0.5), -0.2, 0.6);
      rotated.transform(parts::random_rotation(random), 0.08, {0.01, 0.02, -0.03});
      FlatBody turned = flattened(parts::surface_of({rotated}));
      CHECK(parts::moved_ulps(turned, rotated.vertices) <= 4.0);
      Part pyramid = parts::loft({parts::ring(n, 0.5, 0.0), {{0, 0, 0.7}}});
      pyramid.transform(parts::random_rotation(random), 0.08, {0.01, 0.02, -0.03});
      FlatBody pointed = flattened(parts::surface_of({pyramid}));
      CHECK(pointed.merged_plane_count == static_cast<std::size_t>(n) + 1);
      CHECK(parts::moved_ulps(pointed, pyramid.vertices) <= 4.0);
    }
  }

  TEST_CASE("flatten: corners on more than three planes are met exactly by all of them") {
    Random random(13);
    for (int k = 0; k < 20; ++k) {
      CAPTURE(k);
      // Bevelled at both ends: four planes meet at each shoulder corner; eight at the apex of the
      // pyramid.
      const int sides = 4 + k % 5;
      Part bevelled = parts::loft({parts::ring(sides, 0.4, 0.0), parts::ring(sides, 0.5, 0.1),
                                   parts::ring(sides, 0.5, 0.6), parts::ring(sides, 0.35, 0.8)});
      bevelled.transform(parts::random_rotation(random), 0.1, {0.2, 0.1, 0.0}).print(6);
      const Surface s = parts::surface_of({bevelled}, 1.5e-6);
      FlatBody body = flattened(s);
      CHECK(body.merged_plane_count == 3 * static_cast<std::size_t>(sides) + 2);
      CHECK(body.world.vertices.size() == 4 * static_cast<std::size_t>(sides));
      Part pyramid = parts::loft({parts::ring(8, 0.5, 0.0), {{0, 0, 0.4}}});
      pyramid.transform(parts::random_rotation(random), 0.1, {0, 0, 0}).print(5);
      FlatBody pointed = flattened(parts::surface_of({pyramid}, 1.5e-5));
      CHECK(pointed.merged_plane_count == 9);
      CHECK(pointed.world.vertices.size() == 9);
    }
  }

  TEST_CASE("flatten: prisms printed to 4, 5 and 6 digits come out with their planes and no more") {
    Random random(14);
    for (const int digits : {4, 5, 6}) {
      for (int k = 0; k < 12; ++k) {
        CAPTURE(digits);
        CAPTURE(k);
        const int n = 3 + k;
        Part part = parts::prism(parts::regular_outline(n, 0.5), -0.3, 0.4);
        part.transform(parts::random_rotation(random), 1.0, {random.uniform(-2, 2), 0.3, 0.1})
            .print(digits);
        const double q = std::pow(10.0, -digits);
        const Surface s = parts::surface_of({part}, std::max(1.5 * q, 5e-6));
        FlatBody body = flattened(s);
        CHECK(body.merged_plane_count == static_cast<std::size_t>(n) + 2);
        CHECK(body.world.vertices.size() == 2 * static_cast<std::size_t>(n));
      }
    }
  }

  TEST_CASE("flatten: noisy subdivided faces become one polygon each, with eight corners") {
    Random random(15);
    Part part = parts::subdivided_cube(12);
    const double tolerance = 1e-5;
    for (Point3& v : part.vertices) {
      for (double& c : v) c += random.uniform(-0.4, 0.4) * tolerance;
    }
    const Surface s = parts::surface_of({part}, tolerance);
    FlatBody body = flattened(s);
    CHECK(body.merged_plane_count == 6);
    CHECK(body.world.vertices.size() == 8);
    CHECK(body.steps.size() == 3);
    CHECK(body.steps[1].count == part.vertices.size() - 8);
    CHECK(body.largest_move_m > 1e-7);
    part.transform(parts::random_rotation(random), 1.0, {0, 0, 0});
    FlatBody turned = flattened(parts::surface_of({part}, tolerance));
    CHECK(turned.merged_plane_count == 6);
    CHECK(turned.world.vertices.size() == 8);
  }

  TEST_CASE("flatten: reflex edges are counted after merging") {
    const Part ell = parts::prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, 0, 1);
    FlatBody body = flattened(parts::surface_of({ell}));
    CHECK(body.merged_plane_count == 8);
    CHECK(body.reflex_edge_count == 1);
    const Part star = parts::prism(parts::star_outline(9, 1.0, 0.5), 0, 0.3);
    CHECK(flattened(parts::surface_of({star})).reflex_edge_count == 9);
  }

  TEST_CASE("flatten: both sides of one plane share it with opposite signs") {
    // The top of the lower step and the underside of the upper one lie in y = 1.
    const Part zed =
        parts::prism({{0, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {-1, 2}, {-1, 1}, {0, 1}}, 0, 1);
    FlatBody body = flattened(parts::surface_of({zed}));
    CHECK(body.merged_plane_count == 9);
    CHECK(body.reflex_edge_count == 2);
    CHECK(body.world.planes.size() == 9);
    CHECK(body.solids[0].solid.faces.size() == 10);
    std::map<std::uint32_t, int> signs;
    for (const ExactFace& face : body.solids[0].solid.faces) signs[face.plane] += face.sign;
    CHECK(std::count_if(signs.begin(), signs.end(),
                        [](const auto& entry) { return entry.second == 0; }) == 1);
  }

  TEST_CASE("flatten: a corner next to the extension of another face is put onto it") {
    // The slope (0,0)-(2,1) extended passes 0.3 tolerances from the corner (4,2).
    const double tolerance = 1e-5;
    Part part = parts::prism(
        {{0, 0}, {0, -2}, {6, -2}, {6, 5}, {4, 2 + 0.3 * tolerance}, {4, 0.5}, {2, 1}}, 0, 1);
    const Surface s = parts::surface_of({part}, tolerance);
    FlatBody body = flattened(s);
    CHECK(body.reflex_edge_count > 0);
    std::size_t touched = 0;
    for (std::uint32_t p = 0; p < body.world.planes.size(); ++p) {
      std::size_t on = 0;
      for (std::uint32_t v = 0; v < body.world.vertices.size(); ++v)
        on += body.world.side(v, p) == 0;
      touched += on == 6;
    }
    CHECK(touched == 1);
  }

  TEST_CASE("flatten: tiny and distant parts") {
    Random random(16);
    for (int k = 0; k < 10; ++k) {
      Part tiny = parts::prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, 0, 1);
      tiny.transform(parts::random_rotation(random), 5e-6, {0, 0, 0});
      FlatBody body = flattened(parts::surface_of({tiny}));
      CHECK(body.merged_plane_count == 8);
      CHECK(parts::moved_ulps(body, tiny.vertices) <= 4.0);
      Part far = parts::prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}, 0, 1);
      far.transform(parts::random_rotation(random), 0.05, {1e4, -1e4, 5e3});
      FlatBody distant = flattened(parts::surface_of({far}));
      CHECK(distant.merged_plane_count == 8);
      CHECK(parts::moved_ulps(distant, far.vertices) <= 4.0);
    }
  }

  TEST_CASE(
      "flatten: an outer shell and its void are one solid; separate shells are several on shared "
      "planes") {
    const Part outer = parts::box({0, 0, 0}, {3, 3, 3});
    const Part inner = parts::box({1, 1, 1}, {2, 2, 2});
    FlatBody hollow = flattened(parts::surface_of({outer, inner}, 0.0, {-1, 0}));
    REQUIRE(hollow.solids.size() == 1);
    CHECK(hollow.solids[0].shells == std::vector<std::uint32_t>{0, 1});
    CHECK(hollow.solids[0].solid.faces.size() == 12);
    CHECK(hollow.reflex_edge_count == 12);
    CHECK(parts::chain_volume(hollow) == doctest::Approx(26.0));
    const Part beside = parts::box({3, 3, 0}, {5, 5, 3});
    FlatBody pair = flattened(parts::surface_of({outer, beside}));
    REQUIRE(pair.solids.size() == 2);
    CHECK(pair.merged_plane_count == 8);
    CHECK(pair.world.vertices.size() == 14);
  }

  TEST_CASE("flatten: triangulated surfaces keep every vertex exactly") {
    Random random(17);
    Part part =
        parts::loft({parts::ring(9, 0.3, 0.0), parts::ring(9, 0.5, 0.3), parts::ring(9, 0.2, 0.9)});
    for (Point3& v : part.vertices) {
      for (double& c : v) c += random.uniform(-0.01, 0.01);
    }
    Part triangles;
    triangles.vertices = part.vertices;
    for (const auto& face : part.faces) {
      for (std::size_t k = 1; k + 1 < face.size(); ++k)
        triangles.faces.push_back({face[0], face[k], face[k + 1]});
    }
    FlatBody body = flattened(parts::surface_of({triangles}));
    CHECK(body.merged_plane_count == triangles.faces.size());
    CHECK(body.steps[2].largest_move_m == 0.0);
    CHECK(parts::moved_ulps(body, part.vertices) <= 1.0);
  }

  TEST_CASE("flatten: the faces of the file are named") {
    Part part = parts::subdivided_cube(3);
    FlatBody body = flattened(parts::surface_of({part}));
    for (const ExactFace& face : body.solids[0].solid.faces) {
      REQUIRE(face.source_face >= 0);
      for (const std::uint32_t v : part.faces[static_cast<std::size_t>(face.source_face)]) {
        const Point3 local =
            vec::scaled(vec::sub(part.vertices[v], body.world.centre_m), body.world.scale);
        const ExactPlane& plane = body.world.planes[face.plane];
        CHECK(std::abs(vec::dot(plane.unit_normal, local) - plane.unit_offset) < 1e-15);
      }
    }
  }

  TEST_CASE("flatten: the same surface gives the same body twice") {
    Random random(19);
    Part part = parts::prism(parts::star_outline(7, 1.0, 0.5), 0, 0.3);
    part.transform(parts::random_rotation(random), 0.3, {0, 0, 0}).print(5);
    const Surface s = parts::surface_of({part}, 1.5e-5);
    const FlatBody a = flatten(s, {}), b = flatten(s, {});
    REQUIRE(a.world.vertices.size() == b.world.vertices.size());
    for (std::size_t k = 0; k < a.world.vertices.size(); ++k)
      CHECK(a.world.vertices[k].x == b.world.vertices[k].x);
    REQUIRE(a.solids[0].solid.faces.size() == b.solids[0].solid.faces.size());
    for (std::size_t k = 0; k < a.solids[0].solid.faces.size(); ++k) {
      CHECK(a.solids[0].solid.faces[k].edges == b.solids[0].solid.faces[k].edges);
    }
  }

  TEST_CASE("flatten: quads of doubly curved surfaces become triangles that stick out") {
    Random random(21);
    for (const int digits : {0, 4, 6}) {
      CAPTURE(digits);
      std::vector<std::vector<Point3>> rings{{{0, 0, -0.5}}};
      for (int k = 1; k < 6; ++k) {
        const double angle = 3.14159265358979323846 * k / 6;
        rings.push_back(parts::ring(12, 0.5 * std::sin(angle), -0.5 * std::cos(angle)));
      }
      rings.push_back({{0, 0, 0.5}});
      Part ball = parts::loft(rings);
      ball.transform(parts::random_rotation(random), 1.0, {0.1, 0.2, 0.3});
      if (digits > 0) ball.print(digits);
      const Surface s = parts::surface_of({ball}, digits == 4 ? 1.5e-4 : 0.0);
      FlatBody body = flattened(s);
      CHECK(body.merged_plane_count == 2 * 48 + 24);
      CHECK(body.world.vertices.size() == 62);
      CHECK(body.steps[2].largest_move_m < 0.2 * s.plane_tolerance_m);
      CHECK(body.largest_bits < 1000);
      REQUIRE(body.warnings.size() == 1);
      CHECK(parts::contains(body.warnings[0], "48 faces with four corners were split"));
      // Still convex, exactly.
      std::size_t outside = 0;
      for (const ExactFace& face : body.solids[0].solid.faces) {
        for (std::uint32_t v = 0; v < body.world.vertices.size(); ++v) {
          outside += face.sign * body.world.side(v, face.plane) > 0;
        }
      }
      CHECK(outside == 0);
    }
    // A ring of quads has a handle: no order of placement exists.
    Part ring;
    const std::uint32_t n = 16, m = 8;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < m; ++j) {
        const double a = 2 * 3.14159265358979323846 * i / n, b = 2 * 3.14159265358979323846 * j / m;
        const double r = 0.4 + 0.1 * std::cos(b);
        ring.vertices.push_back({r * std::cos(a), r * std::sin(a), 0.1 * std::sin(b)});
        const auto id = [&](std::uint32_t k, std::uint32_t l) { return k % n * m + l % m; };
        ring.faces.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
      }
    }
    ring.transform(parts::random_rotation(random), 1.0, {0, 0, 0});
    FlatBody body = flattened(parts::surface_of({ring}));
    CHECK(body.reflex_edge_count == n * m / 2);
    CHECK(body.world.vertices.size() == n * m);
  }

  struct SharedPart {
    const char* file;
    std::array<double, 3> scale;
    std::size_t planes, reflex, solids;
  };

  TEST_CASE("flatten: real parts come out with their known planes and reflex edges") {
    const std::filesystem::path data = std::filesystem::path(HAPTIC_SHARED_DIR) / "data";
    if (!std::filesystem::exists(data)) {
      MESSAGE("skipped: no folder " << data.string());
      return;
    }
    const std::string rect = "rect_peg_16mm/factory_rectangular_";
    const std::string peg = rect + "peg_16mm_loose_subdiv_3x.obj",
                      hole = rect + "hole_16mm_subdiv_3x.obj";
    const SharedPart all[] = {
        {"square_peg/4gon_peg.stl", {1e-3, 1e-3, 1e-3}, 6, 0, 1},
        {"square_peg/4gon_box_t5mm.stl", {1e-3, 1e-3, 1e-3}, 10, 4, 1},
        {"cube_in_cup/cube.obj", {0.079, 0.079, 0.079}, 6, 0, 1},
        {"cube_in_cup/cube_cup.obj", {1, 1, 1}, 11, 8, 1},
        {"octagon_peg/8gon_peg.stl", {1e-3, 1e-3, 1e-3}, 10, 0, 1},
        {"octagon_peg/8gon_box_t5mm.stl", {1e-3, 1e-3, 1e-3}, 14, 8, 1},
        {peg.c_str(), {1, 1, 1}, 10, 0, 1},
        {hole.c_str(), {1, 1, 1}, 10, 4, 1},
        {"corner_bracket/15.obj", {0.003, 0.003, 0.001}, 8, 1, 1},
        {"ell_fixture/ell_boxes.obj", {1, 1, 1}, 10, 0, 2},
        {"ell_fixture/fixture_boxes.obj", {1, 1, 1}, 27, 0, 7},
        {"plug_socket/plug.stl", {1, 1, 1}, 44, 0, 2},
        {"plug_socket/plug_wall.stl", {1, 1, 1}, 50, 24, 1},
        {"prism_stack/r2_sds10_shr0_drf0_hlw0_shx0_shy0_scx45_scy45_scz50.stl",
         {1, 1, 1},
         12,
         0,
         1},
        {"prism_stack/r3_sds4_shr75_drf0_hlw0_shx0_shy0_scx41_scy49_scz71.stl", {1, 1, 1}, 6, 0, 1},
    };
    for (const SharedPart& part : all) {
      CAPTURE(part.file);
      CleaningOptions options;
      options.scale_to_m = part.scale;
      const Surface s = clean_surface(read_mesh(data / part.file), options);
      FlatBody body = flattened(s);
      CHECK(body.merged_plane_count == part.planes);
      CHECK(body.reflex_edge_count == part.reflex);
      CHECK(body.solids.size() == part.solids);
    }
    for (const char* gear : {"industreal_gear_small.obj", "industreal_gear_base.obj"}) {
      const Surface s = clean_surface(read_mesh(data / "gear_on_shaft" / gear), {});
      CHECK(parts::contains(parts::refusal(s), "reflex edges, limit 300"));
    }
  }
}

}  // namespace
}  // namespace haptic::tools
