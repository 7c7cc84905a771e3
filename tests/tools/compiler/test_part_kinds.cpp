// SPDX-License-Identifier: Apache-2.0
// Solid or surface: what the compiler chooses and says, at any size, and where a part may start.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/support/all_checks.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/graph_compiler/program/start_pose.hpp"
#include "tools/graph_compiler/program/tolerance_proposal.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

using namespace haptic::tools;
using namespace haptic::test;
using haptic::sim::test::ScratchFolder;
using haptic::tools::test::contains;
using haptic::tools::test::MeshBuilder;

namespace {

void write_mesh(const std::string& path, const MeshBuilder& mesh) {
  std::ofstream out(path);
  out.precision(17);
  for (const Point3& p : mesh.vertices) out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const std::vector<std::uint32_t>& face : mesh.faces) {
    out << 'f';
    for (const std::uint32_t v : face) out << ' ' << v + 1;
    out << '\n';
  }
}

MeshBuilder cube() {
  MeshBuilder m;
  m.box({0, 0, 0}, {1, 1, 1});
  return m;
}

MeshBuilder open_cube() {
  MeshBuilder m = cube();
  m.faces.pop_back();
  m.groups.pop_back();
  return m;
}

/// A ring of 8 x 6 quads, turned off the axes and rounded to six digits: its heights agree to
/// rounding of the file, not of doubles.
MeshBuilder ring() {
  constexpr std::uint32_t kAround = 8, kAcross = 6;
  MeshBuilder m;
  const auto rounded = [](double x) { return std::round(x * 1e6) / 1e6; };
  for (std::uint32_t i = 0; i < kAround; ++i) {
    for (std::uint32_t k = 0; k < kAcross; ++k) {
      const double a = 2 * std::numbers::pi * i / kAround + 0.3;
      const double b = 2 * std::numbers::pi * k / kAcross + 0.15;
      const double r = 1.0 + 0.4 * std::cos(b);
      m.vertex({rounded(r * std::cos(a)), rounded(r * std::sin(a)), rounded(0.4 * std::sin(b))});
    }
  }
  for (std::uint32_t i = 0; i < kAround; ++i) {
    for (std::uint32_t k = 0; k < kAcross; ++k) {
      const std::uint32_t next = (i + 1) % kAround * kAcross, here = i * kAcross;
      const std::uint32_t up = (k + 1) % kAcross;
      m.face({here + k, next + k, next + up, here + up});
    }
  }
  return m;
}

/// A turned part: cylinders of these radii and of length 1 on each other.
MeshBuilder shaft(const std::vector<double>& radii, std::uint32_t segments) {
  MeshBuilder m;
  const auto circle = [&](double radius, double z) {
    std::vector<std::uint32_t> loop;
    for (std::uint32_t k = 0; k < segments; ++k) {
      const double a = 2 * std::numbers::pi * k / segments;
      loop.push_back(m.vertex({radius * std::cos(a), radius * std::sin(a), z}));
    }
    return loop;
  };
  const auto strip = [&](const std::vector<std::uint32_t>& from,
                         const std::vector<std::uint32_t>& to) {
    for (std::uint32_t k = 0; k < segments; ++k) {
      const std::uint32_t next = (k + 1) % segments;
      m.face({from[k], from[next], to[next], to[k]});
    }
  };
  std::vector<std::uint32_t> last = circle(radii[0], 0.0), first = last;
  std::reverse(first.begin(), first.end());
  m.face(first);
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const auto z = static_cast<double>(k);
    if (k > 0) {
      const std::vector<std::uint32_t> begin = circle(radii[k], z);
      strip(last, begin);
      last = begin;
    }
    const std::vector<std::uint32_t> end = circle(radii[k], z + 1.0);
    strip(last, end);
    last = end;
  }
  m.face(last);
  return m;
}

