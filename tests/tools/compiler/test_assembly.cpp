// SPDX-License-Identifier: Apache-2.0
// One file with several nodes: one of them as a part of a scene, and all of them as a draft.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/tools/compiler/part_scenes.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/program/assembly.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/node_name.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

using namespace haptic::test;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;
using namespace haptic::tools;

namespace {

struct NamedBox {
  std::string name;
  Point3 low, high;
};

/// A peg over a slot between two walls on a base, in millimetres.
const std::vector<NamedBox> kSlot{{"base", {-30, -30, -5}, {30, 30, 0}},
                                  {"left wall", {-30, -30, 0}, {-10, 30, 30}},
                                  {"right wall", {10, -30, 0}, {30, 30, 30}},
                                  {"peg", {-9.5, -9, 0.5}, {9.5, 9, 50}}};

constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

std::array<Point3, 8> corners_of(const NamedBox& box) {
  std::array<Point3, 8> corners{};
  for (std::size_t k = 0; k < 8; ++k) {
    for (std::size_t i = 0; i < 3; ++i)
      corners[k][i] = ((k >> i) & 1) != 0 ? box.high[i] : box.low[i];
  }
  return corners;
}

std::string triple(const Point3& p) {
  return std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]);
}

/// `keyword`: o or g.
std::string obj_of_boxes(const std::vector<NamedBox>& boxes, const std::string& keyword) {
  std::string text;
  int first = 1;
  for (const NamedBox& box : boxes) {
    text += keyword + " " + box.name + "\n";
    for (const Point3& p : corners_of(box)) text += "v " + triple(p) + "\n";
    for (const auto& quad : kQuads) {
      text += "f";
      for (const int v : quad) text += " " + std::to_string(first + v);
      text += "\n";
    }
    first += 8;
  }
  return text;
}

std::string stl_of_boxes(const std::vector<NamedBox>& boxes) {
  std::string text;
  for (const NamedBox& box : boxes) {
    text += "solid " + box.name + "\n";
    const std::array<Point3, 8> corners = corners_of(box);
    for (const auto& q : kQuads) {
      for (const auto& t : {std::array{q[0], q[1], q[2]}, std::array{q[0], q[2], q[3]}}) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int v : t)
          text += "vertex " + triple(corners[static_cast<std::size_t>(v)]) + "\n";
        text += "endloop\nendfacet\n";
      }
    }
    text += "endsolid " + box.name + "\n";
  }
  return text;
}

/// Of tetrahedra of 40 mm: two legs below a frame that is turned by a right angle about z, and a
/// pin of 20 mm above.
std::string gltf_stand() {
  return haptic::tools::test::gltf_of_nodes(
      "{\"name\":\"frame\",\"translation\":[0,0,0.1],"
      "\"rotation\":[0,0,0.7071067811865476,0.7071067811865476],\"children\":[1,2]},"
      "{\"name\":\"leg\",\"mesh\":0,\"scale\":[0.04,0.04,0.04],\"translation\":[0.1,0,0]},"
      "{\"name\":\"leg\",\"mesh\":0,\"scale\":[0.04,0.04,0.04],\"translation\":[0.2,0,0]},"
      "{\"name\":\"pin\",\"mesh\":0,\"scale\":[0.02,0.02,0.02],\"translation\":[0,0,0.3]},"
      "{\"name\":\"Camera\"}",
      "0,3,4");
}

struct AssemblyBench {
  ScratchFolder folder{"assembly"};

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder.file(name), std::ios::binary) << bytes;
    return folder.file(name);
  }
  Assembly read(const std::string& given, std::optional<std::string> hand = std::nullopt) const {
    return read_assembly({given, std::move(hand), std::nullopt});
  }
  ProgramResult init(const std::string& arguments) const {
    std::filesystem::remove(folder.file("s.toml"));
    return run_program(HAPTIC_GRAPH_COMPILER, "init " + arguments + " -o " + folder.file("s.toml"));
  }
  /// Of the draft.
  ProgramResult compile() const {
    return run_program(HAPTIC_GRAPH_COMPILER,
                       folder.file("s.toml") + " -o " + folder.file("s.rtscene"));
  }
};

