// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

ImportedMesh collada(const std::string& text) {
  return import_bytes(text, ImportFormat::kDae, "part", {});
}

std::string collada_refusal(const std::string& text) {
  try {
    collada(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string exchanged(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// Geometries before the tetrahedron "g".
std::string with_geometries(const std::string& geometries) {
  return exchanged(tetrahedron_dae(), "<library_geometries>",
                   "<library_geometries>\n" + geometries);
}

std::string hull(const std::string& id, const std::string& of) {
  return "<geometry id=\"" + id + "\"><convex_mesh convex_hull_of=\"" + of + "\"/></geometry>\n";
}

bool is_collada_skipped() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

}  // namespace

TEST_SUITE("tools.collada_import") {
  TEST_CASE("a convex mesh with faces is a mesh") {
    if (is_collada_skipped()) return;
    const std::string text =
        exchanged(tetrahedron_dae("<unit meter=\"0.5\"/>"), "mesh>", "convex_mesh>");
    REQUIRE(contains(text, "</convex_mesh>"));
    const ImportedMesh imported = collada(text);
    CHECK(imported.unit_m == 0.5);
    CHECK(imported.mesh.warnings.empty());
    CHECK(volume(clean(imported.mesh)) == doctest::Approx(0.125 / 6));
  }

  TEST_CASE("the convex hull of a geometry is taken from there, and told") {
    if (is_collada_skipped()) return;
    const std::string text =
        exchanged(with_geometries(hull("h", "#k") + hull("k", "#g")), "url=\"#g\"", "url=\"#h\"");
    const ImportedMesh imported = collada(text);
    CHECK(imported.mesh.faces.size() == 4);
    REQUIRE(imported.mesh.warnings.size() == 1);
    CHECK(imported.mesh.warnings[0] ==
          "geometry '#h' is to be the convex hull of geometry '#g'; the mesh of that is taken as "
          "it is");
    CHECK(collada(exchanged(text, "mesh>", "convex_mesh>")).mesh.faces.size() == 4);
    // Nothing is asked of a geometry that no node has.
    CHECK(collada(with_geometries(hull("h", "#h"))).mesh.warnings.empty());
  }

  TEST_CASE("a file of cameras and lines, and text in UTF-16, are refused by what they are") {
    if (is_collada_skipped()) return;
    const std::string camera =
        exchanged(exchanged(tetrahedron_dae(), "instance_geometry", "instance_camera"),
                  "url=\"#g\"", "url=\"#c\"");
    CHECK(collada_refusal(camera) ==
          "part: no node of it has a mesh with faces; export the part with its mesh");
    std::string wide = "\xFF\xFE";
    for (const char c : tetrahedron_dae()) wide += {c, '\0'};
    CHECK(collada_refusal(wide) ==
          "part: byte 0: the text is UTF-16; save the file as UTF-8 or plain ASCII");
    CHECK(contains(collada_refusal(tetrahedron_dae() + "<COLLADA/>"),
                   "part:3: a second root element <COLLADA> stands behind the first"));
  }

  TEST_CASE(
      "shapes of rigid bodies are read where no node has a mesh, at the node and their place") {
    if (is_collada_skipped()) return;
    const auto physics = [](const std::string& shapes, const std::string& target) {
      const std::string bare = exchanged(tetrahedron_dae(), "<instance_geometry url=\"#g\"/>",
                                         "<translate>5 0 0</translate>");
      REQUIRE(!contains(bare, "instance_geometry"));
      return exchanged(
          exchanged(bare, "mesh>", "convex_mesh>"), "<scene>",
          "<library_physics_models><physics_model id=\"m\"><rigid_body sid=\"b\">"
          "<technique_common>" +
              shapes +
              "</technique_common></rigid_body></physics_model>"
              "</library_physics_models>\n<library_physics_scenes><physics_scene id=\"p\">"
              "<instance_physics_model url=\"#m\"><instance_rigid_body target=\"" +
              target +
              "\" body=\"b\"/></instance_physics_model></physics_scene></library_physics_scenes>"
              "<scene>");
    };
    const std::string still =
        "<shape><translate>0 0 0</translate><rotate>1 0 0 0</rotate>"
        "<instance_geometry url=\"g\"/></shape>";
    const std::string moved =
        "<shape><translate>0 0 7</translate><rotate>0 0 1 180</rotate>"
        "<instance_geometry url=\"#g\"/></shape>";
    const RawMesh mesh = collada(physics(still + moved, "#n")).mesh;
    CHECK(mesh.faces.size() == 8);
    REQUIRE(mesh.warnings.size() == 1);
    CHECK(mesh.warnings[0] ==
          "no node has a mesh of its own; the shapes of the rigid bodies are taken");
    for (const Point3& corner :
         {Point3{6, 0, 0}, Point3{5, 0, 1}, Point3{5, 0, 8}, Point3{4, 0, 7}}) {
      CHECK(has_corner_at(mesh, corner, 1e-6));
    }
    CHECK(contains(collada_refusal(physics(still, "#x")),
                   "part:3: <instance_rigid_body> names node '#x' and body 'b', and one of them"));
    CHECK(contains(collada_refusal(physics("<shape><box/></shape>", "#n")),
                   "a shape of a rigid body is no mesh"));
    CHECK(contains(collada_refusal(physics(exchanged(still, "\"g\"", "\"h\""), "#n")),
                   "<instance_geometry> names geometry '#h', which is not in the file"));
  }

  TEST_CASE("pictures and materials that are not there do not matter to a mesh") {
    if (is_collada_skipped()) return;
    const std::string looks =
        "<library_images><image id=\"i\"><init_from/></image></library_images>"
        "<library_effects><effect id=\"e\"/></library_effects>"
        "<library_materials><material id=\"m\"><instance_effect url=\"#x\"/></material>"
        "</library_materials>";
    const std::string bound =
        "<instance_geometry url=\"#g\"><bind_material><technique_common><instance_material "
        "symbol=\"s\" target=\"#y\"/></technique_common></bind_material></instance_geometry>";
    const std::string text =
        exchanged(exchanged(tetrahedron_dae(), "<instance_geometry url=\"#g\"/>", bound),
                  "<library_geometries>", looks + "<library_geometries>");
    REQUIRE(contains(text, "bind_material"));
    CHECK(collada(text).mesh.faces.size() == 4);
  }

  TEST_CASE("a geometry with several meshes is refused") {
    if (is_collada_skipped()) return;
    const std::string refusal =
        collada_refusal(exchanged(tetrahedron_dae(), "</mesh>", "</mesh><convex_mesh/>"));
    CHECK(refusal.find("geometry 'g' has several meshes; export each") != std::string::npos);
  }

  TEST_CASE("geometries that are not there, or are no mesh, are refused with their line") {
    if (is_collada_skipped()) return;
    const auto of = [](const std::string& geometries) {
      return collada_refusal(exchanged(with_geometries(geometries), "url=\"#g\"", "url=\"#h\""));
    };
    CHECK(contains(of(""), "<instance_geometry> names geometry '#h', which is not in the file"));
    CHECK(contains(of(hull("h", "#x")), "part:3: <convex_mesh> names geometry '#x'"));
    CHECK(contains(of(hull("h", "other.dae#g")), "names geometry 'other.dae#g'"));
    CHECK(contains(of(hull("h", "#h")), "geometry '#h' is the convex hull of itself"));
    CHECK(contains(of(hull("h", "#k") + hull("k", "#h")), "is the convex hull of itself"));
    CHECK(contains(of("<geometry id=\"h\">\n<convex_mesh><source id=\"s\"/></convex_mesh>"
                      "</geometry>"),
                   "part:4: geometry 'h' is to be the convex hull of its points"));
    CHECK(contains(of("<geometry id=\"h\"><brep/></geometry>"), "given by <brep>"));
  }
}
