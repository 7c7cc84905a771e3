// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>

#include "tests/support/program_run.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/shapes/solid_facts.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;
using haptic::sim::test::ScratchFolder;

namespace {

const char* const kTetrahedronObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// The collisions begin in line 3.
std::string robot(const std::string& collisions) {
  return "<robot name=\"r\"><link name=\"base\"/>\n<link name=\"grip\">\n" + collisions +
         "</link></robot>\n";
}

std::string collision(const std::string& form, const std::string& origin = "") {
  return "<collision>" + origin + "<geometry>" + form + "</geometry></collision>\n";
}

RawMesh link_of(const std::string& text, const std::string& folder = ".") {
  return link_mesh_of(text, "r.urdf", folder, "grip");
}

std::string refusal_of(const std::string& text, const std::string& link = "grip") {
  try {
    link_mesh_of(text, "r.urdf", ".", link);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool no_urdf() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

/// Links of boxes, that of the arm and the finger 0.1 m along x, and one without a model.
std::string jointed(const std::string& joints) {
  const std::string box = "<box size=\"0.4 0.2 0.1\"/>", along = "<origin xyz=\"0.1 0 0\"/>";
  std::string text = "<robot>";
  for (const char* name : {"base", "arm", "finger"}) {
    std::string form = "<collision>" + (name[0] == 'b' ? std::string() : along) + "<geometry>" +
                       box + "</geometry></collision>";
    text += "<link name=\"" + std::string(name) + "\">" + form + "</link>";
  }
  return text +
         "<link name=\"flange\"/><joint name=\"f\" type=\"fixed\"><parent "
         "link=\"finger\"/><child link=\"flange\"/></joint>" +
         joints + "</robot>";
}

/// The least and the largest corner.
std::array<Point3, 2> bounds(const RawMesh& mesh) {
  std::array<Point3, 2> box{Point3{9, 9, 9}, Point3{-9, -9, -9}};
  for (const Point3& p : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      box[0][k] = std::min(box[0][k], p[k]);
      box[1][k] = std::max(box[1][k], p[k]);
    }
  }
  return box;
}

}  // namespace

TEST_SUITE("tools.urdf_link") {
  TEST_CASE("boxes, cylinders and spheres with their origins") {
    if (no_urdf()) return;
    const RawMesh box = link_of(robot(
        collision("<box size=\"0.1 0.2 0.3\"/>",
                  "<origin xyz=\"1 2 3\" rpy=\"1.5707963267948966 0 1.5707963267948966\"/>")));
    CHECK(volume_m3(box) == doctest::Approx(0.006));
    // First about x: y to z; then about z: x to y.
    const auto [low, high] = bounds(box);
    CHECK(high[0] - low[0] == doctest::Approx(0.3));
    CHECK(high[1] - low[1] == doctest::Approx(0.1));
    CHECK(high[2] - low[2] == doctest::Approx(0.2));
    CHECK(0.5 * (high[2] + low[2]) == doctest::Approx(3.0));
    // The order of the turns: of x, y, z about the fixed axes.
    const RawMesh turned =
        link_of(robot(collision("<box size=\"2 2 2\"/>", "<origin rpy=\"0.3 0.4 0.5\"/>")));
    const double cr = std::cos(0.3), sr = std::sin(0.3), cp = std::cos(0.4), sp = std::sin(0.4);
    double found = 1.0;
    for (const Point3& p : turned.vertices) {
      found = std::min(found, std::abs(p[2] - (-sp + cp * sr + cp * cr)));
    }
    CHECK(found < 1e-15);

    const RawMesh two =
        link_of(robot(collision("<cylinder radius=\"0.1\" length=\"0.5\"/>") +
                      collision("<sphere radius=\"0.2\"/>", "<origin xyz=\"1 0 0\"/>")));
    CHECK(closed_defect(two, 1e-12) == "");
    CHECK(two.faces.front().group != two.faces.back().group);
    CHECK(volume_m3(two) == doctest::Approx(3.14159 * 0.005 + 4.18879 * 0.008).epsilon(0.03));
    CHECK(bounds(two)[1][0] == doctest::Approx(1.2));
  }

  TEST_CASE("meshes: paths, packages, scales and units") {
    if (no_urdf()) return;
    const ScratchFolder folder("urdf_meshes");
    std::filesystem::create_directories(folder.file("pkg/urdf"));
    std::filesystem::create_directories(folder.file("pkg/meshes"));
    std::ofstream(folder.file("pkg/meshes/t.obj")) << kTetrahedronObj;
    std::ofstream(folder.file("pkg/meshes/t.dae")) << tetrahedron_dae("<unit meter=\"0.1\"/>");
    const std::string urdf = folder.file("pkg/urdf");
    for (const char* name : {"package://pkg/meshes/t.obj", "../meshes/t.obj"}) {
      const RawMesh mesh = link_of(
          robot(collision(std::string("<mesh filename=\"") + name + "\" scale=\"0.1 0.2 0.3\"/>")),
          urdf);
      CHECK(volume_m3(mesh) == doctest::Approx(0.001));
    }
    const RawMesh dae = link_of(robot(collision("<mesh filename=\"package://pkg/meshes/t.dae\"/>",
                                                "<origin xyz=\"0 0 1\"/>")),
                                urdf);
    const Surface surface = clean(dae);
    CHECK(volume(surface) == doctest::Approx(0.001 / 6).epsilon(1e-5));
    CHECK(bounds(dae)[1][2] == doctest::Approx(1.1));

    std::ofstream(folder.file("pkg/urdf/r.urdf"))
        << robot(collision("<mesh filename=\"package://pkg/meshes/t.obj\"/>"));
    const auto parsed = [&](const std::string& part) {
      return parse_scene_file("format = 1\nname = \"n\"\n[moving]\n" + part +
                                  "\nposition_m = [0, 0, 9]\n[[static]]\nshape = \"box\"\n"
                                  "size_m = [1, 1, 1]\n[rendering]\nk_f_n_per_m = 800\n",
                              "scene.toml", std::filesystem::path(folder.file("pkg/urdf")));
    };
    const SceneFile scene = parsed("link = \"r.urdf#grip\"");
    CHECK(body_name(scene.moving) == "r.urdf#grip");
    const CompiledScene compiled = compile_scene(scene, {});
    CHECK(compiled.parts[0].volume_m3 == doctest::Approx(1.0 / 6));
    const std::pair<const char*, const char*> defects[] = {
        {"link = \"r.urdf\"", "scene.toml:4:8: [moving] link: is 'r.urdf'; give a robot"},
        {"link = \"r.urdf\"", "its links with a collision model: 'grip'"},
        {"mesh = \"r.urdf\"",
         "4:8: [moving] mesh: 'r.urdf' is of a robot description; give link = "
         "\"r.urdf#LINK\" instead, without scale_to_m; its links with a "
         "collision model: 'grip'"},
        {"mesh = \"r.urdf#grip\"\nscale_to_m = 1", "give link = \"r.urdf#LINK\""},
        {"link = \"r.urdf#\"", "4:8: "},
        {"link = \"s.urdf#grip\"", "no file 's.urdf'"},
        {"link = \"r.urdf#grip\"\nscale_to_m = 1",
         "5:14: [moving] scale_to_m: the part is in metres"},
        {"link = \"r.urdf#grip\"\nshape = \"box\"", "keep one of the two"}};
    for (const auto& [part, says] : defects) {
      std::string text;
      try {
        parsed(part);
      } catch (const InputError& error) {
        text = error.what();
      }
      CAPTURE(text);
      CHECK(contains(text, says));
    }
  }

  TEST_CASE("scales with minus signs mirror, and the faces keep their outside") {
    if (no_urdf()) return;
    const ScratchFolder folder("urdf_mirror");
    std::ofstream(folder.file("t.obj")) << kTetrahedronObj;
    std::ofstream(folder.file("t.dae")) << tetrahedron_dae("<unit meter=\"1\"/>");
    const auto scaled = [&](const std::string& file, const std::string& scale) {
      return link_of(robot(collision("<mesh filename=\"" + file + "\" scale=\"" + scale + "\"/>")),
                     folder.file(""));
    };
    for (const char* file : {"t.obj", "t.dae"}) {
      for (int signs = 0; signs < 8; ++signs) {
        std::string scale;
        Point3 corner{};
        for (std::size_t k = 0; k < 3; ++k) {
          corner[k] = ((signs >> k & 1) != 0 ? -0.1 : 0.1) * static_cast<double>(k + 1);
          scale += " \t" + std::to_string(corner[k]) + "\n";
        }
        CAPTURE(scale);
        const RawMesh mesh = scaled(file, scale);
        // Signed: clockwise faces would make it negative.
        CHECK(volume_m3(mesh) == doctest::Approx(0.001).epsilon(1e-5));
        const auto [low, high] = bounds(mesh);
        for (std::size_t k = 0; k < 3; ++k) {
          CHECK((corner[k] < 0 ? low[k] : high[k]) == doctest::Approx(corner[k]));
        }
      }
    }
    for (const char* scale : {"1 0 1", "0 0 0", "1 -0 1", "-0.0 1 1"}) {
      CAPTURE(scale);
      std::string text;
      try {
        scaled("t.obj", scale);
      } catch (const InputError& error) {
        text = error.what();
      }
      CHECK(contains(text, "r.urdf:3: the scale is '" + std::string(scale) +
                               "'; give three numbers other than 0"));
    }
    for (const char* scale : {"0.001", "1 nan 1", "1 inf 1", "1,0 1 1", "1 1 1 1"}) {
      CAPTURE(scale);
      CHECK_THROWS_AS(scaled("t.obj", scale), InputError);
    }
  }

  TEST_CASE("meshes are found under the names that people and other programs give them") {
    if (no_urdf()) return;
    const ScratchFolder folder("urdf_names");
    std::filesystem::create_directories(folder.file("ws/arm-main/urdf/sub"));
    std::filesystem::create_directories(folder.file("ws/arm-main/Meshes"));
    std::filesystem::create_directories(folder.file("ws/hand/meshes"));
    std::ofstream(folder.file("ws/arm-main/Meshes/T one.OBJ")) << kTetrahedronObj;
    std::ofstream(folder.file("ws/hand/meshes/t.obj")) << kTetrahedronObj;
    std::ofstream(folder.file("ws/arm-main/package.xml"))
        << "<?xml version=\"1.0\"?>\n<package format=\"2\"><name> arm </name></package>\n";
    const std::string urdf = folder.file("ws/arm-main/urdf");
    const auto mesh_of = [&](const std::string& name) {
      return link_of(robot(collision("<mesh filename=\"" + name + "\"/>")), urdf);
    };
    const std::string whole =
        std::filesystem::absolute(folder.file("ws/hand/meshes/t.obj")).string();
    for (const std::string& name :
         {std::string("package://hand/meshes/t.obj"), std::string("model://hand/meshes/t.obj"),
          std::string("$(find hand)/meshes/t.obj"), std::string("file://$(find hand)/meshes/t.obj"),
          std::string(" package://hand\\meshes\\t.obj "),
          std::string("package:///hand/meshes/t.obj"), std::string("PACKAGE://hand/meshes/t.obj"),
          std::string("..\\..\\hand\\meshes\\t.obj"), std::string("file://../../hand/meshes/t.obj"),
          "file://" + whole, "file:" + whole, "file://localhost" + whole, whole,
          std::string("../Meshes/T one.OBJ"), std::string("../Meshes/T%20one.OBJ"),
          std::string("package://arm/Meshes/T%20one.OBJ"),
          std::string("package://arm/Meshes/T one.OBJ"),
          std::string("$(find arm)/Meshes/T one.OBJ")}) {
      CAPTURE(name);
      const RawMesh mesh = mesh_of(name);
      CHECK(volume_m3(mesh) == doctest::Approx(1.0 / 6));
      CHECK(mesh.notes.empty());
    }
    for (const char* name : {"package://Hand/Meshes/T.obj", "../meshes/t%20ONE.obj",
                             "package://arm/meshes/t one.obj", "..\\..\\hand\\meshes\\T.OBJ"}) {
      CAPTURE(name);
      const RawMesh mesh = mesh_of(name);
      CHECK(volume_m3(mesh) == doctest::Approx(1.0 / 6));
      REQUIRE(mesh.notes.size() == 1);
      CHECK(contains(mesh.notes[0], "r.urdf:3: '"));
      CHECK(contains(mesh.notes[0], "with letters of another case"));
    }
    std::ofstream(folder.file("ws/hand/meshes/T.obj")) << kTetrahedronObj;
    CHECK_THROWS_AS(mesh_of("package://hand/meshes/t.OBJ"), InputError);
  }

  TEST_CASE("blanks around the name of a link, and the links that a description has") {
    if (no_urdf()) return;
    const std::string text =
        "<robot><link name=\" a \"><collision><geometry><sphere radius=\" 1\"/></geometry>"
        "</collision></link><link name=\"b\"/></robot>";
    CHECK(link_mesh_of(text, "r.urdf", ".", "a").faces.size() > 0);
    CHECK(link_mesh_of(text, "r.urdf", ".", " a ").faces.size() > 0);
    const ScratchFolder folder("urdf_links");
    std::ofstream(folder.file("r.urdf")) << text;
    CHECK(collision_links(folder.file("r.urdf")) == "its links with a collision model: 'a'");
    std::ofstream(folder.file("n.urdf")) << "<robot><link name=\"b\"/></robot>";
    CHECK(collision_links(folder.file("n.urdf")) == "no link of it has a <collision>");
    std::ofstream(folder.file("x.urdf")) << "<robot>";
    CHECK_THROWS_AS(collision_links(folder.file("x.urdf")), InputError);
  }

  TEST_CASE("what reading the meshes of a link left out is told with the scene") {
    if (no_urdf()) return;
    const ScratchFolder folder("urdf_notes");
    std::ofstream(folder.file("t.obj")) << kTetrahedronObj << "xyz\n";
    std::ofstream(folder.file("r.urdf"))
        << robot(collision("<mesh filename=\"T.obj\" scale=\"-1 1 1\"/>"));
    const std::string part = "link = \"R.urdf#grip\"\n";
    const SceneFile scene = parse_scene_file("format = 1\nname = \"n\"\n[moving]\n" + part +
                                                 "position_m = [0, 0, 9]\n[[static]]\n" + part +
                                                 "[rendering]\nk_f_n_per_m = 800\n",
                                             "scene.toml", std::filesystem::path(folder.file("")));
    const CompiledScene compiled = compile_scene(scene, {});
    CHECK(compiled.parts[0].volume_m3 == doctest::Approx(1.0 / 6));
    std::string notes;
    for (const std::string& note : compiled.notes) notes += note + "\n";
    CAPTURE(notes);
    for (const char* says : {"'R.urdf' was found as", "'T.obj' was found as",
                             "1 line with a keyword that OBJ does not have left out: 'xyz'"}) {
      CHECK(contains(notes, says));
      CHECK(notes.find(says) == notes.rfind(says));  // once for the two parts
    }
  }

  TEST_CASE("defects of a description are said with their line") {
    if (no_urdf()) return;
    const std::pair<std::string, const char*> defects[] = {
        {"<robot", "r.urdf:1: the text is no XML"},
        {"<a/>", "r.urdf:1: the root element is 'a'"},
        {"<robot/>", "r.urdf: the robot has no <link>"},
        {robot(""), "r.urdf:2: link 'grip' has no <collision>"},
        {robot("<collision/>"), "r.urdf:3: a <collision> has no <geometry>"},
        {robot(collision("<sphere radius=\"1\"/>\n<box size=\"1 1 1\"/>")),
         "r.urdf:4: a <collision> has a second form, <'box'>; give every form a <collision>"},
        {robot("<collision><geometry><sphere radius=\"1\"/></geometry>\n<geometry/></collision>"),
         "r.urdf:4: a <collision> has a second form"},
        {robot(collision("<sphere radius=\"1\"/>") + "</link>\n<link name=\"grip\">"),
         "r.urdf:5: link 'grip' is in line 2 too; give every link a name of its own"},
        {robot(collision("<torus/>")), "r.urdf:3: the form <'torus'> is not known"},
        {robot(collision("<box/>")), "r.urdf:3: size of <box> is ''; give 3 numbers"},
        {robot(collision("<box size=\"1 2\"/>")), "size of <box> is '1 2'"},
        {robot(collision("<box size=\"1 2 x\"/>")), "r.urdf:3: size 'x'"},
        {robot(collision("<box size=\"1 -2 1\"/>")), "r.urdf:3: <box>: size_m is -2"},
        {robot(collision("<sphere radius=\"0\"/>")), "<sphere>: radius_m is 0"},
        {robot(collision("<mesh filename=\"no.obj\"/>")), "r.urdf:3: no mesh 'no.obj'"},
        {robot(collision("<mesh filename=\"" + std::string(60, 'n') + "/no.obj\"/>")),
         "r.urdf:3: no mesh 'nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn/no.obj'"},
        {robot(collision("<mesh filename=\"http://a/no.obj\"/>")), "files here: save it"},
        {robot(collision("<mesh filename=\"${dir}/no.obj\"/>")), "expand xacro files first"},
        {robot(collision("<mesh filename=\"$(find no/no.obj\"/>")), "expand xacro files first"},
        {robot(collision("<mesh filename=\"package://no\"/>")), "whose package.xml has the name"},
        {robot(collision("<mesh/>")), "r.urdf:3: no mesh ''"},
        {robot(collision("<mesh filename=\"package://no/no.obj\"/>")), "and above"},
        {robot(collision("<sphere radius=\"1\"/>", "<origin xyz=\"1e400 0 0\"/>")), "r.urdf:3: "}};
    for (const auto& defect : defects) {
      const auto& text = defect.first;
      const auto& says = defect.second;
      CAPTURE(text);
      const std::string refusal = refusal_of(text);
      CAPTURE(refusal);
      CHECK(contains(refusal, says));
      CHECK(contains(refusal, "; "));
    }
    CHECK(contains(refusal_of(robot(""), "gripp"), "no link 'gripp'; did you mean 'grip'?"));
    const std::string listed =
        refusal_of(robot(collision("<sphere radius=\"1\"/>")), "something_else");
    CHECK(contains(listed, "no link 'something_else'; its links with a collision model: 'grip'"));
    CHECK(contains(refusal_of(robot(collision("<sphere radius=\"1\"/>")), "base"),
                   "r.urdf:1: link 'base' has no <collision>; name a link that has one; its links "
                   "with a collision model: 'grip'"));
    CHECK(contains(refusal_of(std::string("\x1F\x8B\x08", 3)), "gzip-compressed; unpack it"));
  }

  TEST_CASE("all links, where the joints at 0 have them") {
    if (no_urdf()) return;
    // The arm is turned about z and stands 1 m up; the finger lies 0.5 m along the arm's own x.
    const std::string quarter = "1.5707963267948966";
    const std::string text = jointed(
        "<joint name=\"j\" type=\"revolute\"><parent link=\"base\"/><child link=\" arm \"/>"
        "<origin xyz=\"0 0 1\" rpy=\"0 0 " +
        quarter +
        "\"/><limit lower=\"0.5\" upper=\"1\"/></joint>"
        "<joint name=\"k\" type=\"prismatic\"><parent link=\"arm\"/><child link=\"finger\"/>"
        "<origin xyz=\"0.5 0 0\"/><limit lower=\"0\" upper=\"0.02\"/></joint>");
    const RawMesh mesh = robot_mesh_of(text, "r.urdf", ".");
    const std::vector<NamedNode> nodes = named_nodes(mesh);
    REQUIRE(nodes.size() == 3);
    CHECK(nodes[0].name == "base");
    CHECK(nodes[1].name == "arm");
    CHECK(nodes[2].name == "finger");
    REQUIRE(mesh.nodes.size() == 4);  // and one without a collision model
    REQUIRE(mesh.notes.size() == 1);
    CHECK(mesh.notes[0] == "r.urdf: joint 'j' stands at 0, outside its limits 0.5 to 1");
    const auto check_box = [&](const std::string& name, const Point3& centre, const Point3& size) {
      CAPTURE(name);
      for (const RawMesh& found :
           {mesh_of_node(mesh, name), link_mesh_of(text, "r.urdf", ".", name, LinkFrame::kRobot)}) {
        const auto [low, high] = bounds(found);
        for (std::size_t k = 0; k < 3; ++k) {
          CHECK(0.5 * (low[k] + high[k]) == doctest::Approx(centre[k]));
          CHECK(high[k] - low[k] == doctest::Approx(size[k]));
        }
      }
    };
    check_box("base", {0, 0, 0}, {0.4, 0.2, 0.1});
    check_box("arm", {0, 0.1, 1}, {0.2, 0.4, 0.1});  // its own origin lies 0.1 m along its x
    check_box("finger", {0, 0.6, 1}, {0.2, 0.4, 0.1});
    const auto [low, high] = bounds(link_mesh_of(text, "r.urdf", ".", "finger"));
    CHECK(high[0] - low[0] == doctest::Approx(0.4));  // its own frame, as before
    CHECK(high[2] + low[2] == doctest::Approx(0.0));
  }

  TEST_CASE("joints that place no link are refused with their line") {
    if (no_urdf()) return;
    const auto joint = [](const std::string& name, const std::string& parent,
                          const std::string& child) {
      return "\n<joint name=\"" + name + "\" type=\"fixed\"><parent link=\"" + parent +
             "\"/><child link=\"" + child + "\"/></joint>";
    };
    const std::string tree = joint("j", "base", "arm") + joint("k", "arm", "finger");
    const std::pair<std::string, const char*> refusals[] = {
        {joint("j", "base", "arm"),
         "r.urdf:1: links 'base' and 'finger' are below no joint; a robot has one root"},
        {tree + joint("l", "base", "finger"),
         "r.urdf:4: link 'finger' is below joint 'l' and below that of line 3; keep one"},
        {joint("j", "finger", "arm") + joint("k", "arm", "finger"),
         "r.urdf:2: link 'arm' is in a circle of joints, or below one; joints make a tree"},
        {tree + joint("l", "base", "hand"),
         "r.urdf:4: joint 'l' names the link 'hand', which the robot does not have"},
        {"\n<joint name=\"j\"><child link=\"arm\"/></joint>",
         "r.urdf:2: joint 'j' has no <parent>; give it one"},
        {"\n<joint name=\"j\"><parent link=\"base\"/></joint>",
         "r.urdf:2: joint 'j' has no <child>; give it one"},
        {"\n<joint name=\"j\"><parent link=\"base\"/><child link=\"arm\"/><origin xyz=\"1 "
         "2\"/></joint>" +
             joint("k", "arm", "finger"),
         "r.urdf:2: xyz of <origin> is '1 2'; give 3 numbers"}};
    for (const auto& [joints, says] : refusals) {
      const std::string& tried = joints;
      CAPTURE(tried);
      std::string said;
      try {
        robot_mesh_of(jointed(joints), "r.urdf", ".");
      } catch (const InputError& error) {
        said = error.what();
      }
      CAPTURE(said);
      CHECK(contains(said, says));
    }
    CHECK_THROWS_WITH_AS(robot_mesh_of("<robot><link name=\"a\"/></robot>", "r.urdf", "."),
                         "r.urdf: no link of it has a <collision>; give the parts collision models",
                         InputError);
  }
}
