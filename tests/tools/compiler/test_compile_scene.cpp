// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "rt_core/haptic_core.hpp"
#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/scene_facts/scene_facts.hpp"

using namespace haptic;
using namespace haptic::tools;
using namespace haptic::test;
using haptic::sim::test::ScratchFolder;
using Json = nlohmann::json;

namespace {

CompiledScene compile_file(const std::string& path) {
  return compile_scene(read_scene_file(path), {});
}

SceneFacts facts_of_compiled(const CompiledScene& compiled) {
  const SceneBytes bytes{compiled.bytes};
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  REQUIRE(HapticCore::state_bytes(view) == view.header().capacity.state_bytes);
  return facts_of(view);
}

void check_sound(const SceneFacts& facts, bool cover) {
  for (const BodyFacts& body : facts.bodies) {
    CAPTURE(body.name);
    CHECK(body.recheck.convex);
    CHECK(body.recheck.source_conflicts == 0);
    if (!cover) CHECK(body.recheck.separated_pairs == body.recheck.piece_pairs);
  }
}

}  // namespace

TEST_SUITE("tools.compile_scene") {
  TEST_CASE("the project's own scenes compile to the expected pieces and graphs") {
    struct Expected {
      const char* name;
      std::size_t moving, fixed;
      std::uint64_t nodes;
    };
    for (const Expected& expected :
         {Expected{"tetrahedron_on_box", 1, 1, 128}, Expected{"square_peg_five", 1, 5, 1200},
          Expected{"ell_insert", 2, 6, 2880}}) {
      CAPTURE(expected.name);
      const std::string path = std::string(HAPTIC_SCENES_DIR) + "/" + expected.name + "/scene.toml";
      REQUIRE(std::filesystem::exists(path));
      const CompiledScene compiled = compile_file(path);
      REQUIRE(compiled.parts.size() == 2);
      CHECK(compiled.parts[0].pieces.size() == expected.moving);
      CHECK(compiled.parts[1].pieces.size() == expected.fixed);
      for (const PartReport& part : compiled.parts) {
        CHECK(part.certificate.holds());
        CHECK(part.warnings.empty());
      }
      const SceneFacts facts = facts_of_compiled(compiled);
      CHECK(facts.nodes == expected.nodes);
      CHECK(facts.name == expected.name);
      check_sound(facts, false);
      // The same bytes again, in the same process.
      CHECK(compile_file(path).bytes == compiled.bytes);
    }
  }

  TEST_CASE("real parts: pieces, certificate, volumes, sound geometry") {
    if (!std::filesystem::exists(shared_part("square_peg"))) {
      MESSAGE("skipped: no shared parts");
      return;
    }
    for (const std::string& name : compilable_parts()) {
      CAPTURE(name);
      const ScratchFolder folder("compile");
      const std::string path = write_part_scene(name, folder);
      const Json task = read_json(shared_part(name) + "/task.json");
      const CompiledScene compiled = compile_file(path);
      const SceneFacts facts = facts_of_compiled(compiled);
      const bool cover = compiled.parts[1].certificate.cover;
      check_sound(facts, cover);
      const char* roles[2] = {"moving", "static"};
      for (std::size_t i = 0; i < 2; ++i) {
        const PartReport& part = compiled.parts[i];
        CHECK(part.certificate.holds());
        // The counts of other exact methods are a guide; never more pieces than they need.
        CHECK(part.pieces.size() <= task["convex_pieces"][roles[i]].get<std::size_t>());
        const Json& volume = task[roles[i]]["volume_m3"];
        if (volume.is_number() && !part.certificate.cover) {
          CHECK(part.volume_m3 == doctest::Approx(volume.get<double>()).epsilon(2e-5));
        }
        CHECK(part.largest_move_m <= 4 * part.plane_tolerance_m);
      }
      CHECK(facts.parameters.start_p_wa_m[0] == task["start_pose"]["position_m"][0].get<double>());
      MESSAGE(name << ": " << compiled.parts[0].pieces.size() << " / "
                   << compiled.parts[1].pieces.size() << " pieces, " << facts.nodes << " nodes, "
                   << facts.bytes << " bytes");
    }
  }

  TEST_CASE("a pose of a static part and a grip reach the scene") {
    const ScratchFolder folder("compile");
    write_cube(folder.file("cube.obj"));
    std::ofstream(folder.file("scene.toml"))
        << "format = 1\nname = \"posed\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
           "[start]\nposition_m = [0.0, 0.0, 0.5]\n"
           "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = [0.1, 0.2, 0.3]\n"
           "position_m = [1, 2, 3]\nquaternion = { w = 0.6, x = 0.8, y = 0, z = 0 }\n"
           "[rendering]\nlaw = \"paper\"\nk_f_n_per_m = 100\n";
    const CompiledScene compiled = compile_file(folder.file("scene.toml"));
    const SceneBytes bytes{compiled.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    // The default grip is the centre of volume: the cube's corners are at +-0.005 about it.
    CHECK(view.bodies()[0].reference_m[0] == doctest::Approx(0.005));
    const PieceView piece = view.piece(0);
    for (std::uint32_t v = 0; v < 8; ++v) {
      CHECK(std::abs(static_cast<double>(piece.vertices[3 * v])) == doctest::Approx(0.005));
    }
    // Corner (0, 0.2, 0) of the static box, turned about x: cos = -0.28, sin = 0.96.
    const PieceView fixed = view.piece(1);
    const double* r = view.bodies()[1].reference_m;
    bool found = false;
    for (std::uint32_t v = 0; v < 8; ++v) {
      const double x[3] = {static_cast<double>(fixed.vertices[3 * v]) + r[0] - 1.0,
                           static_cast<double>(fixed.vertices[3 * v + 1]) + r[1] - 2.0,
                           static_cast<double>(fixed.vertices[3 * v + 2]) + r[2] - 3.0};
      found = found || (std::abs(x[0]) < 1e-6 && std::abs(x[1] + 0.056) < 1e-6 &&
                        std::abs(x[2] - 0.192) < 1e-6);
    }
    CHECK(found);
    CHECK(view.parameters().start_p_wa_m[2] == 0.5);
  }

  TEST_CASE("a part far from the origin of its file compiles to the same graph") {
    const ScratchFolder folder("compile");
    write_cube(folder.file("near.obj"));
    write_cube(folder.file("far.obj"), 1000.0);
    const auto scene = [&](const char* mesh, const char* position) {
      std::ofstream(folder.file("scene.toml"))
          << "format = 1\nname = \"far\"\n[moving]\nmesh = \"near.obj\"\nscale_to_m = 0.01\n"
             "[[static]]\nmesh = \""
          << mesh << "\"\nscale_to_m = 0.125\nposition_m = " << position
          << "\n[rendering]\nk_f_n_per_m = 100\n";
      return compile_file(folder.file("scene.toml"));
    };
    const CompiledScene near = scene("near.obj", "[0, 0, 0]");
    const CompiledScene far = scene("far.obj", "[-125, -125, -125]");
    const SceneBytes near_bytes{near.bytes}, far_bytes{far.bytes};
    SceneView a, b;
    REQUIRE(SceneView::open(near_bytes.span(), a) == RtStatus::kOk);
    REQUIRE(SceneView::open(far_bytes.span(), b) == RtStatus::kOk);
    for (std::uint32_t i = 0; i < 24; ++i) {
      CHECK(a.piece(1).vertices[i] == b.piece(1).vertices[i]);
    }
  }

  TEST_CASE("a budget that is exceeded is named with its place and a breakdown") {
    const ScratchFolder folder("compile");
    write_cube(folder.file("cube.obj"));
    const auto message = [&](const std::string& budget) -> std::string {
      std::ofstream(folder.file("scene.toml"))
          << "format = 1\nname = \"b\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
             "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.1\n[rendering]\nk_f_n_per_m = 100\n"
             "[budget]\n"
          << budget << "\n";
      try {
        compile_file(folder.file("scene.toml"));
      } catch (const InputError& error) {
        return error.what();
      }
      return "accepted";
    };
    CHECK(message("constants_bytes = 100000\nstate_bytes = 1000000") == "accepted");
    const std::string constants = message("constants_bytes = 5000");
    CHECK(constants.find("scene.toml:12:19: the scene needs") != std::string::npos);
    CHECK(constants.find("bytes of constants, the budget allows 5 000") != std::string::npos);
    CHECK(constants.find("neighbors") != std::string::npos);
    const std::string state = message("constants_bytes = 100000\nstate_bytes = 64");
    CHECK(state.find("scene.toml:13:15: the scene needs") != std::string::npos);
    CHECK(state.find("bytes of state") != std::string::npos);
  }

  TEST_CASE("a facet near the origin of its body is merged as flat as its coordinates are") {
    // Two triangles with a fold of 4e-15 m, in the middle of a sheet of a metre.
    const ScratchFolder folder("flat");
    std::ofstream(folder.file("sheet.obj"))
        << "v -1e-3 -1e-3 0\nv 1e-3 -1e-3 4e-15\nv 1e-3 1e-3 0\nv -1e-3 1e-3 4e-15\n"
           "v 0.5 0.5 0\nv 0.5 0.4 0\nv 0.4 0.5 0\nv -0.5 -0.5 0\nv -0.5 -0.4 0\nv -0.4 -0.5 0\n"
           "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 8 9 10\n";
    std::ofstream(folder.file("scene.toml"))
        << "format = 1\nname = \"flat\"\n[moving]\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
           "position_m = [0, 0, 0.1]\n[[static]]\nmesh = \"sheet.obj\"\nscale_to_m = 1\n"
           "[rendering]\nk_f_n_per_m = 800\n";
    const CompiledScene compiled = compile_file(folder.file("scene.toml"));
    REQUIRE(compiled.parts[1].surface);
    // In single precision coordinates of a millimetre round by 6e-11 m: the fold is none.
    CHECK(compiled.parts[1].surface->facets == (HAPTIC_REAL_IS_FLOAT ? 3 : 4));
    facts_of_compiled(compiled);
  }

  TEST_CASE("the report holds the promised keys and repeats except for its timing") {
    const std::string path = std::string(HAPTIC_SCENES_DIR) + "/square_peg_five/scene.toml";
    Json first = Json::parse(report_as_json(compile_file(path)));
    Json second = Json::parse(report_as_json(compile_file(path)));
    for (const char* key :
         {"scene", "parts", "pairs", "sections", "capacity", "state_bytes", "warnings", "timing"}) {
      CHECK(first.contains(key));
    }
    const Json& fixed = first["parts"][1];
    CHECK(fixed["pieces"].size() == 5);
    CHECK(fixed["certificate"]["holds"] == true);
    CHECK(fixed["reflex_edges"] == 8);
    CHECK(first["pairs"][0]["nodes"] == 240);
    CHECK(first["pairs"][0]["arcs"] == 2640);
    CHECK(first["pairs"][0]["max_degree"] == 31);
    CHECK(first["pairs"][0]["near_capacity"] < 240);  // of the nodes that can carry force
    CHECK(first["pairs"][0]["graph"] == "formed");    // as of every pair with marks
    CHECK(first["capacity"]["certifiable"] == true);
    CHECK(first["capacity"]["unproven"].empty());
    CHECK(first["graph_budget_bytes"] == kDefaultGraphBytes);
    const Json& pruning = first["pruning"];
    CHECK(pruning["pruned"] == true);
    CHECK(pruning["pairs"] == 5);
    CHECK(pruning["nodes"]["all"] == 1200);
    CHECK(pruning["live"]["all"] < 1200);
    CHECK(pruning["faces"]["hidden"] > 0);
    // The total is of the whole compilation, not the sum of what is listed.
    const Json& timing = first["timing"];
    double listed_s = timing["exposure_s"].get<double>() + timing["write_s"].get<double>();
    for (const Json& part : timing["parts"]) listed_s += part["decompose_s"].get<double>();
    CHECK(timing["total_s"].get<double>() > listed_s);
    first.erase("timing");
    second.erase("timing");
    CHECK(first == second);
  }
}
