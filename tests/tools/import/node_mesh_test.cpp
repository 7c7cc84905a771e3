// SPDX-License-Identifier: Apache-2.0
// Nodes of the formats that other libraries read, by their names.
#include <doctest/doctest.h>

#include <algorithm>

#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/guarded_import.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

using Names = std::vector<std::string>;

RawMesh node_of(const std::string& bytes, ImportFormat format,
                const std::optional<std::string>& node = std::nullopt) {
  const RawMesh whole = import_bytes(bytes, format, "part", {}).mesh;
  return node ? mesh_of_node(whole, *node) : whole;
}

Names names_in(const RawMesh& mesh, bool parts_alone) {
  Names names;
  for (const NamedNode& node : named_nodes(mesh)) {
    if (node.is_part || !parts_alone) names.push_back(node.name);
  }
  return names;
}

/// The tetrahedron of the tests, scaled and moved.
void check_place(const RawMesh& mesh, const std::string& node, double size_m, const Point3& at_m) {
  CAPTURE(node);
  CHECK(mesh.file == "part#" + node);
  CHECK(mesh.faces.size() == 4);
  Point3 low = mesh.vertices.front(), high = low;
  for (const Point3& p : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(low[k] == doctest::Approx(at_m[k]).epsilon(1e-6));
    CHECK(high[k] - low[k] == doctest::Approx(size_m).epsilon(1e-6));
  }
}

bool nodes_are_skipped() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

