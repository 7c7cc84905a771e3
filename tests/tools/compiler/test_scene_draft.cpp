// SPDX-License-Identifier: Apache-2.0
// graph_compiler init: what it guesses, and that what it writes compiles.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "hal/drivers/reference_driver.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/program/scene_draft.hpp"
#include "tools/graph_compiler/program/unit_guess.hpp"

using namespace haptic::test;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
using haptic::tools::draft_scene;
using haptic::tools::DraftRequest;
using haptic::tools::guessed_unit;
using haptic::tools::SceneDraft;

namespace {

/// Boxes from corner to corner, as one OBJ file.
struct Corners {
  double low[3], high[3];
};
void write_boxes(const std::string& path, const std::vector<Corners>& boxes) {
  std::ofstream file(path);
  int first = 1;
  for (const Corners& box : boxes) {
    for (int k = 0; k < 8; ++k) {
      file << "v";
      for (int i = 0; i < 3; ++i) file << " " << ((k >> i & 1) != 0 ? box.high[i] : box.low[i]);
      file << "\n";
    }
    for (const auto& f : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                          std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
      file << "f";
      for (const int v : f) file << " " << first + v;
      file << "\n";
    }
    first += 8;
  }
}

/// A hole of 20 x 20, 30 deep, along an axis: four walls, open at both ends.
std::vector<Corners> walls(int axis) {
  std::vector<Corners> boxes;
  for (const auto& [x0, x1, y0, y1] :
       {std::array{-30.0, -10.0, -30.0, 30.0}, std::array{10.0, 30.0, -30.0, 30.0},
        std::array{-10.0, 10.0, -30.0, -10.0}, std::array{-10.0, 10.0, 10.0, 30.0}}) {
    Corners c{};
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    c.low[u] = x0;
    c.high[u] = x1;
    c.low[v] = y0;
    c.high[v] = y1;
    c.low[axis] = -15;
    c.high[axis] = 15;
    boxes.push_back(c);
  }
  return boxes;
}

haptic::SceneParameters parameters_in(const std::string& scene) {
  const haptic::tools::SceneBytes bytes = haptic::tools::read_scene_bytes(scene);
  haptic::SceneView view;
  REQUIRE(haptic::SceneView::open(bytes.span(), view) == haptic::RtStatus::kOk);
  return view.parameters();
}

struct DraftBench {
  std::string name = "peg";
  ScratchFolder folder{"draft"};
  std::string peg = folder.file("peg.obj"), hole = folder.file("hole.obj");

  SceneDraft draft() const {
    DraftRequest request;
    request.moving = peg;
    request.fixed = {hole};
    request.folder = folder.file("");
    request.name = name;
    return draft_scene(request);
  }
  static bool says(const SceneDraft& draft, const std::string& words) {
    return std::ranges::any_of(draft.remarks, [&](const std::string& remark) {
      return remark.find(words) != std::string::npos;
    });
  }
};

}  // namespace