/// A straight star: every second corner of its outline is reflex.
MeshBuilder star(std::uint32_t teeth) {
  MeshBuilder m;
  std::vector<std::uint32_t> low, high;
  for (std::uint32_t k = 0; k < 2 * teeth; ++k) {
    const double a = std::numbers::pi * k / teeth, r = k % 2 == 0 ? 1.0 : 0.9;
    low.push_back(m.vertex({r * std::cos(a), r * std::sin(a), 0.0}));
    high.push_back(m.vertex({r * std::cos(a), r * std::sin(a), 0.2}));
  }
  for (std::uint32_t k = 0; k < 2 * teeth; ++k) {
    const std::uint32_t next = (k + 1) % (2 * teeth);
    m.face({low[k], low[next], high[next], high[k]});
  }
  m.face(high);
  std::reverse(low.begin(), low.end());
  m.face(low);
  return m;
}

/// A scene of two meshes; `more` goes into [moving].
std::string scene_of_meshes(const ScratchFolder& folder, const MeshBuilder& moving,
                            const MeshBuilder& fixed, double scale_to_m, double height_m,
                            const std::string& more = "") {
  write_mesh(folder.file("moving.obj"), moving);
  write_mesh(folder.file("fixed.obj"), fixed);
  std::ofstream out(folder.file("scene.toml"));
  out.precision(17);
  out << "format = 1\nname = \"kinds\"\n[moving]\nmesh = \"moving.obj\"\nscale_to_m = "
      << scale_to_m << "\nposition_m = [0, 0, " << height_m << "]\n"
      << more << "\n[[static]]\nmesh = \"fixed.obj\"\nscale_to_m = " << scale_to_m
      << "\n[rendering]\nk_f_n_per_m = 800\n";
  return folder.file("scene.toml");
}