std::string node_refusal(const std::string& bytes, ImportFormat format, const std::string& node) {
  try {
    node_of(bytes, format, node);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_SUITE("tools.node_mesh") {
  TEST_CASE("glTF: nodes at their places below others, instances of one mesh apart") {
    if (nodes_are_skipped()) return;
    const std::string text = gltf_of_nodes(
        "{\"name\":\"base\",\"mesh\":0,\"children\":[1]},"
        "{\"name\":\"on base\",\"mesh\":0,\"translation\":[0,0,2],\"scale\":[0.5,0.5,0.5]},"
        "{\"name\":\"bolts\",\"translation\":[10,0,0],\"scale\":[2,2,2],\"children\":[3,4,5]},"
        "{\"name\":\"bolt\",\"mesh\":0,\"translation\":[1,0,0]},"
        "{\"name\":\"bolt\",\"mesh\":0,\"translation\":[3,0,0]},{\"name\":\"lamp\"}",
        "0,2");
    const RawMesh whole = node_of(text, ImportFormat::kGltf);
    CHECK(whole.faces.size() == 16);
    CHECK(names_in(whole, false) == Names{"base", "on base", "bolts", "bolt:1", "bolt:2"});
    CHECK(names_in(whole, true) == Names{"base", "on base", "bolt:1", "bolt:2"});
    const auto check = [&](const std::string& node, double size_m, const Point3& at_m) {
      check_place(node_of(text, ImportFormat::kGltf, node), node, size_m, at_m);
    };
    check("base", 1.0, {0, 0, 0});
    check("on base", 0.5, {0, 0, 2});
    check("bolt:1", 2.0, {12, 0, 0});
    check("bolt:2", 2.0, {16, 0, 0});
    CHECK(node_of(text, ImportFormat::kGltf, "bolts").faces.size() == 8);
    CHECK(node_of(text, ImportFormat::kGltf, " base ").faces.size() == 4);
    // One root alone is a node like others.
    CHECK(
        names_in(node_of(gltf_of_nodes("{\"name\":\"ROOT\",\"mesh\":0}", "0"), ImportFormat::kGltf),
                 false) == Names{"ROOT"});
  }

  TEST_CASE("COLLADA: nodes by their names, not by their ids") {
    if (nodes_are_skipped()) return;
    const std::string mesh = "<instance_geometry url=\"#g\"/>";
    const std::string text = dae_of_nodes(
        "<node id=\"n1\" name=\"peg\"><translate>1 0 0</translate>" + mesh +
            "</node><node id=\"n2\" name=\"frame\"><translate>0 5 0</translate>"
            "<node id=\"n3\" name=\"wall\">" +
            mesh + "</node><node id=\"n4\" name=\"wall\"><translate>0 0 7</translate>" + mesh +
            "</node></node>",
        "<unit meter=\"0.5\"/>");
    const RawMesh whole = node_of(text, ImportFormat::kDae);
    CHECK(names_in(whole, true) == Names{"peg", "wall:1", "wall:2"});
    const auto check = [&](const std::string& node, const Point3& at_m) {
      check_place(node_of(text, ImportFormat::kDae, node), node, 0.5, at_m);
    };
    check("peg", {0.5, 0, 0});
    check("wall:1", {0, 2.5, 0});
    check("wall:2", {0, 2.5, 3.5});
    CHECK(node_of(text, ImportFormat::kDae, "frame").faces.size() == 8);
    const std::string nameless = "<node>" + mesh + "</node>";
    CHECK(names_in(node_of(dae_of_nodes(nameless + nameless), ImportFormat::kDae), true) ==
          Names{"node:1", "node:2"});
  }

  TEST_CASE("3MF: the items of the build, or the components where there is one item") {
    if (nodes_are_skipped()) return;
    const std::string resources =
        object_of_3mf("1", "name=\"peg\"") + object_of_3mf("2") +
        "<object id=\"3\" name=\"pair\"><components><component objectid=\"1\"/>"
        "<component objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 0 4 0\"/></components></object>";
    const std::string place = "transform=\"2 0 0 0 2 0 0 0 2 10 0 0\"";
    const std::string several = archive_of_3mf(
        metre_model_of_3mf(resources, "<item objectid=\"1\"/><item objectid=\"3\" " + place +
                                          "/><item objectid=\"1\" printable=\"0\"/>"));
    const RawMesh whole = node_of(several, ImportFormat::k3mf);
    CHECK(names_in(whole, false) == Names{"peg:1", "pair", "peg:2", "object 2"});
    CHECK(names_in(whole, true) == Names{"peg:1", "pair"});
    check_place(node_of(several, ImportFormat::k3mf, "peg:1"), "peg:1", 1.0, {0, 0, 0});
    check_place(node_of(several, ImportFormat::k3mf, "peg:2"), "peg:2", 2.0, {10, 0, 0});
    check_place(node_of(several, ImportFormat::k3mf, "object 2"), "object 2", 2.0, {10, 8, 0});
    CHECK(node_of(several, ImportFormat::k3mf, "pair").faces.size() == 8);
    CHECK(node_of(several, ImportFormat::k3mf, "pair").warnings.size() == 1);  // not printed
    const std::string one = archive_of_3mf(metre_model_of_3mf(resources, "<item objectid=\"3\"/>"));
    CHECK(names_in(node_of(one, ImportFormat::k3mf), true) == Names{"peg", "object 2"});
    // Slicers keep names in their settings.
    const std::string project = archive_of_3mf(
        metre_model_of_3mf(
            object_of_3mf("1") + object_of_3mf("2") +
                "<object id=\"3\"><components><component objectid=\"1\"/></components>"
                "</object>",
            "<item objectid=\"3\"/><item objectid=\"2\"/>"),
        {{"Metadata/model_settings.config",
          "<config><object id=\"3\"><metadata key=\"name\" value=\"box.stl\"/><part id=\"1\" "
          "subtype=\"normal_part\"><metadata key=\"name\" value=\"lid\"/></part></object>"
          "<object id=\"2\"><metadata key=\"name\" value=\"peg.stl\"/></object></config>"}});
    CHECK(names_in(node_of(project, ImportFormat::k3mf), false) ==
          Names{"box.stl", "lid", "peg.stl"});
  }

  TEST_CASE("AMF: objects at the places of their constellations, by metadata or id") {
    if (nodes_are_skipped()) return;
    std::string named = amf_object("1");
    named.insert(named.find("<mesh>"), "<metadata type=\"name\"> gear </metadata>");
    const std::string text =
        amf_of(named + amf_object("7") +
                   "<constellation id=\"9\"><instance objectid=\"1\"><deltax>3</deltax></instance>"
                   "<instance objectid=\"1\"><deltax>5</deltax></instance></constellation>",
               "unit=\"meter\"");
    const RawMesh whole = node_of(text, ImportFormat::kAmf);
    CHECK(names_in(whole, false) == Names{"object 7", "constellation 9", "gear:1", "gear:2"});
    CHECK(names_in(whole, true) == Names{"object 7", "gear:1", "gear:2"});
    check_place(node_of(text, ImportFormat::kAmf, "gear:2"), "gear:2", 1.0, {5, 0, 0});
    CHECK(node_of(text, ImportFormat::kAmf, "constellation 9").faces.size() == 8);
  }

  TEST_CASE("a name that no node has, or several, is refused with those of the file") {
    if (nodes_are_skipped()) return;
    const std::string text = gltf_of_nodes(
        "{\"name\":\"base\",\"mesh\":0},{\"name\":\"bolt\",\"mesh\":0},"
        "{\"name\":\"bolt\",\"mesh\":0},{\"name\":\"lamp\"}",
        "0,1,2,3");
    const std::string list = "its nodes are 'base', 'bolt:1', 'bolt:2'";
    CHECK(node_refusal(text, ImportFormat::kGltf, "bolt") ==
          "part: 2 nodes have the name 'bolt'; name one of 'bolt:1', 'bolt:2'; " + list);
    CHECK(node_refusal(text, ImportFormat::kGltf, "bse") ==
          "part: no node 'bse'; did you mean 'base'? " + list);
    CHECK(node_refusal(text, ImportFormat::kGltf, "lamp") == "part: no node 'lamp'; " + list);
    CHECK(
        node_refusal(text, ImportFormat::kGltf, "bolt:3").starts_with("part: no node 'bolt:3'; "));
    CHECK(node_refusal(tetrahedron_amf(), ImportFormat::kAmf, "x") ==
          "part: no node 'x'; its only node is 'object 0'");
    RawMesh none = node_of(tetrahedron_amf(), ImportFormat::kAmf);
    none.nodes.clear();
    CHECK_THROWS_WITH_AS(mesh_of_node(none, "x"),
                         "part: no node 'x'; the file has no named nodes: leave out # and the "
                         "name, which takes the whole file",
                         InputError);
  }

  TEST_CASE("what a child says of nodes is checked") {
    ImportedMesh imported;
    imported.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    imported.mesh.faces.resize(2);
    for (RawFace& face : imported.mesh.faces) face.vertices = {0, 1, 2};
    imported.mesh.faces[1].group = 1;
    imported.mesh.nodes = {{"a", MeshNode::kNone, false}, {"b", 0, true}};
    imported.mesh.group_nodes = {0, 1};
    const RawMesh said = mesh_of_message(message_of(imported), "part").mesh;
    REQUIRE(said.nodes.size() == 2);
    CHECK(said.nodes[1].name == "b");
    CHECK(said.nodes[1].parent == 0);
    CHECK(said.nodes[1].is_part);
    CHECK(said.nodes[0].parent == MeshNode::kNone);
    CHECK(said.group_nodes == imported.mesh.group_nodes);
    const auto is_refused = [](const ImportedMesh& hostile) {
      CHECK_THROWS_AS(mesh_of_message(message_of(hostile), "part"), InputError);
    };
    imported.deflection = Deflection{2e-4, 1e-4};
    imported.node_deflections = {{}, {5e-5, 4e-5}};
    const ImportedMesh step = mesh_of_message(message_of(imported), "part");
    REQUIRE(step.node_deflections.size() == 2);
    CHECK(step.node_deflections[1].asked_m == 5e-5);
    CHECK(node_of(step, "b").deflection->found_m == 4e-5);
    CHECK(node_of(step, "b").mesh.faces.size() == 1);
    ImportedMesh hostile = imported;
    hostile.node_deflections.pop_back();
    is_refused(hostile);
    hostile = imported;
    hostile.node_deflections[0].found_m = -1.0;
    is_refused(hostile);
    hostile = imported;
    hostile.mesh.nodes[0].parent = 0;
    is_refused(hostile);
    hostile = imported;
    hostile.mesh.nodes[0].name = " a";
    is_refused(hostile);
    hostile = imported;
    hostile.mesh.nodes[0].name.clear();
    is_refused(hostile);
    hostile = imported;
    hostile.mesh.group_nodes[1] = 2;
    is_refused(hostile);
    hostile = imported;
    hostile.mesh.group_nodes.pop_back();
    is_refused(hostile);
  }
}