TEST_SUITE("tools.scene_draft") {
  TEST_CASE("the unit is that in which the part is like one that a hand holds") {
    CHECK(guessed_unit(66.0).scale_to_m == 0.001);
    CHECK(guessed_unit(0.066).scale_to_m == 1.0);
    CHECK(guessed_unit(5.0).scale_to_m == 0.001);
    CHECK(guessed_unit(1.9).scale_to_m == 1.0);
    CHECK(guessed_unit(50'000.0).scale_to_m == 1e-6);
    CHECK(guessed_unit(1e-5).scale_to_m == 1.0);
    CHECK(guessed_unit(1e9).scale_to_m == 1e-6);
    // Inches where nothing else is like the parts: 3 x 2 x 1, 2 x 1 x 1, 4 x 1 x 1.
    CHECK(guessed_unit(std::array{3.74, 2.45, 4.24}).scale_to_m == 0.0254);
    CHECK(std::string(guessed_unit(std::array{3.74, 2.45, 4.24}).name) == "inches");
    // One alone, beside others that state their unit, is a small part.
    for (const double diagonal : {2.0, 2.45, 3.74, 4.24, 4.8}) {
      CAPTURE(diagonal);
      CHECK(guessed_unit(diagonal).scale_to_m == 0.001);
    }
    // A screw M2 of 6 mm is none of metres; a smaller pin goes by the plate that it goes into.
    CHECK(guessed_unit(std::hypot(2.0, 2.0, 6.0)).scale_to_m == 0.001);
    CHECK(guessed_unit(std::array{std::hypot(2.0, 2.0, 6.0), 71.0}).scale_to_m == 0.001);
    CHECK(guessed_unit(std::array{std::hypot(1.6, 1.6, 3.0), 28.7}).scale_to_m == 0.001);
    CHECK(guessed_unit(std::array{1.8, 40.0}).scale_to_m != 1.0);
    // Pins, nuts and washers of 2 to 5 mm among themselves.
    for (const auto& [a, b] : {std::array{std::hypot(1, 1, 4), std::hypot(3, 3, 4)},
                               {std::hypot(2, 2, 2), std::hypot(4, 4, 2)},
                               {std::hypot(3.2, 3.2, 1.3), std::hypot(3, 3, 5)},
                               {std::hypot(2, 2, 2), std::hypot(2, 2, 3)},
                               {std::hypot(2, 2, 5), std::hypot(5, 5, 0.3)}}) {
      const auto& first = a;
      CAPTURE(first);
      CHECK(guessed_unit(std::array{a, b}).scale_to_m == 0.001);
    }
    CHECK(guessed_unit(std::array{2.12, 4.7}).scale_to_m == 0.0254);
    CHECK(guessed_unit(std::array{0.75, 4.7}).scale_to_m == 0.0254);
    CHECK(guessed_unit(std::array{0.3, 1.9}).scale_to_m == 1.0);
  }

  TEST_CASE("inches are guessed and named, with what else the unit could be") {
    DraftBench bench;
    write_boxes(bench.peg, {{{-0.5, -0.5, -1}, {0.5, 0.5, 1}}});
    write_boxes(bench.hole, {{{-1.5, -1.5, -2}, {1.5, 1.5, -1}}});
    const SceneDraft draft = bench.draft();
    CHECK(draft.scale_to_m == 0.0254);
    CHECK(bench.says(draft, "unit: inches, guessed, so that " + bench.peg + " is 62.2 mm across"));
    CHECK(draft.toml.find("scale_to_m = 0.0254  # guessed from the size: inches") !=
          std::string::npos);
    write_boxes(bench.peg, {{{-1, -1, -3}, {1, 1, 3}}});
    write_boxes(bench.hole, {{{-15, -15, -6}, {15, 15, -3}}});
    const SceneDraft screw = bench.draft();
    CHECK(screw.scale_to_m == 0.001);
    CHECK(bench.says(screw, "is 6.63 mm across (in inches, 0.0254, 168 mm)"));
    CHECK_FALSE(bench.says(screw, "are both in the same unit?"));
  }

  TEST_CASE("two files that go together in different units are asked about") {
    DraftBench bench;
    write_boxes(bench.peg, {{{-9, -9, -20}, {9, 9, 20}}});
    write_boxes(bench.hole, {{{-1, -1, -2}, {1, 1, -0.8}}});
    const SceneDraft inches = bench.draft();
    CHECK(inches.scale_to_m == 0.001);
    CHECK(bench.says(inches, bench.hole + ": in inches it would be 78 mm"));
    write_boxes(bench.hole, {{{-0.03, -0.03, -0.05}, {0.03, 0.03, -0.02}}});
    const SceneDraft metres = bench.draft();
    CHECK(metres.scale_to_m == 0.001);
    CHECK(bench.says(metres, bench.hole + ": in metres it would be 90 mm"));
  }

  TEST_CASE("a link of a robot description is drafted as scene files name it") {
    if (!haptic::tools::can_import()) {
      MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
      return;
    }
    DraftBench bench;
    write_boxes(bench.hole, walls(2));
    std::ofstream(bench.folder.file("r.urdf"))
        << "<robot><link name=\"base\"/><link name=\"tool\"><collision><geometry>"
           "<box size=\"0.018 0.018 0.04\"/></geometry></collision></link></robot>";
    const std::string urdf = bench.folder.file("r.urdf"), scene = bench.folder.file("s.toml");
    for (const std::string& parts :
         {urdf + "#tool " + bench.hole, bench.hole + " " + urdf + "#tool"}) {
      std::filesystem::remove(scene);
      const ProgramResult r = run_program(HAPTIC_GRAPH_COMPILER, "init " + parts + " -o " + scene);
      CAPTURE(r.err);
      REQUIRE(r.exit_code == 0);
      CHECK(text_of_file(scene).find("link = \"r.urdf#tool\"\n") != std::string::npos);
      CHECK(r.out.find("unit: millimetres, guessed, so that " + bench.hole) != std::string::npos);
      const ProgramResult compiled =
          run_program(HAPTIC_GRAPH_COMPILER, scene + " -o " + bench.folder.file("s.rtscene"));
      CAPTURE(compiled.err);
      CHECK(compiled.exit_code == 0);
    }
    const std::pair<std::string, const char*> refusals[] = {
        {urdf, "r.urdf: is a robot description; give a link of it"},
        {urdf, "r.urdf#LINK; its links with a collision model: 'tool'"},
        {urdf + "#", "its links with a collision model: 'tool'"},
        {urdf + "#base", "link 'base' has no <collision>"},
        {urdf + "#tol", "did you mean 'tool'?"},
        {bench.folder.file("none.urdf") + "#tool", "none.urdf"},
        {bench.folder.file("none.urdf"), "none.urdf"}};
    for (const auto& [given, says] : refusals) {
      const auto& tried = given;
      CAPTURE(tried);
      const ProgramResult r =
          run_program(HAPTIC_GRAPH_COMPILER,
                      "init " + given + " " + bench.hole + " -o " + bench.folder.file("t.toml"));
      CAPTURE(r.err);
      CHECK(r.exit_code == 3);
      CHECK(r.err.find(says) != std::string::npos);
    }
    const ProgramResult bare =
        run_program(HAPTIC_GRAPH_COMPILER, urdf + " -o " + bench.folder.file("t.rtscene"));
    CHECK(bare.exit_code == 3);
    CHECK(bare.err.find("or make one with graph_compiler init") != std::string::npos);
    // A file with a # in its name is no link.
    bench.peg = bench.folder.file("a.urdf#b.obj");
    write_boxes(bench.peg, {{{-9, -9, -20}, {9, 9, 20}}});
    CHECK(bench.draft().toml.find("mesh = \"a.urdf#b.obj\"") != std::string::npos);
  }

  TEST_CASE("a peg drawn in its hole starts outside of the opening, on the hole's axis") {
    for (int axis = 0; axis < 3; ++axis) {
      CAPTURE(axis);
      DraftBench bench;
      Corners peg{{-9, -9, -9}, {9, 9, 9}};
      peg.low[axis] = -20;
      peg.high[axis] = 20;
      write_boxes(bench.peg, {peg});
      write_boxes(bench.hole, walls(axis));
      const SceneDraft draft = bench.draft();
      CHECK(draft.scale_to_m == 0.001);
      CHECK(draft.way[static_cast<std::size_t>(axis)] == 1);
      for (int k = 0; k < 3; ++k)
        CHECK((draft.start_m[static_cast<std::size_t>(k)] > 0.035) == (k == axis));
      CHECK(bench.says(draft, "free of all fixed parts, by the exact verdict"));
      CHECK_FALSE(bench.says(draft, "overlap"));
      CHECK_FALSE(bench.says(draft, "no straight way"));
    }
  }

  TEST_CASE("a draft names the reference device, and what is felt is half of what that holds") {
    const haptic::DeviceParameters d = haptic::tools::drafted_device();
    const haptic::hal::DeviceCapabilities stated = haptic::hal::reference_capabilities();
    for (const auto& [drafted, reference] :
         {std::pair{d.mass_kg, stated.mass_kg},
          {d.damping_ns_per_m, stated.damping_ns_per_m},
          {d.coulomb_friction_n, stated.coulomb_friction_n},
          {d.encoder_step_m, stated.encoder_step_m},
          {d.encoder_step_rad, stated.encoder_step_rad},
          {d.max_force_n, stated.max_force_n},
          {d.max_torque_nm, stated.max_torque_nm},
          {d.max_force_rate_n_per_s, stated.max_force_rate_n_per_s},
          {d.max_torque_rate_nm_per_s, stated.max_torque_rate_nm_per_s}})
      CHECK(drafted == doctest::Approx(static_cast<double>(reference)).epsilon(1e-6));
    DraftBench bench;
    write_boxes(bench.peg, {{{-9, -9, -20}, {9, 9, 20}}});
    write_boxes(bench.hole, walls(2));
    const SceneDraft draft = bench.draft();
    const std::string scene = bench.folder.file("s.toml"), report = bench.folder.file("r.json");
    std::ofstream(scene) << draft.toml;
    const ProgramResult r =
        run_program(HAPTIC_GRAPH_COMPILER,
                    scene + " -o " + bench.folder.file("s.rtscene") + " --report " + report);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    const haptic::SceneParameters compiled = parameters_in(bench.folder.file("s.rtscene"));
    CHECK(compiled.device.given == 1);
    CHECK(compiled.coupling.damping_ns_per_m < 1e-5);  // the wrench is the spring's
    const haptic::tools::PassivityBudget budget = haptic::tools::passivity_budget(compiled, 0.025);
    CHECK(budget.holds());
    CHECK(compiled.coupling.k_t_n_per_m ==
          doctest::Approx(0.5 * haptic::tools::stiffness_boundary(budget.translation, 0)));
    CHECK(compiled.coupling.k_r_nm_per_rad ==
          doctest::Approx(0.5 * haptic::tools::stiffness_boundary(budget.rotation, 0)));
    // The comments say what comes of it.
    CHECK(draft.toml.find("half of what it holds: " +
                          haptic::tools::short_number(compiled.coupling.k_t_n_per_m, 3) + " N/m") !=
          std::string::npos);
    CHECK(draft.toml.find(
              "likewise: " + haptic::tools::short_number(compiled.coupling.k_r_nm_per_rad, 3) +
              " N m/rad") != std::string::npos);
  }

  TEST_CASE("a peg that is larger than its hole, and one of another unit, are remarked on") {
    DraftBench bench;
    write_boxes(bench.peg, {{{-10.5, -10.5, -20}, {10.5, 10.5, 20}}});
    write_boxes(bench.hole, walls(2));
    const SceneDraft large = bench.draft();
    CHECK(bench.says(large, "the parts overlap by 0.5 mm"));
    CHECK(bench.says(large, "no straight way along an axis"));
    CHECK(bench.says(large, "free of all fixed parts"));
    write_boxes(bench.peg, {{{-0.009, -0.009, -0.02}, {0.009, 0.009, 0.02}}});
    if (HAPTIC_REAL_IS_FLOAT) {  // a hole of 45 m is beyond what it resolves for such a peg
      std::string refusal;
      try {
        static_cast<void>(bench.draft());
      } catch (const haptic::tools::InputError& error) {
        refusal = error.what();
      }
      CHECK(refusal.find("coordinates reach 45 m from the origin of W, where single precision "
                         "resolves too little") != std::string::npos);
      return;
    }
    const SceneDraft odd = bench.draft();
    CHECK(odd.scale_to_m == 1.0);
    CHECK(bench.says(odd, "are both in the same unit?"));
  }

  TEST_CASE(
      "parts that are drawn in place and touch, or have room, are told so, solids and surfaces") {
    // A plug on the floor of its hole; the floor is a piece of its own, so that seams end beside
    // it.
    std::vector<Corners> hole = walls(2);
    hole.push_back({{-10, -10, -15}, {10, 10, -5}});
    for (const bool surface : {false, true}) {
      CAPTURE(surface);
      DraftBench bench;
      const auto told = [&](double half, double bottom) {
        write_boxes(bench.hole, hole);
        write_boxes(bench.peg, {{{-half, -half, bottom}, {half, half, 20}}});
        // A loose triangle within: the part is a surface then.
        if (surface) {
          std::ofstream(bench.peg, std::ios::app) << "v 0 0 18\nv 1 0 18\nv 0 1 18\nf 9 10 11\n";
        }
        return bench.draft();
      };
      const SceneDraft snug = told(10.0, -5.0);
      CHECK(bench.says(snug, "the parts touch, and are free"));
      const SceneDraft standing = told(9.96, -5.0);
      CHECK(bench.says(standing, "the parts touch, and are free"));
      const SceneDraft hanging = told(9.96, -4.5);
      CHECK(bench.says(hanging, "the parts are 0.04 mm apart"));
      // Rounding of coordinates, in the last digits that a file of floats has.
      const SceneDraft rounded = told(10.00000001, -5.00000001);
      CHECK(bench.says(rounded, "the parts touch, and are free"));
      for (const SceneDraft* draft : {&snug, &standing, &hanging, &rounded}) {
        CHECK_FALSE(bench.says(*draft, "overlap"));
        CHECK_FALSE(bench.says(*draft, "cannot go there"));
        CHECK_FALSE(bench.says(*draft, "no straight way"));
        CHECK(draft->way == std::array<int, 3>{0, 0, 1});
      }
      // The probes: a hundredth of a millimetre too wide, and too long.
      for (const SceneDraft& deep : {told(10.01, -5.0), told(9.96, -5.01)}) {
        CHECK(bench.says(deep, surface ? "where the files have it the part meets face"
                                       : "the parts overlap by 0.01 mm"));
        CHECK_FALSE(bench.says(deep, "touch"));
      }
    }
  }

  TEST_CASE("a part that fills a piece of its hole in flush faces alone is told to overlap") {
    // No edge of one passes through the other: the faces all round are the same.
    DraftBench bench;
    write_boxes(bench.peg, {{{-10, -10, -10}, {10, 10, 10}}});
    write_boxes(bench.hole, {{{-10, -10, 5}, {10, 10, 30}}});
    CHECK(bench.says(bench.draft(), "the parts overlap by 5 mm"));
    write_boxes(bench.hole, {{{-10, -10, 10}, {10, 10, 30}}});
    CHECK(bench.says(bench.draft(), "the parts touch, and are free"));
  }

  TEST_CASE("a part in the mouth of a piece that its seam alone parts from it touches") {
    // An L of two pieces: their seam goes on from the faces that the block lies in. As deep as the
    // next face of the mesh is from the block's corner, nothing overlaps.
    DraftBench bench;
    std::ofstream(bench.hole)
        << "v 0 0 0\nv 40 0 0\nv 40 0 10\nv 10 0 10\nv 10 0 40\nv 0 0 40\n"
           "v 0 30 0\nv 40 30 0\nv 40 30 10\nv 10 30 10\nv 10 30 40\nv 0 30 40\n"
           "f 1 2 3 4 5 6\nf 12 11 10 9 8 7\nf 1 7 8 2\nf 2 8 9 3\nf 3 9 10 4\nf 4 10 11 5\n"
           "f 5 11 12 6\nf 6 12 7 1\n";
    write_boxes(bench.peg, {{{10, 0, 10}, {30, 30, 30}}});
    const SceneDraft draft = bench.draft();
    CHECK(bench.says(draft, "the parts touch, and are free"));
    CHECK_FALSE(bench.says(draft, "overlap"));
  }

  TEST_CASE("a sheet, which has no depth, is left along the way with the fewest collisions") {
    DraftBench bench;
    std::ofstream(bench.hole) << "v -30 -30 0\nv 30 -30 0\nv 30 30 0\nv -30 30 0\nf 1 2 3 4\n";
    write_boxes(bench.peg, {{{-9, -9, -5}, {9, 9, 35}}});
    const SceneDraft across = bench.draft();
    CHECK(across.way == std::array<int, 3>{0, 0, 1});
    CHECK(across.start_m[2] > 0.005);
    CHECK(bench.says(across, "free of all fixed parts, by an exact test of their facets"));
    CHECK(bench.says(across, "the part meets face 1 of " + bench.hole));
    CHECK(bench.says(across, "of 50 places colliding"));
    write_boxes(bench.peg, {{{-9, -9, 5}, {9, 9, 35}}});
    const SceneDraft above = bench.draft();
    CHECK(bench.says(above, "free of all fixed parts"));
    CHECK_FALSE(bench.says(above, "where the files have it the part"));
    CHECK_FALSE(bench.says(above, "no straight way"));
  }

  TEST_CASE("a file that states its unit is not scaled; the unit of the others is guessed") {
    if (!haptic::tools::can_import()) {
      MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
      return;
    }
    DraftBench bench;
    bench.peg = bench.folder.file("peg.amf");
    std::ofstream(bench.peg) << haptic::tools::test::tetrahedron_amf("unit=\"inch\"");
    write_boxes(bench.hole, {{{-30, -30, -5}, {30, 30, 0}}});
    const SceneDraft draft = bench.draft();
    CHECK(draft.scale_to_m == 0.001);
    CHECK(bench.says(draft, "guessed, so that " + bench.hole));
    // Of the two tables only the second has a scale.
    const std::size_t scale = draft.toml.find("scale_to_m");
    CHECK(scale > draft.toml.find("[[static]]"));
    CHECK(draft.toml.find("scale_to_m", scale + 1) == std::string::npos);
    // Above the plate: a tetrahedron of 25.4 mm, and a tenth of its size between them.
    CHECK(draft.way == std::array<int, 3>{0, 0, 1});
    CHECK(draft.start_m[2] == doctest::Approx(0.1 * 0.0254 * std::sqrt(3.0)).epsilon(0.1));
    write_boxes(bench.hole, {{{-300, -300, -5}, {300, 300, 0}}});
    CHECK_FALSE(bench.says(bench.draft(), "are both in the same unit?"));
  }

  TEST_CASE("a line break in the name of a file leaves the scene file valid") {
    DraftBench bench;
    bench.peg = bench.folder.file("a\nb\x7F.obj");
    write_boxes(bench.peg, {{{-9, -9, -20}, {9, 9, 20}}});
    write_boxes(bench.hole, walls(2));
    bench.name = "a\nb";
    CHECK(bench.draft().toml.find("name = \"a b\"\n") != std::string::npos);
    CHECK(bench.draft().toml.find("mesh = \"a\\u000Ab\\u007F.obj\"\n") != std::string::npos);
  }

  TEST_CASE("the program writes a scene file that compiles, and overwrites nothing") {
    DraftBench bench;
    write_boxes(bench.peg, {{{-9, -9, -20}, {9, 9, 20}}});
    write_boxes(bench.hole, walls(2));
    const std::string scene = bench.folder.file("scene.toml");
    const std::string call = "init " + bench.peg + " " + bench.hole + " -o " + scene;
    const ProgramResult r = run_program(HAPTIC_GRAPH_COMPILER, call + " --stiffness 500");
    CHECK(r.exit_code == 0);
    CHECK(r.err.empty());
    CHECK(r.out.find("unit: millimetres, guessed") != std::string::npos);
    const std::string text = text_of_file(scene);
    CHECK(text.find("mesh = \"peg.obj\"") != std::string::npos);
    CHECK(text.find("k_f_n_per_m = 500") != std::string::npos);
    const ProgramResult compiled =
        run_program(HAPTIC_GRAPH_COMPILER, scene + " -o " + bench.folder.file("s.rtscene"));
    CHECK(compiled.exit_code == 0);
    const ProgramResult again = run_program(HAPTIC_GRAPH_COMPILER, call);
    CHECK(again.exit_code == 2);
    CHECK(again.err.find("scene.toml: exists already") != std::string::npos);
    CHECK(text_of_file(scene) == text);
    const ProgramResult over =
        run_program(HAPTIC_GRAPH_COMPILER, "init " + bench.peg + " " + bench.hole);
    CHECK(over.exit_code == 2);
    const ProgramResult missing = run_program(
        HAPTIC_GRAPH_COMPILER, "init " + bench.peg + " " + bench.folder.file("none.obj") + " -o " +
                                   bench.folder.file("t.toml"));
    CHECK(missing.exit_code == 3);
    CHECK(missing.err.find("none.obj") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(bench.folder.file("t.toml")));
  }
}
