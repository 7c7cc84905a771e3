// SPDX-License-Identifier: Apache-2.0
// Names that OBJ and STL files have in them, and the mesh behind one.
#include <doctest/doctest.h>

#include <algorithm>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

using Names = std::vector<std::string>;

Names names_of(const RawMesh& mesh) {
  Names names;
  for (const NamedNode& node : named_nodes(mesh)) names.push_back(node.name);
  return names;
}

Names parts_of(const RawMesh& mesh) {
  Names names;
  for (const NamedNode& node : named_nodes(mesh)) {
    if (node.is_part) names.push_back(node.name);
  }
  return names;
}

RawMesh mesh_at(const RawMesh& mesh, const std::string& name) {
  const std::vector<NamedNode> nodes = named_nodes(mesh);
  const auto node = std::ranges::find(nodes, name, &NamedNode::name);
  REQUIRE(node != nodes.end());
  return mesh_of_faces(mesh, faces_of_node(mesh, node->node), name);
}

/// Parts are all faces, each once.
void check_parts(const RawMesh& mesh) {
  std::vector<int> count(mesh.faces.size(), 0);
  for (const NamedNode& node : named_nodes(mesh)) {
    if (!node.is_part) continue;
    const std::vector<bool> faces = faces_of_node(mesh, node.node);
    for (std::size_t f = 0; f < faces.size(); ++f) count[f] += faces[f] ? 1 : 0;
  }
  CHECK(std::ranges::all_of(count, [](int n) { return n == 1; }));
}

/// Four corners; "F" in the text stands for a face of them.
RawMesh obj_with(std::string text) {
  for (std::size_t at = text.find('F'); at != std::string::npos; at = text.find('F', at)) {
    text.replace(at, 1, "f 1 2 3\n");
  }
  RawMesh mesh = parse_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + text);
  if (!mesh.nodes.empty()) check_parts(mesh);
  return mesh;
}

std::string solid(const std::string& name, double x) {
  const std::string a = std::to_string(x);
  return "solid " + name + "\nfacet normal 0 0 1\nouter loop\nvertex " + a + " 0 0\nvertex " + a +
         " 1 0\nvertex " + a + " 0 1\nendloop\nendfacet\nendsolid\n";
}

}  // namespace