bool holds(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

std::vector<std::string> nodes_of(const Assembly& assembly) {
  std::vector<std::string> names;
  for (const DraftMesh& part : assembly.parts) names.push_back(*part.node);
  return names;
}

std::string remarks_of(const Assembly& assembly) {
  std::string text;
  for (const std::string& remark : assembly.remarks) text += remark + "\n";
  return text;
}

void check_box(const Assembly& assembly, const std::string& node, const Point3& low,
               const Point3& high) {
  CAPTURE(node);
  const auto part = std::ranges::find(assembly.parts, node, &DraftMesh::node);
  REQUIRE(part != assembly.parts.end());
  const DraftBox box = part->box();
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(box.low[k] == doctest::Approx(low[k]).epsilon(1e-6));
    CHECK(box.high[k] == doctest::Approx(high[k]).epsilon(1e-6));
  }
}

using Words = std::vector<std::string>;

}  // namespace

TEST_SUITE("tools.assembly") {
  TEST_CASE("FILE#NODE ends at the first # behind a file, an extension, or at the last") {
    const AssemblyBench bench;
    const auto split = [&](const std::string& given) {
      const NodeName name = split_node(bench.folder.file(""), given);
      return name.file + " | " + name.node.value_or("-");
    };
    CHECK(split("a.step#shaft") == "a.step | shaft");
    CHECK(split("a.step# shaft ") == "a.step | shaft");
    CHECK(split("a.step#screw #4") == "a.step | screw #4");
    CHECK(split("a.step#") == "a.step | -");
    CHECK(split("a.step") == "a.step | -");
    CHECK(split("robot.urdf#tool") == "robot.urdf | tool");
    CHECK(split("robot.xml#tool") == "robot.xml | tool");
    CHECK(split("no#4.xml#tool") == "no#4.xml | tool");
    bench.write("b#1.obj", "v 0 0 0\n");
    CHECK(split("b#1.obj") == "b#1.obj | -");
    CHECK(split("b#1.obj#peg") == "b#1.obj | peg");
    bench.write("a.step#shaft", "x");
    CHECK(split("a.step#shaft") == "a.step#shaft | -");
  }

  TEST_CASE("a part of a scene is a node of a file, and named as such") {
    const AssemblyBench bench;
    bench.write("slot.obj", obj_of_boxes(kSlot, "o"));
    bench.write("slot.stl", stl_of_boxes(kSlot));
    const auto compiled = [&](const std::string& moving, const std::string& fixed) {
      const SceneFile scene = parse_scene_file(
          "format = 1\nname = \"n\"\n[moving]\nmesh = \"" + moving +
              "\"\nscale_to_m = 0.001\nposition_m = [0, 0, 0.1]\n[[static]]\nmesh = \"" + fixed +
              "\"\nscale_to_m = 0.001\n[rendering]\nk_f_n_per_m = 800\n",
          "scene.toml", bench.folder.file(""));
      return compile_scene(scene, {});
    };
    for (const std::string file : {"slot.obj", "slot.stl"}) {
      CAPTURE(file);
      const CompiledScene scene = compiled(file + "#peg", file + "#left wall");
      CHECK(scene.parts[0].diagonal_m == doctest::Approx(std::hypot(0.019, 0.018, 0.0495)));
      CHECK(scene.parts[0].volume_m3 == doctest::Approx(0.019 * 0.018 * 0.0495));
      CHECK(scene.parts[1].volume_m3 == doctest::Approx(0.02 * 0.06 * 0.03));
      CHECK(scene.parts[0].mesh == file + "#peg");
      CHECK(scene.parts[0].file == bench.folder.file("") + file + "#peg");
      CHECK(
          holds(std::string(reinterpret_cast<const char*>(scene.bytes.data()), scene.bytes.size()),
                file + "#left wall"));
      // The whole file is one part, as before.
      CHECK(compiled(file + "#peg", file).parts[1].solids == 4);
      CHECK_THROWS_WITH_AS(compiled(file + "#pge", file),
                           doctest::Contains((file + ": no node 'pge'; did you mean 'peg'? its "
                                                     "nodes are 'base', 'left wall', 'right wall', "
                                                     "'peg'")
                                                 .c_str()),
                           InputError);
      CHECK_THROWS_WITH_AS(compiled(file + "#", file),
                           doctest::Contains("scene.toml:4:8: [moving] mesh: '"), InputError);
    }
    bench.write("plain.off",
                "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n"
                "3 0 3 2\n");
    CHECK_THROWS_WITH_AS(compiled("plain.off#a", "slot.obj"),
                         doctest::Contains("the file has no named nodes: leave out #"), InputError);
    const auto link = [&] {
      return parse_scene_file(
          "format = 1\nname = \"n\"\n[moving]\nlink = \"slot.obj#peg\"\n[[static]]\nshape = "
          "\"box\"\nsize_m = [1, 1, 1]\n[rendering]\nk_f_n_per_m = 800\n",
          "scene.toml", bench.folder.file(""));
    };
    CHECK_THROWS_WITH_AS(link(), doctest::Contains("is of a mesh file; give mesh = "), InputError);
  }

  TEST_CASE("a file of several nodes of a scene is read once, and left out is said once") {
    const AssemblyBench bench;
    ScenePart first, second, finer;
    first.path = second.path = finer.path = bench.write("slot.obj", obj_of_boxes(kSlot, "o"));
    first.node = "peg";
    second.node = "base";
    finer.deflection_m = 1e-5;
    MeshFiles files;
    const ImportedMesh* whole = &files.whole(first);
    CHECK(&files.whole(second) == whole);
    CHECK(&files.whole(finer) != whole);
    CHECK(read_part_mesh(second, "s.toml", &files).mesh.faces.size() == 6);
    if (!can_import()) return;
    bench.write("a.3mf",
                haptic::tools::test::archive_of_3mf(haptic::tools::test::metre_model_of_3mf(
                    haptic::tools::test::object_of_3mf("1", "name=\"peg\"") +
                        haptic::tools::test::object_of_3mf("2", "type=\"support\""),
                    "<item objectid=\"1\"/><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 "
                    "0 1 5 0 0\"/><item objectid=\"2\"/>")));
    const CompiledScene scene = compile_scene(
        parse_scene_file("format = 1\nname = \"n\"\n[moving]\nmesh = \"a.3mf#peg:1\"\n[[static]]\n"
                         "mesh = \"a.3mf#peg:2\"\n[rendering]\nk_f_n_per_m = 800\n[coupling]\n"
                         "length_m = 1\n",
                         "scene.toml", bench.folder.file("")),
        {});
    CHECK(std::ranges::count_if(scene.notes, [](const std::string& note) {
            return holds(note, "a.3mf: left out: object '2'");
          }) == 1);
    for (const PartReport& part : scene.parts) {
      CHECK(std::ranges::none_of(part.warnings,
                                 [](const std::string& w) { return holds(w, "left out"); }));
    }
  }

  TEST_CASE("init ASSEMBLY: text formats are drafted where the file has their parts") {
    const AssemblyBench bench;
    for (const std::string& file : {bench.write("o.obj", obj_of_boxes(kSlot, "o")),
                                    bench.write("g.obj", obj_of_boxes(kSlot, "g")),
                                    bench.write("s.stl", stl_of_boxes(kSlot))}) {
      CAPTURE(file);
      const Assembly assembly = bench.read(file);
      CHECK(nodes_of(assembly) == Words{"peg", "base", "left wall", "right wall"});
      CHECK(assembly.unit.scale_to_m == 0.001);
      for (const NamedBox& box : kSlot) check_box(assembly, box.name, box.low, box.high);
      CHECK_FALSE(holds(remarks_of(assembly), "numbered"));
      const ProgramResult r = bench.init(file);
      CAPTURE(r.err);
      REQUIRE(r.exit_code == 0);
      CHECK(holds(r.out, file + ": 4 nodes are the parts of the scene (x, y, z in m; unit guessed: "
                                "millimetres)\n  'peg': 0.019 x 0.018 x 0.0495, in the hand\n"
                                "  'base': 0.06 x 0.06 x 0.005, fixed\n"));
      CHECK(holds(r.out, "in the hand: 'peg', the smallest part that a hand can hold"));
      CHECK(holds(r.out, "--hand NODE chooses another"));
      CHECK(holds(r.out, "where the files have them the parts are 0.5 mm apart"));
      CHECK_FALSE(holds(r.out, "are both in the same unit?"));
      const std::string name = std::filesystem::path(file).filename().string();
      const std::string text = text_of_file(bench.folder.file("s.toml"));
      CHECK(holds(text, "mesh = \"" + name + "#peg\"\nscale_to_m = 0.001"));
      CHECK(holds(text, "[[static]]              # a fixed part\nmesh = \"" + name +
                            "#left wall\"\nscale_to_m = 0.001"));
      // The fixed parts stand where the file has them.
      CHECK(text.find("position_m") == text.rfind("position_m"));
      const ProgramResult compiled = bench.compile();
      CAPTURE(compiled.err);
      CHECK(compiled.exit_code == 0);
    }
  }

  TEST_CASE("init ASSEMBLY: the node in the hand by --hand or behind #, and what it leaves") {
    const AssemblyBench bench;
    const std::string file = bench.write("o.obj", obj_of_boxes(kSlot, "o"));
    CHECK(nodes_of(bench.read(file, "base")) == Words{"base", "left wall", "right wall", "peg"});
    CHECK(nodes_of(bench.read(file + "#base")) == nodes_of(bench.read(file, "base")));
    const ProgramResult r = bench.init("'" + file + "' --hand 'left wall'");
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    CHECK(holds(r.out, "in the hand: 'left wall', as asked for"));
    CHECK(bench.compile().exit_code == 0);
    // A group of an object in the hand: the rest of the object stays.
    const std::string groups = bench.write(
        "g.obj", "o frame\n" + obj_of_boxes({kSlot[0], kSlot[1], kSlot[2]}, "g") +
                     "o peg\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 0 0 9\nf -4 -2 -3\nf -4 -3 -1\n"
                     "f -3 -2 -1\nf -2 -4 -1\n");
    CHECK(nodes_of(bench.read(groups)) == Words{"peg", "frame"});
    const Assembly group = bench.read(groups, "left wall");
    CHECK(nodes_of(group) == Words{"left wall", "base", "right wall", "peg"});
    CHECK(holds(remarks_of(group), "other nodes, which hold these or are pieces of them: 'frame'"));
    check_box(group, "right wall", kSlot[2].low, kSlot[2].high);
  }

  TEST_CASE("init ASSEMBLY: scenes of nodes are drafted at the places of their nodes") {
    if (!can_import()) {
      MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
      return;
    }
    const AssemblyBench bench;
    const std::string file = bench.write("stand.gltf", gltf_stand());
    const Assembly assembly = bench.read(file);
    CHECK(nodes_of(assembly) == Words{"pin", "leg:1", "leg:2"});
    // Turned: x becomes y, y becomes -x.
    check_box(assembly, "leg:1", {-0.04, 0.1, 0.1}, {0, 0.14, 0.14});
    check_box(assembly, "leg:2", {-0.04, 0.2, 0.1}, {0, 0.24, 0.14});
    check_box(assembly, "pin", {0, 0, 0.3}, {0.02, 0.02, 0.32});
    CHECK(holds(remarks_of(assembly), "left out, since they have no faces: 'Camera'"));
    CHECK(holds(remarks_of(assembly), "(x, y, z in m; as the file states)"));
    CHECK(holds(remarks_of(assembly), "nodes that share a name are numbered in the order"));
    CHECK(nodes_of(bench.read(file, "frame")) == Words{"frame", "pin"});
    const ProgramResult r = bench.init(file);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    CHECK_FALSE(holds(r.out, "unit: "));
    CHECK(holds(text_of_file(bench.folder.file("s.toml")), "mesh = \"stand.gltf#leg:2\"\n"));
    const ProgramResult compiled = bench.compile();
    CAPTURE(compiled.err);
    CHECK(compiled.exit_code == 0);
  }

  TEST_CASE("init ASSEMBLY: COLLADA, 3MF and AMF are drafted, and compile") {
    if (!can_import()) {
      MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
      return;
    }
    const AssemblyBench bench;
    const std::string mesh = "<instance_geometry url=\"#g\"/>";
    const std::string files[] = {
        bench.write("a.dae", haptic::tools::test::dae_of_nodes(
                                 "<node id=\"1\" name=\"peg\"><translate>3 0 0</translate>" + mesh +
                                     "</node><node id=\"2\" name=\"base\"><scale>2 2 2</scale>" +
                                     mesh + "</node>",
                                 "<unit meter=\"0.02\"/>")),
        bench.write(
            "a.3mf",
            haptic::tools::test::archive_of_3mf(haptic::tools::test::metre_model_of_3mf(
                haptic::tools::test::object_of_3mf("1", "name=\"peg\"") +
                    haptic::tools::test::object_of_3mf("2", "name=\"base\"") +
                    haptic::tools::test::object_of_3mf("3", "name=\"prop\" type=\"support\""),
                "<item objectid=\"1\" transform=\"0.02 0 0 0 0.02 0 0 0 0.02 0.06 0 0\"/>"
                "<item objectid=\"2\" transform=\"0.04 0 0 0 0.04 0 0 0 0.04 0 0 0\"/>"
                "<item objectid=\"3\"/>")))};
    for (const std::string& file : files) {
      CAPTURE(file);
      const Assembly assembly = bench.read(file);
      CHECK(nodes_of(assembly) == Words{"peg", "base"});
      check_box(assembly, "peg", {0.06, 0, 0}, {0.08, 0.02, 0.02});
      check_box(assembly, "base", {0, 0, 0}, {0.04, 0.04, 0.04});
      const ProgramResult r = bench.init(file);
      CAPTURE(r.err);
      REQUIRE(r.exit_code == 0);
      CHECK(holds(r.out, "left out: object '3'") == file.ends_with("3mf"));
      const ProgramResult compiled = bench.compile();
      CAPTURE(compiled.err);
      CHECK(compiled.exit_code == 0);
    }
    const std::string amf = bench.write(
        "a.amf", haptic::tools::test::amf_of(
                     haptic::tools::test::amf_object("1") +
                         "<constellation id=\"2\"><instance objectid=\"1\"/><instance "
                         "objectid=\"1\"><deltax>30</deltax></instance></constellation>",
                     "unit=\"inch\""));
    CHECK(nodes_of(bench.read(amf)) == Words{"object 1:1", "object 1:2"});
    check_box(bench.read(amf), "object 1:2", {0.762, 0, 0}, {0.7874, 0.0254, 0.0254});
    CHECK(bench.init(amf).exit_code == 0);
    CHECK(bench.compile().exit_code == 0);
  }

  TEST_CASE("init ASSEMBLY: what has no area is left out and told, tiny parts say no unit") {
    const AssemblyBench bench;
    const std::string file =
        bench.write("o.obj", obj_of_boxes(kSlot, "o") +
                                 "o mark\nv 0 0 0\nv 1 0 0\nv 2 0 0\nf -3 -2 -1\no dot\n");
    const Assembly assembly = bench.read(file);
    CHECK(nodes_of(assembly) == Words{"peg", "base", "left wall", "right wall"});
    CHECK(holds(remarks_of(assembly), "left out: 'mark', which has no area"));
    CHECK(holds(remarks_of(assembly), "left out, since they have no faces: 'dot'"));
    CHECK(bench.init(file).exit_code == 0);
    CHECK(bench.compile().exit_code == 0);
    std::vector<NamedBox> speck = kSlot;
    speck.push_back({"speck", {0, 0, 60}, {0.01, 0.01, 60.01}});
    const Assembly tiny = bench.read(bench.write("t.obj", obj_of_boxes(speck, "o")));
    CHECK(tiny.unit.scale_to_m == 0.001);
    CHECK(*tiny.parts[0].node == "peg");  // no hand holds the speck
    // Where none is large enough the largest is taken.
    const std::string pair = bench.write(
        "u.obj", obj_of_boxes({{"a", {0, 0, 0}, {2, 1, 1}}, {"b", {5, 0, 0}, {7, 2, 2}}}, "o"));
    const Assembly small = read_assembly({pair, std::nullopt, 0.001});
    CHECK(nodes_of(small)[0] == "b");
    CHECK(holds(remarks_of(small), "'b', the largest part, since none is 5 mm across"));
    CHECK(holds(remarks_of(small), "(x, y, z in m; --scale 0.001)"));
  }

  TEST_CASE("init ASSEMBLY: faces of one body are told, and a closed part is in the hand") {
    const AssemblyBench bench;
    // Six faces of 20 mm, each an object of its own, and a bar of 100 mm.
    std::string text = obj_of_boxes({{"bar", {0, 0, 30}, {100, 9, 39}}}, "o");
    for (const Point3& p : corners_of({"", {0, 0, 0}, {20, 20, 20}}))
      text += "v " + triple(p) + "\n";
    for (int k = 0; k < 6; ++k) {
      text += "o face" + std::to_string(k) + "\nf";
      for (const int v : kQuads[k]) text += " " + std::to_string(9 + v);
      text += "\n";
    }
    const Assembly assembly = bench.read(bench.write("o.obj", text));
    CHECK(nodes_of(assembly)[0] == "bar");
    CHECK(holds(remarks_of(assembly), "in the hand: 'bar', the smallest closed part that a hand"));
    CHECK(holds(remarks_of(assembly),
                "6 of the parts have open edges: 'face0', 'face1', 'face2', 'face3', "
                "'face4', 'face5'; where they are faces of one body, name the file without #"));
    CHECK_FALSE(holds(remarks_of(bench.read(bench.write("c.obj", obj_of_boxes(kSlot, "o")))),
                      "open edges"));
  }

  TEST_CASE("init of a whole robot description: links stand where the joints at 0 have them") {
    if (!can_import()) return;
    const AssemblyBench bench;
    const auto link = [](const std::string& name, const std::string& form) {
      return "<link name=\"" + name + "\"><collision><geometry>" + form +
             "</geometry></collision></link>";
    };
    const auto joint = [](const std::string& child, const std::string& origin) {
      return "<joint name=\"to " + child +
             "\" type=\"revolute\"><parent link=\"base\"/><child "
             "link=\"" +
             child + "\"/><origin " + origin +
             "/><limit lower=\"-1\" "
             "upper=\"1\"/></joint>";
    };
    // A finger beside a post; its frame is turned, so that its long side lies along y of the robot.
    const std::string urdf = bench.write(
        "r.urdf", "<robot>" + link("base", "<box size=\"0.2 0.2 0.02\"/>") +
                      link("post", "<box size=\"0.02 0.02 0.1\"/>") +
                      link("finger", "<box size=\"0.06 0.01 0.01\"/>") + "<link name=\"camera\"/>" +
                      joint("post", "xyz=\"0.05 0 0.06\"") +
                      joint("finger", "xyz=\"0 0 0.06\" rpy=\"0 0 1.5707963267948966\"") +
                      joint("camera", "xyz=\"0 0 1\"") + "</robot>");
    const Assembly assembly = bench.read(urdf);
    CHECK(nodes_of(assembly) == Words{"finger", "base", "post"});
    check_box(assembly, "post", {0.04, -0.01, 0.01}, {0.06, 0.01, 0.11});
    check_box(assembly, "finger", {-0.005, -0.03, 0.055}, {0.005, 0.03, 0.065});
    const ProgramResult r = bench.init(urdf);
    CAPTURE(r.err);
    REQUIRE(r.exit_code == 0);
    CHECK(holds(r.out,
                urdf + ": 3 links are the parts of the scene (x, y, z in m; all joints at 0)"));
    CHECK(holds(r.out, "--hand LINK chooses another"));
    CHECK(holds(r.out, "left out, since they have no faces: 'camera'"));
    const std::string text = text_of_file(bench.folder.file("s.toml"));
    CHECK(holds(text, "link = \"r.urdf#finger\"\nframe = \"robot\""));
    CHECK(holds(text, "link = \"r.urdf#post\"\nframe = \"robot\""));
    const ProgramResult compiled = bench.compile();
    CAPTURE(compiled.err);
    CHECK(compiled.exit_code == 0);
    // The scene has the post where the robot has it.
    const SceneFile scene = read_scene_file(bench.folder.file("s.toml"));
    const RawMesh post = read_part_mesh(scene.statics[1], "s.toml").mesh;
    for (const Point3& p : post.vertices) CHECK(std::abs(p[0] - 0.05) == doctest::Approx(0.01));

    CHECK(nodes_of(bench.read(urdf, "post")) == Words{"post", "base", "finger"});
    CHECK(nodes_of(bench.read(urdf + "#base")) == Words{"base", "post", "finger"});
    CHECK(bench.init(urdf + " --hand pst").exit_code == 3);
    const auto framed = [&](const std::string& part) {
      return parse_scene_file("format = 1\nname = \"n\"\n[moving]\n" + part +
                                  "\n[[static]]\nshape = \"box\"\nsize_m = [1, 1, 1]\n"
                                  "[rendering]\nk_f_n_per_m = 800\n",
                              "scene.toml", bench.folder.file(""));
    };
    CHECK(framed("link = \"r.urdf#post\"\nframe = \"link\"").moving.link_frame == LinkFrame::kLink);
    CHECK_THROWS_WITH_AS(framed("link = \"r.urdf#post\"\nframe = \"world\""),
                         doctest::Contains("scene.toml:5:9: [moving] frame: is 'world'; give"),
                         InputError);
    CHECK_THROWS_WITH_AS(framed("shape = \"sphere\"\nradius_m = 1\nframe = \"robot\""),
                         doctest::Contains("frame: is of a link; leave it out"), InputError);
  }

  TEST_CASE("init ASSEMBLY: what makes no scene is refused, and nothing is written") {
    const AssemblyBench bench;
    const std::string file = bench.write("o.obj", obj_of_boxes(kSlot, "o"));
    const std::string one = bench.write("one.obj", obj_of_boxes({kSlot[0]}, "o"));
    const std::string bare = bench.write("bare.obj", obj_of_boxes({kSlot[0]}, "#"));
    const std::string urdf = bench.write(
        "r.urdf",
        "<robot><link name=\"tool\"><collision><geometry><box size=\"1 1 1\"/></geometry>"
        "</collision></link></robot>");
    struct Refusal {
      std::string arguments;
      int exit_code;
      std::string says;
    };
    const Refusal refusals[] = {
        {one, 2, "'base' is its only part; give the meshes of the fixed parts too"},
        {bare, 2, "the file names no parts; give the meshes of the fixed parts too"},
        {one + "#base", 2, "'base' is its only part"},
        {file + " --hand pge", 3, "o.obj: no node 'pge'; did you mean 'peg'?"},
        {file + "#pge", 3, "o.obj: no node 'pge'; did you mean 'peg'?"},
        {file + "#peg --hand base", 2, "name two nodes for the hand; keep one"},
        {file + " " + one + " --hand peg", 2, "--hand peg: is for one file with several nodes"},
        {urdf + "#tool", 2, "'tool' is its only part"},
        {bench.folder.file("none.obj"), 3, "none.obj"}};
    for (const Refusal& refusal : refusals) {
      CAPTURE(refusal.arguments);
      const ProgramResult r = bench.init(refusal.arguments);
      CAPTURE(r.err);
      CHECK(r.exit_code == refusal.exit_code);
      CHECK(holds(r.err, refusal.says));
      CHECK_FALSE(std::filesystem::exists(bench.folder.file("s.toml")));
    }
    // With a second file the node is the one part, the file the other.
    CHECK(bench.init(file + "#peg " + one).exit_code == 0);
    CHECK(holds(text_of_file(bench.folder.file("s.toml")), "mesh = \"o.obj#peg\""));
    CHECK(bench.compile().exit_code == 0);
  }
}