std::string refusal_of(const std::string& scene) {
  try {
    compile_scene(read_scene_file(scene), {});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

StartShape surface_at(const MeshBuilder& mesh, const Point3& position) {
  SurfaceAccount account;
  const SurfacePart part = make_surface_part(mesh.raw(), {}, &account);
  StartShape shape = start_shape(part, account, {position, {1, 0, 0, 0}});
  shape.mesh = "mesh.obj";
  return shape;
}

}  // namespace

TEST_SUITE("tools.part_kinds") {
  TEST_CASE("a closed part is a solid and says so") {
    const ScratchFolder folder("kinds");
    const CompiledScene compiled =
        compile_scene(read_scene_file(scene_of_meshes(folder, cube(), cube(), 0.01, 0.02)), {});
    for (const PartReport& part : compiled.parts) {
      CHECK_FALSE(part.is_surface());
      CHECK(part.reason == "closed, 0 reflex edges; 6 faces, 1 convex piece");
      CHECK(part.warnings.empty());
    }
    CHECK(contains(report_as_text(compiled), "moving moving.obj: solid: closed, 0 reflex edges"));
    const auto json = nlohmann::json::parse(report_as_json(compiled));
    CHECK(json["parts"][0]["as"] == "solid");
    CHECK(json["parts"][0]["surface"].is_null());
  }

  TEST_CASE("an open part is a surface with its counts; as = \"solid\" refuses it with the place") {
    const ScratchFolder folder("kinds");
    const CompiledScene compiled = compile_scene(
        read_scene_file(scene_of_meshes(folder, cube(), open_cube(), 0.01, 0.03)), {});
    CHECK_FALSE(compiled.parts[0].is_surface());
    CHECK(compiled.parts[1].is_surface());
    CHECK(compiled.parts[1].reason == "4 open edges (a solid needs none); 10 triangles, 5 facets");
    const std::string solid =
        refusal_of(scene_of_meshes(folder, open_cube(), cube(), 0.01, 0.03, "as = \"solid\""));
    CHECK(contains(solid, "open: 4 edges without a partner, longest hole at"));
    const CompiledScene asked = compile_scene(
        read_scene_file(scene_of_meshes(folder, cube(), cube(), 0.01, 0.03, "as = \"surface\"")),
        {});
    CHECK(asked.parts[0].reason == "as the scene asks; 12 triangles, 6 facets");
  }

  TEST_CASE("a law of depths refuses a surface") {
    const ScratchFolder folder("kinds");
    SceneFile scene = read_scene_file(scene_of_meshes(folder, cube(), open_cube(), 0.01, 0.03));
    scene.parameters.law = haptic::LawId::kPaper;
    CHECK_THROWS_WITH_AS(compile_scene(scene, {}), doctest::Contains("open: 4 edges"), InputError);
    scene.statics[0].kind = PartKind::kSurface;
    CHECK_THROWS_WITH_AS(compile_scene(scene, {}),
                         doctest::Contains("law paper needs the depth in a solid"), InputError);
  }

  TEST_CASE("too many reflex edges make a surface, not a refusal") {
    const ScratchFolder folder("kinds");
    CompileOptions options;
    options.max_reflex = 3;
    const SceneFile scene = read_scene_file(scene_of_meshes(folder, ring(), cube(), 0.01, 0.05));
    const CompiledScene compiled = compile_scene(scene, options);
    CHECK(compiled.parts[0].is_surface());
    CHECK(contains(compiled.parts[0].reason, "24 reflex edges, limit 3"));
  }

  TEST_CASE("beyond 300 reflex edges the cheaper kind is taken, and what both cost is said") {
    const ScratchFolder folder("kinds");
    // Four rings of reflex edges, each in one plane: five pieces, and hundreds of facets.
    const CompiledScene turned =
        compile_scene(read_scene_file(scene_of_meshes(folder, shaft({1.0, 0.6, 1.0, 0.6, 1.0}, 80),
                                                      cube(), 0.01, 0.2)),
                      {});
    const PartReport& solid = turned.parts[0];
    CAPTURE(solid.reason);
    CHECK_FALSE(solid.is_surface());
    CHECK(solid.reflex_edges == 320);
    CHECK(solid.pieces.size() == 5);
    CHECK(solid.certificate.holds());
    CHECK(contains(solid.reason, "closed, 320 reflex edges; "));
    CHECK(contains(solid.reason,
                   "; contact all over takes 2 % of the work of a tick with 5 convex pieces, "));
    // No two reflex edges in one plane.
    const CompiledScene toothed =
        compile_scene(read_scene_file(scene_of_meshes(folder, star(310), cube(), 0.01, 0.2)), {});
    const PartReport& surface = toothed.parts[0];
    CAPTURE(surface.reason);
    CHECK(surface.is_surface());
    CHECK(contains(surface.reason, "310 reflex edges, limit 300: too curved"));
    CHECK(contains(surface.reason,
                   "; contact all over takes 143 % of the work of a tick with about "
                   "311 convex pieces, "));
  }

  TEST_CASE("as: only two words, and no disjoint beside a surface") {
    const ScratchFolder folder("kinds");
    const auto refused = [&](const std::string& more) {
      return refusal_of(scene_of_meshes(folder, cube(), cube(), 0.01, 0.03, more));
    };
    CHECK(contains(refused("as = \"sheet\""), "'sheet'; give \"solid\" or \"surface\""));
    CHECK(contains(refused("as = \"surface\"\ndisjoint = true"), "disjoint"));
  }

  TEST_CASE("tolerance_m simplifies a surface; the report and a warning say what is proved") {
    const ScratchFolder folder("kinds");
    const std::string more = "as = \"surface\"\ntolerance_m = 0.003";
    const CompiledScene compiled = compile_scene(
        read_scene_file(scene_of_meshes(folder, ring(), cube(), 0.01, 0.05, more)), {});
    const PartReport& part = compiled.parts[0];
    REQUIRE(part.collapsed);
    CHECK(part.collapsed->changed());
    CHECK(part.collapsed->facets_after == part.surface->facets);
    CHECK(part.collapsed->hausdorff_m() <= 0.003);
    REQUIRE(part.warnings.size() == 1);
    CHECK(contains(part.warnings[0], "simplified within 0.003 m: facets "));
    CHECK_FALSE(compiled.parts[1].collapsed);
    const auto json = nlohmann::json::parse(report_as_json(compiled));
    CHECK(json["parts"][0]["simplified"]["facets_after"] == part.surface->facets);
    CHECK(json["parts"][0]["simplified"]["hausdorff_m"] == part.collapsed->hausdorff_m());
    // Who loads the scene is told too.
    const SceneBytes bytes{compiled.bytes};
    haptic::SceneView view;
    REQUIRE(haptic::SceneView::open(bytes.span(), view) == haptic::RtStatus::kOk);
    REQUIRE(view.simplified_bodies().size() == 1);
    CHECK(view.simplified_bodies()[0].body == 0);
    CHECK(view.simplified_bodies()[0].distance_m == part.collapsed->hausdorff_m());
  }

  TEST_CASE("tolerance_m above half of the clearance of two shapes is refused with the numbers") {
    SceneFile scene;
    scene.file = "scene.toml";
    scene.moving.mesh = "nut";
    scene.moving.shape = NutShape{16e-3, 2e-3, 24e-3, 14.8e-3, 2e-4, 24};
    scene.statics.resize(1);
    scene.statics[0].mesh = "bolt";
    scene.statics[0].shape = BoltShape{16e-3, 2e-3, 24e-3, 10e-3, 20e-3, 0.0, 24};
    scene.statics[0].tolerance_m = 6e-5;
    CHECK_THROWS_WITH_AS(
        compile_scene(scene, {}),
        "scene.toml: bolt: tolerance_m 6e-05 is more than half of the clearance of "
        "0.0001 m between nut and bolt; give tolerance_m below 5e-05, or leave it "
        "out",
        InputError);
  }

  TEST_CASE("a proposed tolerance meets the units of work, or says that none does") {
    SurfaceOptions options;
    options.merge = false;
    ProposalPart ball, box;
    ball.mesh =
        triangle_mesh(make_surface_part(shape_mesh(SphereShape{0.01, 48}, "ball"), options));
    ball.pieces = ball.mesh.triangles.size();
    ball.diagonal_m = 0.035;
    ball.closed = true;
    box.pieces = 1;
    const double units = contact_cost(400, 1, 3).units;
    const double none = HUGE_VAL;
    const auto met = propose_tolerance(ball, box, 3, units, none, {});
    REQUIRE(met);
    CHECK(contact_cost(met->pieces_a, met->pieces_b, 3).units <= units);
    CHECK(met->pieces_b == 1);
    const auto bounded = propose_tolerance(ball, box, 3, units, 2.0e-6, {});
    REQUIRE(bounded);
    CHECK(bounded->tolerance_m <= 2.0e-6);
    const TickBudget budget{2 * units, units};
    CHECK(contains(contact_cost_text("ball", "box", ball.pieces, 1, 3, budget, true, bounded),
                   "not enough"));
    CHECK(contains(contact_cost_text("ball", "box", ball.pieces, 1, 3, budget, false, {}),
                   "comes in time has"));
    CHECK(
        contains(contact_cost_text("ball", "box", ball.pieces, 1, 3, {units, 2 * units}, false, {}),
                 "the budget is"));
    CHECK_FALSE(propose_tolerance(box, box, 3, units, none, {}));
  }

  TEST_CASE("sizes out of range are refused as a solid and not taken for a surface") {
    const ScratchFolder folder("kinds");
    CHECK(contains(refusal_of(scene_of_meshes(folder, cube(), cube(), 1e-8, 1.0)), "across"));
  }

  TEST_CASE("the same shape at any size gives the same pieces") {
    std::vector<std::size_t> first;
    for (int exponent = -13; exponent <= 10; exponent += trials(6, 1)) {
      // Powers of two round nothing: the shape is the same to the last bit.
      const double scale = std::ldexp(1.0, exponent);
      CAPTURE(scale);
      const ScratchFolder folder("kinds");
      const CompiledScene compiled = compile_scene(
          read_scene_file(scene_of_meshes(folder, ring(), cube(), scale, 3 * scale)), {});
      REQUIRE_FALSE(compiled.parts[0].is_surface());
      std::vector<std::size_t> structure;
      for (const ConvexPiece& piece : compiled.parts[0].pieces) {
        structure.push_back(piece.vertices.size());
        for (const PieceFace& face : piece.faces) structure.push_back(face.loop.size());
      }
      if (first.empty()) first = structure;
      CHECK(structure == first);
    }
    CHECK(first.size() > 60);
    for (const double scale : {1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3}) {
      CAPTURE(scale);
      const ScratchFolder folder("kinds");
      const std::string refusal =
          refusal_of(scene_of_meshes(folder, ring(), cube(), scale, 3 * scale));
      // Its pieces have faces of a few ten-millionths of its size, the digits of the file; in
      // single precision those are rounding at some scales, which is said.
      const bool is_rounding = HAPTIC_REAL_IS_FLOAT && contains(refusal, "is as thin as rounding");
      if (!is_rounding) CHECK(refusal == "");
    }
  }

  TEST_CASE("a start across a facet is found, and the free pose named is free") {
    const std::vector<StartShape> fixed{surface_at(open_cube(), {0, 0, 0})};
    CHECK_FALSE(start_collision(surface_at(cube(), {1.5, 0, 0}), fixed).has_value());
    const Point3 start{0.75, 0.25, 0.125};
    const auto found = start_collision(surface_at(cube(), start), fixed);
    REQUIRE(found.has_value());
    CHECK_FALSE(found->inside);
    CHECK(found->face >= 0);
    CHECK(found->fixed_face >= 0);
    REQUIRE(found->free_move_m.has_value());
    CHECK((*found->free_move_m)[0] == doctest::Approx(0.25).epsilon(2e-3));
    CHECK(vec::norm(*found->free_move_m) == doctest::Approx(0.25).epsilon(2e-3));
    CHECK_FALSE(start_collision(surface_at(cube(), vec::add(start, *found->free_move_m)), fixed)
                    .has_value());
    CHECK(contains(start_collision_text(*found, fixed[0], start), "is free, 0.25"));
  }

  TEST_CASE("touching a surface is a collision, a gap of one rounding is none") {
    const std::vector<StartShape> fixed{surface_at(cube(), {0, 0, 0})};
    CHECK(start_collision(surface_at(cube(), {1, 0.3, 0.2}), fixed).has_value());
    CHECK_FALSE(start_collision(surface_at(cube(), {std::nextafter(1.0, 2.0), 0.3, 0.2}), fixed)
                    .has_value());
  }

  TEST_CASE("inside a closed shell is a collision, inside an open one and in a cavity is none") {
    MeshBuilder big = cube();
    for (Point3& p : big.vertices) p = vec::scaled(vec::sub(p, {0.5, 0.5, 0.5}), 10.0);
    const StartShape small = surface_at(cube(), {0, 0, 0});
    const auto found = start_collision(small, {surface_at(big, {0, 0, 0})});
    REQUIRE(found.has_value());
    CHECK(found->inside);
    CHECK(vec::norm(*found->free_move_m) == doctest::Approx(5.0).epsilon(0.01));
    CHECK(start_collision(surface_at(big, {0, 0, 0}), {small}).has_value());
    MeshBuilder open = big;
    open.faces.pop_back();
    open.groups.pop_back();
    CHECK_FALSE(start_collision(small, {surface_at(open, {0, 0, 0})}).has_value());
    MeshBuilder hollow = big;
    hollow.box({-3, -3, -3}, {3, 3, 3}, false);
    CHECK_FALSE(start_collision(small, {surface_at(hollow, {0, 0, 0})}).has_value());
    CHECK(start_collision(surface_at(cube(), {3.5, 0, 0}), {surface_at(hollow, {0, 0, 0})})
              .has_value());
  }

  TEST_CASE("inside a torn shell is a collision, inside a hollow with a mouth is none") {
    const auto shell = [](double half_z, double hole_low, double hole_high) {
      // Walls from -5 to 5, top with a square hole.
      MeshBuilder m;
      m.box({-5, -5, -half_z}, {5, 5, half_z});
      std::erase_if(m.faces, [&](const std::vector<std::uint32_t>& face) {
        return std::ranges::all_of(face, [&](std::uint32_t v) { return m.vertices[v][2] > 0; });
      });
      m.groups.resize(m.faces.size());
      const auto at = [&](double x, double y) { return m.vertex({x, y, half_z}); };
      const double l = hole_low, h = hole_high;
      const std::uint32_t a = at(-5, -5), b = at(5, -5), c = at(5, 5), d = at(-5, 5);
      const std::uint32_t i = at(l, l), j = at(h, l), k = at(h, h), n = at(l, h);
      m.face({a, b, j, i});
      m.face({b, c, k, j});
      m.face({c, d, n, k});
      m.face({d, a, i, n});
      return m;
    };
    const StartShape small = surface_at(cube(), {0, 0, 0});
    const auto collides = [&](const MeshBuilder& around, const StartShape& part) {
      return start_collision(part, {surface_at(around, {0, 0, 0})});
    };
    // A hole that the part cannot have come through.
    const auto torn = collides(shell(5, -0.25, 0.25), small);
    REQUIRE(torn.has_value());
    CHECK(torn->inside);
    REQUIRE(torn->free_move_m.has_value());
    CHECK(vec::norm(*torn->free_move_m) >= 5.0);
    const MeshBuilder around = shell(5, -0.25, 0.25);
    CHECK_FALSE(collides(around, surface_at(cube(), *torn->free_move_m)).has_value());
    // The torn shell round the part in the hand.
    CHECK(start_collision(surface_at(around, {0, 0, 0}), {small}).has_value());
    // A hole of its size, and a deep cup: at its bottom the winding number is near 1.
    CHECK_FALSE(collides(shell(5, -1, 1), small).has_value());
    CHECK_FALSE(collides(shell(50, -4, 4), surface_at(cube(), {0, 0, -49})).has_value());
    // A crack across the top is no mouth.
    MeshBuilder cracked = cube();
    for (Point3& p : cracked.vertices) p = vec::scaled(vec::sub(p, {0.5, 0.5, 0.5}), 10.0);
    const auto split = [&](std::size_t f) {
      for (std::uint32_t& v : cracked.faces[f]) {
        const Point3 p = cracked.vertices[v];
        v = cracked.vertex(vec::scaled(p, 1.001));
      }
    };
    split(0);
    const auto behind = collides(cracked, small);
    REQUIRE(behind.has_value());
    CHECK(behind->inside);
    // Beside the torn shell, and between two sheets, there is no inside.
    CHECK_FALSE(collides(around, surface_at(cube(), {5.5, 0, 0})).has_value());
    MeshBuilder sheets = cracked;
    sheets.faces.resize(2);
    sheets.groups.resize(2);
    CHECK_FALSE(collides(sheets, small).has_value());
  }

  TEST_CASE("a part of many triangles is moved out of a small one too") {
    MeshBuilder fine;
    constexpr std::uint32_t kCells = 24;
    for (std::uint32_t y = 0; y <= kCells; ++y) {
      for (std::uint32_t x = 0; x <= kCells; ++x) {
        fine.vertex({4.0 * x / kCells, 4.0 * y / kCells, 0.01 * std::sin(x + 2.0 * y)});
      }
    }
    for (std::uint32_t y = 0; y < kCells; ++y) {
      for (std::uint32_t x = 0; x < kCells; ++x) {
        const std::uint32_t a = y * (kCells + 1) + x, b = a + kCells + 1;
        fine.face({a, a + 1, b + 1});
        fine.face({a, b + 1, b});
      }
    }
    const std::vector<StartShape> fixed{surface_at(cube(), {1.5, 1.5, -0.75})};
    const auto found = start_collision(surface_at(fine, {0, 0, 0}), fixed);
    REQUIRE(found.has_value());
    CHECK_FALSE(found->inside);
    REQUIRE(found->free_move_m.has_value());
    CHECK((*found->free_move_m)[2] == doctest::Approx(0.26).epsilon(0.02));
    CHECK_FALSE(start_collision(surface_at(fine, *found->free_move_m), fixed).has_value());
  }

  TEST_CASE("solids that start in each other give a warning, solids that touch none") {
    const ScratchFolder folder("kinds");
    const auto warnings = [&](double height_m) {
      const std::string path = scene_of_meshes(folder, cube(), cube(), 0.01, height_m);
      return compile_scene(read_scene_file(path), {}).parts[0].warnings;
    };
    CHECK(warnings(0.01).empty());
    REQUIRE(warnings(0.004).size() == 1);
    CHECK(contains(warnings(0.004)[0], "the start pose"));
    CHECK(warnings(0.0).size() == 1);  // one is where the other is: nothing crosses
  }

  TEST_CASE("a scene that starts across a surface is refused with the place and a free pose") {
    const ScratchFolder folder("kinds");
    const std::string text = refusal_of(scene_of_meshes(folder, cube(), open_cube(), 0.01, 0.004));
    CHECK(contains(text, "the start pose meets face"));
    CHECK(contains(text, "fixed.obj"));
    CHECK(contains(text, "position_m = ["));
  }
}