TEST_SUITE("tools.mesh_nodes") {
  TEST_CASE("a name is one line of UTF-8 without blanks around it") {
    CHECK(tidy_name("  gear 1\t", "node") == "gear 1");
    CHECK(tidy_name("a\nb\x7F"
                    "c",
                    "node") == "a b c");
    CHECK(tidy_name("", "node") == "node");
    CHECK(tidy_name(" \r\n", "node") == "node");
    CHECK(tidy_name("Gehäuse €", "node") == "Gehäuse €");
    CHECK(tidy_name("a\xFF\xC3", "node") == "a??");
    CHECK(tidy_name("\xED\xA0\x80", "node") == "???");  // half of a UTF-16 pair
    CHECK(tidy_name(std::string(300, 'x'), "node").size() == 200);
    const std::string cut = tidy_name(std::string(199, 'x') + "€", "node");
    CHECK(cut == std::string(199, 'x'));  // no half of a character
    for (const std::string& name :
         {std::string("a\xF4\x90\x80\x80"), cut, std::string(150, '\xE2')})
      CHECK(tidy_name(tidy_name(name, "n"), "n") == tidy_name(name, "n"));
  }

  TEST_CASE("OBJ: objects are nodes, groups where there are no objects") {
    CHECK(obj_with("F").nodes.empty());
    CHECK(names_of(obj_with("F")).empty());
    const RawMesh objects = obj_with("o peg # the peg\nFFo  hole plate\nF");
    CHECK(names_of(objects) == Names{"peg", "hole plate"});
    CHECK(mesh_at(objects, "peg").faces.size() == 2);
    CHECK(mesh_at(objects, "hole plate").faces.size() == 1);
    const RawMesh groups = obj_with("Fg a b\nFg c\nFFg a b\nF");
    CHECK(parts_of(groups) == Names{"default", "a b", "c"});
    CHECK(mesh_at(groups, "a b").faces.size() == 2);
    // Without faces there is nothing to name.
    const RawMesh empty = obj_with("o empty\ng none\no peg\nF");
    CHECK(names_of(empty) == Names{"peg"});
    REQUIRE(empty.nodes.size() == 2);
    CHECK(empty.nodes[0].name == "empty");
  }

  TEST_CASE("OBJ: groups of objects are nodes below them, and parts where there is one object") {
    const RawMesh several = obj_with("o a\ng x\nFg y\nFo b\nFg x\nFFo c\ng c\nF");
    CHECK(names_of(several) == Names{"a", "x:1", "y", "b", "default", "x:2", "c"});
    CHECK(parts_of(several) == Names{"a", "b", "c"});
    CHECK(mesh_at(several, "a").faces.size() == 2);
    CHECK(mesh_at(several, "b").faces.size() == 3);
    CHECK(mesh_at(several, "x:2").faces.size() == 2);
    CHECK(mesh_at(several, "c").faces.size() == 1);
    CHECK(parts_of(obj_with("o machine\ng x\nFg y\nF")) == Names{"x", "y"});
    CHECK(names_of(obj_with("o machine\ng x\nFg y\nF")) == Names{"machine", "x", "y"});
  }

  TEST_CASE("names that several nodes share get numbers, in the order of the file") {
    // An object of one name that is entered again is the same.
    CHECK(names_of(obj_with("o a\nFo b\nFo a\nF")) == Names{"a", "b"});
    RawMesh mesh = obj_with("o bolt\nFo bolt:1\nFo nut\nF");
    mesh.nodes[2].name = "bolt";
    CHECK(names_of(mesh) == Names{"bolt:2", "bolt:1", "bolt:3"});
    const RawMesh solids = parse_text(
        solid("", 0) + solid("", 1) + solid("pin", 2) + "solid pin\nendsolid\n", MeshFormat::kStl);
    CHECK(names_of(solids) == Names{"solid:1", "solid:2", "pin"});
  }

  TEST_CASE("STL: the solids of a text file, at their places, by the whole of their line") {
    const RawMesh mesh = parse_text(solid("left  wall", -3) + solid("peg", 5), MeshFormat::kStl);
    check_parts(mesh);
    CHECK(parts_of(mesh) == Names{"left wall", "peg"});
    const RawMesh peg = mesh_at(mesh, "peg");
    CHECK(peg.file == mesh.file + "#peg");
    REQUIRE(peg.vertices.size() == 3);
    CHECK(peg.vertices[2] == Point3{5, 0, 1});
    CHECK(peg.vertex_places[0] == mesh.vertex_places[3]);
    CHECK(peg.faces[0].source_place == mesh.faces[1].source_place);
    CHECK(peg.print_resolution == mesh.print_resolution);
    CHECK(peg.indexed == mesh.indexed);
    CHECK(peg.nodes.empty());
  }

  TEST_CASE("a node with faces is these, one without is all below it") {
    RawMesh mesh = obj_with("o a\nFo b\nFFo c\nFFF");
    // Above all a node without faces; c below b.
    mesh.nodes = {{"top", MeshNode::kNone, false},
                  {"a", 0, true},
                  {"b", 0, true},
                  {"c", 2, true},
                  {"empty", 0, false},
                  {"c", 2, false}};
    for (std::uint32_t& node : mesh.group_nodes) ++node;
    mesh.group_nodes[0] = 0;
    CHECK(names_of(mesh) == Names{"top", "a", "b", "c"});
    CHECK(mesh_at(mesh, "top").faces.size() == 6);
    CHECK(mesh_at(mesh, "b").faces.size() == 2);
    CHECK(mesh_at(mesh, "c").faces.size() == 3);
    // A node above a single other one of the same name is that one, and as much a part.
    mesh.nodes[3].parent = 5;
    mesh.nodes[3].is_part = false;
    std::swap(mesh.nodes[3], mesh.nodes[5]);
    mesh.nodes[3] = {"c", 2, true};
    mesh.nodes[5] = {"c", 3, false};
    for (std::uint32_t& node : mesh.group_nodes) node = node == 3 ? 5 : node;
    CHECK(names_of(mesh) == Names{"top", "a", "b", "c"});
    CHECK(parts_of(mesh) == Names{"a", "b", "c"});
    CHECK(mesh_at(mesh, "c").faces.size() == 3);
    check_parts(mesh);
  }
}
