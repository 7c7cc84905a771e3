// SPDX-License-Identifier: Apache-2.0
// graph_compiler and scene_inspect as a user runs them: exit codes, files, streams.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/compiler/part_scenes.hpp"

using namespace haptic::test;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
namespace fs = std::filesystem;

namespace {

const std::string kScene = std::string(HAPTIC_SCENES_DIR) + "/tetrahedron_on_box/scene.toml";

ProgramResult compile(const std::string& arguments) {
  return run_program(HAPTIC_GRAPH_COMPILER, arguments);
}
ProgramResult inspect(const std::string& arguments) {
  return run_program(HAPTIC_SCENE_INSPECT, arguments);
}

std::size_t file_count(const std::string& folder) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

}  // namespace

TEST_SUITE("tools.programs") {
  TEST_CASE("graph_compiler writes the scene and its report, says a summary, exits 0") {
    const ScratchFolder folder("programs");
    const ProgramResult r = compile(kScene + " --full -o " + folder.file("a.rtscene") +
                                    " --report " + folder.file("a.json"));
    CHECK(r.exit_code == 0);
    CHECK(r.err.empty());
    for (const char* word : {"moving tetrahedron.obj", "certificate: convex, partition",
                             "128 nodes, 1 332 arcs", "neighbors", "time"}) {
      CAPTURE(word);
      CHECK(r.out.find(word) != std::string::npos);
    }
    CHECK(read_json(folder.file("a.json"))["nodes"] == 128);
    CHECK(file_count(folder.file("")) == 2);
    const ProgramResult json = compile(kScene + " --json -o " + folder.file("c.rtscene"));
    CHECK(nlohmann::json::parse(json.out).contains("parts"));
    std::filesystem::remove(folder.file("c.rtscene"));
    const ProgramResult quiet = compile(kScene + " --quiet -o " + folder.file("b.rtscene"));
    CHECK(quiet.exit_code == 0);
    CHECK(quiet.out.empty());
    CHECK(quiet.err.empty());
    CHECK(text_of_file(folder.file("a.rtscene")) == text_of_file(folder.file("b.rtscene")));
  }

  TEST_CASE("the summary is ten lines: parts, pairs, tick, stiffness, memory, certificate last") {
    const ScratchFolder folder("programs");
    const std::string out = folder.file("a.rtscene");
    const auto lines_of = [&](const std::string& scene) {
      const ProgramResult r =
          compile(std::string(HAPTIC_SCENES_DIR) + "/" + scene + "/scene.toml -o " + out);
      CHECK(r.exit_code == 0);
      CHECK(r.err.empty());
      std::istringstream text(r.out);
      std::vector<std::string> lines;
      for (std::string line; std::getline(text, line);) lines.push_back(line);
      return lines;
    };
    for (const char* scene : {"square_peg_five", "tetrahedron_on_box", "gear_on_shaft"}) {
      CAPTURE(scene);
      const std::vector<std::string> lines = lines_of(scene);
      CHECK(lines.size() <= 10);
      REQUIRE(lines.size() >= 9);
      CHECK(lines.front().find(std::string("'") + scene + "'") != std::string::npos);
      for (const char* word : {"moving ", "static ", "pairs ", "tick ", "stiffness ", "memory ",
                               "warnings     none", "written "}) {
        CAPTURE(word);
        CHECK(std::ranges::any_of(lines,
                                  [&](const std::string& line) { return line.starts_with(word); }));
      }
      CHECK(lines.back().starts_with("certificate  no list of a tick can overflow"));
    }
    // What a part is made of, and its volume, in one line.
    const std::vector<std::string> peg = lines_of("square_peg_five");
    CHECK(peg[1] ==
          "moving       peg.off: solid: closed, 0 reflex edges; 6 faces, 1 convex piece; solids 1, "
          "volume 2.4e-05 m3");
    // Many parts are not listed.
    const std::vector<std::string> pins = lines_of("two_pins");
    CHECK(pins.size() <= 10);
    CHECK(pins[2].ends_with("; and 1 more part (--full lists it)"));
  }

  TEST_CASE("ten lines also where there is much to note; --full and --json have all of it") {
    const ScratchFolder folder("programs");
    const std::string scene = folder.file("scene.toml"), out = " -o " + folder.file("a.rtscene");
    write_cube(folder.file("cube.obj"));
    std::ofstream file(scene);
    file << "format = 1\nname = \"n\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.001\n"
            "material = \"steel\"\nposition_m = [0, 0, 0.02]\n";
    for (int k = 0; k < 12; ++k) {
      file << "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.001\nmaterial = \"m" << k
           << "\"\nposition_m = [" << 0.01 * k << ", 0, 0]\n";
    }
    file << "[rendering]\nk_f_n_per_m = 800\n";
    file.close();
    const ProgramResult brief = compile(scene + out);
    CAPTURE(brief.out);
    REQUIRE(brief.exit_code == 0);
    CHECK(std::ranges::count(brief.out, '\n') == 10);
    // In single precision there is one more to note: its rounding raises the tolerance of the
    // proxy.
    const char* const more = HAPTIC_REAL_IS_FLOAT ? "(and 12 more; --full" : "(and 11 more; --full";
    CHECK(brief.out.find(std::string(more) + " lists them)") != std::string::npos);
    const ProgramResult full = compile(scene + " --full" + out);
    const ProgramResult json = compile(scene + " --json" + out);
    CHECK((full.out.find("rounding raises the tolerance of law proxy") != std::string::npos) ==
          HAPTIC_REAL_IS_FLOAT);
    for (int k = 0; k < 12; ++k) {
      const std::string word = "cube.obj of m" + std::to_string(k) + ": coefficient 0";
      CAPTURE(word);
      CHECK(full.out.find(word) != std::string::npos);
      CHECK(json.out.find(word) != std::string::npos);
    }
  }

  TEST_CASE("the needed basic contacts are reported, and all of them kept with --no-prune") {
    const ScratchFolder folder("programs");
    const std::string scene = std::string(HAPTIC_SCENES_DIR) + "/square_peg_five/scene.toml";
    const std::string out =
        " --full -o " + folder.file("a.rtscene") + " --report " + folder.file("a.json");
    const ProgramResult r = compile(scene + out);
    CHECK(r.exit_code == 0);
    CHECK(r.out.find("needed basic contacts: 1 moving and 5 static pieces") != std::string::npos);
    const nlohmann::json pruned = read_json(folder.file("a.json"))["pruning"];
    CHECK(pruned["pruned"] == true);
    CHECK(pruned["live"]["all"] < pruned["nodes"]["all"]);
    const ProgramResult kept = compile(scene + " --no-prune" + out);
    CHECK(kept.exit_code == 0);
    CHECK(kept.out.find("all are kept, as asked") != std::string::npos);
    const nlohmann::json all = read_json(folder.file("a.json"))["pruning"];
    CHECK(all["pruned"] == false);
    CHECK(all["live"] == all["nodes"]);
    CHECK(all["nodes"] == pruned["nodes"]);
    CHECK(all["faces"]["hidden"] == 0);
  }

  TEST_CASE("the same bytes from another working directory and by another path") {
    const ScratchFolder folder("programs");
    const fs::path scene_folder = fs::path(kScene).parent_path();
    const ProgramResult a = compile(kScene + " --quiet -o " + folder.file("a.rtscene"));
    const std::string here =
        "cd '" + scene_folder.string() + "' && '" + HAPTIC_GRAPH_COMPILER + "'";
    const ProgramResult b = run_program(
        "/bin/sh", "-c \"" + here + " scene.toml --quiet -o '" + folder.file("b.rtscene") + "'\"");
    REQUIRE(a.exit_code == 0);
    REQUIRE(b.exit_code == 0);
    const std::string bytes = text_of_file(folder.file("a.rtscene"));
    CHECK(bytes == text_of_file(folder.file("b.rtscene")));
    CHECK(bytes.find(scene_folder.string()) == std::string::npos);
  }

  TEST_CASE("usage errors exit 2 and write nothing") {
    const ScratchFolder folder("programs");
    const std::string out = " -o " + folder.file("a.rtscene");
    CHECK(compile("").exit_code == 2);
    CHECK(compile(kScene).exit_code == 2);
    CHECK(compile(kScene + out + " --nonsense").exit_code == 2);
    CHECK(compile(kScene + out + " --plane-tolerance -1").exit_code == 2);
    CHECK(compile(kScene + out + " --max-reflex many").exit_code == 2);
    CHECK(compile(kScene + out + " --report " + folder.file("a.rtscene")).exit_code == 2);
    CHECK(compile(kScene + " -o " + kScene).exit_code == 2);
    CHECK(inspect("").exit_code == 2);
    CHECK(compile("--version").exit_code == 0);
    CHECK(compile("--help").exit_code == 0);
    CHECK(file_count(folder.file("")) == 0);
  }

  TEST_CASE("over its budget exits 1 and writes nothing; --traits writes the header of an image") {
    const ScratchFolder folder("programs");
    const std::string scene = folder.file("scene.toml");
    const std::string meshes = fs::path(kScene).parent_path().string();
    const auto write = [&](const std::string& budget) {
      std::ofstream(scene) << "format = 1\nname = \"b\"\n[moving]\nmesh = \"" << meshes
                           << "/tetrahedron.obj\"\nscale_to_m = 0.001\n[[static]]\nmesh = \""
                           << meshes << "/box.stl\"\nscale_to_m = 0.001\n[rendering]\n"
                           << "k_f_n_per_m = 800\n[budget]\n"
                           << budget << "\n";
    };
    const std::string arguments = scene + " --quiet -o " + folder.file("a.rtscene") + " --traits " +
                                  folder.file("scene_image.hpp");
    write("state_bytes = 4096");
    const ProgramResult refused = compile(arguments);
    CHECK(refused.exit_code == 1);
    CHECK(refused.err.find("the budget allows 4 096") != std::string::npos);
    CHECK(file_count(folder.file("")) == 1);
    write("state_bytes = 100000");
    CHECK(compile(arguments + " --without contact_geometry").exit_code == 0);
    const std::string header = text_of_file(folder.file("scene_image.hpp"));
    CHECK(header.find(".contact_geometry = false,") != std::string::npos);
    CHECK(header.find(".laws = 4u,") != std::string::npos);
    CHECK(header.find(folder.file("")) == std::string::npos);
    CHECK(compile(arguments + " --without proxy").exit_code == 2);
    CHECK(
        compile(scene + " -o " + folder.file("b.rtscene") + " --traits " + folder.file("b.rtscene"))
            .exit_code == 2);
  }

  TEST_CASE("--certified writes what can be certified and refuses the rest with every reason") {
    const ScratchFolder folder("programs");
    const std::string out = " --quiet --certified -o " + folder.file("a.rtscene");
    CHECK(compile(kScene + out).exit_code == 0);
    CHECK(file_count(folder.file("")) == 1);
    fs::remove(folder.file("a.rtscene"));
    write_cube(folder.file("cube.obj"));
    const auto scene = [&](const char* budget) {
      std::ofstream(folder.file("scene.toml"))
          << "format = 1\nname = \"c\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
             "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.1\n"
             "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.2\nposition_m = [1, 0, 0]\n"
             "[rendering]\nlaw = \"paper\"\nk_f_n_per_m = 100\n"
          << budget;
      return folder.file("scene.toml");
    };
    const std::string one_visit = scene("[budget]\npair_visits = 1\n");
    const ProgramResult refused = compile(one_visit + out);
    CHECK(refused.exit_code == 1);
    CHECK(refused.err.find("not certified: 2 pairs can be near at once, a tick may search 1") !=
          std::string::npos);
    CHECK(refused.err.find("pair_visits = 2") != std::string::npos);
    CHECK(file_count(folder.file("")) == 2);  // the scene file and its mesh
    const ProgramResult brief = compile(one_visit + " -o " + folder.file("b.rtscene"));
    CHECK(brief.exit_code == 0);
    CHECK(brief.err.find("warning: not certified: 2 pairs can be near at once") !=
          std::string::npos);
    const std::size_t last = brief.out.rfind('\n', brief.out.size() - 2) + 1;
    CHECK(brief.out.find("warning      2 pairs can be near at once") == last);
    const ProgramResult shown = compile(one_visit + " --full -o " + folder.file("b.rtscene"));
    CHECK(shown.exit_code == 0);
    CHECK(shown.out.find("a tick may have to give up exactness") != std::string::npos);
    CHECK(shown.out.find("no [motion_limits]: no speed certificate") != std::string::npos);
    const ProgramResult inspected = inspect(folder.file("b.rtscene") + " --json");
    const auto facts = nlohmann::json::parse(inspected.out);
    CHECK(facts["capacity"]["certifiable"] == false);
    CHECK(facts["capacity"]["unproven"].size() == 1);
    CHECK(compile(scene("[budget]\npair_visits = 2\n") + out).exit_code == 0);
  }

  TEST_CASE("a scene with more near pairs than its list is not certified, and everybody says so") {
    const ScratchFolder folder("programs");
    write_cubes(folder.file("cubes.obj"), 65);
    const auto scene = [&](const std::string& budget) {
      std::ofstream(folder.file("scene.toml"))
          << "format = 1\nname = \"n\"\n[moving]\nmesh = \"cubes.obj\"\nscale_to_m = 0.001\n"
             "position_m = [0, 0, 0.5]\n[[static]]\nmesh = \"cubes.obj\"\nscale_to_m = 0.001\n"
             "[rendering]\nk_f_n_per_m = 100\n"
          << budget;
      return folder.file("scene.toml");
    };
    const std::string words =
        "4 225 pairs can be near at once, a tick follows 4 096; set [budget] "
        "near_pairs = 4225, ";
    const std::string one = scene("");
    const ProgramResult refused = compile(one + " --certified -o " + folder.file("a.rtscene"));
    CHECK(refused.exit_code == 1);
    CHECK(refused.err.find("not certified: " + words) != std::string::npos);
    CHECK(!fs::exists(folder.file("a.rtscene")));
    const ProgramResult said = compile(one + " -o " + folder.file("a.rtscene"));
    CHECK(said.exit_code == 0);
    CHECK(said.err.find("warning: not certified: " + words) != std::string::npos);
    CHECK(said.out.find("warning      " + words) == said.out.rfind('\n', said.out.size() - 2) + 1);
    CHECK(said.out.find("certificate") == std::string::npos);
    const ProgramResult inspected = inspect(folder.file("a.rtscene") + " --brief");
    CHECK(inspected.out.find("bounded     [limited]") != std::string::npos);
    const auto facts = nlohmann::json::parse(inspect(folder.file("a.rtscene") + " --json").out);
    CHECK(facts["capacity"]["certifiable"] == false);
    // The probe: with the key there is room for all.
    const ProgramResult certified = compile(scene("[budget]\nnear_pairs = 4225\n") +
                                            " --certified -o " + folder.file("a.rtscene"));
    CHECK(certified.exit_code == 0);
    CHECK(certified.err.empty());
    CHECK(certified.out.find("certificate  no list of a tick can overflow") != std::string::npos);
  }

  TEST_CASE("a graph without room is formed on the fly, and both programs say so") {
    const ScratchFolder folder("programs");
    const std::string scene = folder.file("scene.toml");
    write_cube(folder.file("cube.obj"));
    std::ofstream(scene)
        << "format = 1\nname = \"c\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
           "[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.1\n[rendering]\nk_f_n_per_m = 100\n"
           "[memory]\ngraph_bytes = 4000\n";
    const ProgramResult compiled = compile(scene + " --full -o " + folder.file("a.rtscene"));
    CHECK(compiled.exit_code == 0);
    CHECK(compiled.out.find("formed on the fly: stored it would take 13 kB of the 4.0 kB") !=
          std::string::npos);
    CHECK(inspect(folder.file("a.rtscene")).out.find("formed on the fly") != std::string::npos);
    const auto facts = nlohmann::json::parse(inspect(folder.file("a.rtscene") + " --json").out);
    CHECK(facts["pairs"][0]["graph"] == "formed");
    CHECK(facts["nodes"] == 240);
    CHECK(facts["arcs"] == 2640);
    CHECK(facts["stored_graph_bytes"] == 0);
  }

  TEST_CASE("a refusal exits 3 and leaves existing files as they were") {
    const ScratchFolder folder("programs");
    write_cube(folder.file("cube.obj"));
    std::ofstream(folder.file("scene.toml")) << "format = 1\nname = \"x\"\n[moving]\nmsh = 1\n";
    const std::string old_scene("RTSCENE\0old scene", 17), old_report = "{\"scene\": \"old\"}";
    std::ofstream(folder.file("old.rtscene")) << old_scene;
    std::ofstream(folder.file("old.json")) << old_report;
    const ProgramResult r =
        compile(folder.file("scene.toml") + " -o " + folder.file("old.rtscene") + " --report " +
                folder.file("old.json"));
    CHECK(r.exit_code == 3);
    CHECK(r.out.empty());
    CHECK(r.err.find("scene.toml:4:1: unknown key 'msh'") != std::string::npos);
    CHECK(text_of_file(folder.file("old.rtscene")) == old_scene);
    CHECK(text_of_file(folder.file("old.json")) == old_report);
    CHECK(file_count(folder.file("")) == 4);
    CHECK(compile(folder.file("absent.toml") + " -o " + folder.file("x.rtscene")).exit_code == 3);
  }

  TEST_CASE("an output that cannot be written exits 4 and leaves neither file") {
    const ScratchFolder folder("programs");
    const ProgramResult r = compile(kScene + " --quiet -o " + folder.file("a.rtscene") +
                                    " --report " + folder.file("no/such/folder.json"));
    CHECK(r.exit_code == 4);
    CHECK(r.err.find("folder.json") != std::string::npos);
    CHECK(file_count(folder.file("")) == 0);
    fs::create_directory(folder.file("taken"));
    CHECK(compile(kScene + " --quiet -o " + folder.file("taken")).exit_code == 4);
    CHECK(compile(kScene + " --quiet -o /dev/null").exit_code == 0);
    CHECK(fs::is_character_file("/dev/null"));
  }

  TEST_CASE("real parts that are no solids or too curved are refused without an output") {
    if (!fs::exists(shared_part("brick_stack"))) {
      MESSAGE("skipped: no shared parts");
      return;
    }
    for (const std::string& name : refused_parts()) {
      CAPTURE(name);
      const ScratchFolder folder("programs");
      const std::string scene = write_part_scene(name, folder);
      const ProgramResult r = compile(scene + " -o " + folder.file("x.rtscene"));
      CHECK(r.exit_code == 3);
      CAPTURE(r.err);
      const std::string words =
          name == "brick_stack" ? "2 edges without a partner" : "reflex edges, limit 300";
      CHECK(r.err.find(words) != std::string::npos);
      CHECK(file_count(folder.file("")) == 1);
    }
  }

  TEST_CASE("scene_inspect explains: page, drawing, budget") {
    const ScratchFolder folder("programs");
    const std::string source = std::string(HAPTIC_SCENES_DIR) + "/square_peg_five/scene.toml";
    const std::string scene = folder.file("a.rtscene");
    REQUIRE(compile(source + " --quiet -o " + scene).exit_code == 0);
    const ProgramResult page = inspect(scene + " --brief --explode " + folder.file("view"));
    CHECK(page.exit_code == 0);
    for (const char* word :
         {"Contents", "was made of 5 convex", "  convex      [holds]", "  bounded     [holds]",
          "Cost of a tick", "664 more stay to tell", "this scene       all kept",
          "piece 0 of 'socket.obj': 3 of 6, 10 of 12, 8 of 8; 0", "Where the memory goes", "law"}) {
      CAPTURE(word);
      CHECK(page.out.find(word) != std::string::npos);
    }
    CHECK(page.out.find("In detail") == std::string::npos);
    CHECK(file_count(folder.file("view")) == 2);
    CHECK(text_of_file(folder.file("view/exploded.obj")).find("usemtl seam") != std::string::npos);
    CHECK(inspect(scene + " --explode " + scene).exit_code == 4);
    CHECK(inspect(scene + " --explode-factor 1").exit_code == 2);
    CHECK(inspect(scene + " --explode x --explode-factor -1").exit_code == 2);
    const auto facts = nlohmann::json::parse(inspect(scene + " --json").out);
    CHECK(facts["pruning"]["missing"] == 0);
    CHECK(facts["pruning"]["live"]["all"] == 536);
    CHECK(facts["certificates"].size() == 5);
    CHECK(facts["memory"]["state_bytes"] == facts["capacity"]["state_bytes"]);
    // Budgets: the scene's own file without and with limits, and that of another scene.
    CHECK(inspect(scene + " --budget " + source).out.find("[budget] names none") !=
          std::string::npos);
    const std::string meshes = fs::path(source).parent_path().string();
    std::ofstream(folder.file("tight.toml"))
        << "format = 1\nname = \"square_peg_five\"\n[moving]\nmesh = \"" << meshes
        << "/peg.off\"\nscale_to_m = 1.0\n[[static]]\nmesh = \"" << meshes
        << "/socket.obj\"\nscale_to_m = 1.0\n[rendering]\nk_f_n_per_m = 800\n"
           "[budget]\nstate_bytes = 4096\n";
    const ProgramResult over = inspect(scene + " --budget " + folder.file("tight.toml"));
    CHECK(over.exit_code == 1);
    CHECK(over.out.find("OVER ITS BUDGET") != std::string::npos);
    const ProgramResult other = inspect(scene + " --budget " + kScene);
    CHECK(other.exit_code == 3);
    CHECK(other.err.find("is the scene 'tetrahedron_on_box'") != std::string::npos);
  }

  TEST_CASE("scene_inspect tells what is in a scene, and refuses what is none") {
    const ScratchFolder folder("programs");
    REQUIRE(compile(kScene + " --quiet -o " + folder.file("a.rtscene")).exit_code == 0);
    const ProgramResult text = inspect(folder.file("a.rtscene"));
    CHECK(text.exit_code == 0);
    for (const char* word :
         {"'tetrahedron_on_box'", "neighbor subgraph of one node 25 to 25", "32 to 32", "17 to 17",
          "tetrahedron.obj", "near capacity 128", "formed on the fly", "can be certified",
          "k_F 800 N/m", "no device given", ": convex"}) {
      CAPTURE(word);
      CHECK(text.out.find(word) != std::string::npos);
    }
    const ProgramResult json = inspect(folder.file("a.rtscene") + " --json");
    const auto facts = nlohmann::json::parse(json.out);
    CHECK(facts["neighborhoods"]["b"]["largest"] == 32);
    CHECK(facts["parts"][0]["pieces"][0]["mesh_vertices"] == 4);
    CHECK(facts["parts"][1]["pieces"][0]["source_vertices"].size() == 8);

    std::string bytes = text_of_file(folder.file("a.rtscene"));
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    std::ofstream(folder.file("bad.rtscene"), std::ios::binary) << bytes;
    const ProgramResult bad = inspect(folder.file("bad.rtscene"));
    CHECK(bad.exit_code == 3);
    CHECK(bad.err.find("does not match its hash") != std::string::npos);
    CHECK(bad.err.find("bad.rtscene: header (byte 24): it states content ") != std::string::npos);
    std::ofstream(folder.file("short.rtscene")) << "no scene";
    CHECK(inspect(folder.file("short.rtscene")).exit_code == 3);
    CHECK(inspect(folder.file("absent.rtscene")).exit_code == 3);
    CHECK(inspect(kScene).exit_code == 3);
  }
}
