// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>

#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

RawMesh amf(const std::string& items) {
  return import_bytes(amf_of(items, "unit=\"meter\""), ImportFormat::kAmf, "part", {}).mesh;
}

std::string amf_refusal(const std::string& bytes) {
  try {
    import_bytes(bytes, ImportFormat::kAmf, "part", {});
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool has_corner(const RawMesh& mesh, const Point3& corner) {
  for (const Point3& p : mesh.vertices) {
    if (std::hypot(p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]) < 1e-12) return true;
  }
  return false;
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

bool is_amf_skipped() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

}  // namespace

TEST_SUITE("tools.amf_import") {
  TEST_CASE("all volumes of all objects, each a group") {
    if (is_amf_skipped()) return;
    const RawMesh mesh = amf(amf_object("1", 3) + amf_object("2"));
    REQUIRE(mesh.faces.size() == 16);
    CHECK(mesh.vertices.size() == 16);
    for (std::size_t f = 0; f < 16; ++f) CHECK(mesh.faces[f].group == f / 4);
    // A volume shares no corner with another.
    CHECK(mesh.faces[0].vertices[0] != mesh.faces[4].vertices[0]);
  }

  TEST_CASE("instances are turned about the fixed axes x, y, z and then shifted") {
    if (is_amf_skipped()) return;
    const auto placed = [](const std::string& place) {
      return amf("<constellation id=\"2\"><instance objectid=\"1\">" + place +
                 "</instance></constellation>" + amf_object("1"));
    };
    const RawMesh plain = placed("");
    CHECK(plain.faces.size() == 4);
    CHECK(has_corner(plain, {1, 0, 0}));
    CHECK(has_corner(placed("<rx>90</rx>"), {0, 0, 1}));
    CHECK(has_corner(placed("<rx>90</rx>"), {0, -1, 0}));
    CHECK(has_corner(placed("<ry>90</ry>"), {0, 0, -1}));
    CHECK(has_corner(placed("<rz>90</rz>"), {-1, 0, 0}));
    const RawMesh all = placed(
        "<deltax>10</deltax><deltay> 20 </deltay><deltaz>30</deltaz><rx>90</rx><ry>90</ry>"
        "<rz>90</rz>");
    // z to -y by x, stays by y, to x by z.
    CHECK(has_corner(all, {11, 20, 30}));
    CHECK(has_corner(all, {10, 20, 29}));
    CHECK_FALSE(has_corner(all, {9, 20, 30}));
    CHECK(volume(clean(all)) == doctest::Approx(1.0 / 6));
  }

  TEST_CASE("nested constellations; what they name stands only where they place it") {
    if (is_amf_skipped()) return;
    const RawMesh mesh =
        amf(amf_object("1") + amf_object("free") +
            "<constellation id=\"row\"><instance objectid=\"1\"><deltax>2</deltax></instance>"
            "<instance objectid=\"1\"><deltax>4</deltax></instance></constellation>"
            "<constellation id=\"top\"><instance objectid=\"row\"><rz>90</rz><deltaz>5</deltaz>"
            "</instance><instance objectid=\"row\"><deltaz>-5</deltaz></instance></constellation>");
    CHECK(mesh.faces.size() == 20);
    CHECK(mesh.faces.back().group == 4);
    for (const Point3& origin :
         {Point3{0, 0, 0}, Point3{0, 2, 5}, Point3{0, 4, 5}, Point3{2, 0, -5}, Point3{4, 0, -5}}) {
      CHECK(has_corner(mesh, origin));
    }
    CHECK(has_corner(mesh, {-1, 2, 5}));
  }

  TEST_CASE("units, archives, and what is skipped") {
    if (is_amf_skipped()) return;
    const std::pair<const char*, double> units[] = {{"", 1e-3},
                                                    {"unit=\"micron\"", 1e-6},
                                                    {"unit=\"micrometer\"", 1e-6},
                                                    {"unit=\"feet\"", 0.3048},
                                                    {"unit=\"foot\"", 0.3048},
                                                    {"unit=\"inch\"", 0.0254}};
    for (const auto& [root, unit_m] : units) {
      const std::string text = tetrahedron_amf(root);
      for (const std::string& bytes : {text, zip_of({{"a.amf", text}}, Packing::kDeflated)}) {
        const ImportedMesh imported = import_bytes(bytes, ImportFormat::kAmf, "part", {});
        CHECK(imported.unit_m == unit_m);
        CHECK(has_corner(imported.mesh, {unit_m, 0, 0}));
      }
    }
    const std::string decorated =
        with(with(amf_object("1"), "</coordinates>",
                  "</coordinates><normal><nx>0</nx><ny>0</ny><nz>1</nz></normal>"),
             "<triangle>", "<color><r>1</r></color><triangle>");
    CHECK(
        amf("<metadata type=\"name\">n</metadata><material id=\"1\"/>" + decorated).faces.size() ==
        4);
  }

  TEST_CASE("defects are said with their line") {
    if (is_amf_skipped()) return;
    const std::string object = amf_object("1");
    const auto constellation = [](const std::string& id, const std::string& objectid) {
      return "<constellation id=\"" + id + "\">\n<instance objectid=\"" + objectid + "\"/>" +
             "<instance objectid=\"" + objectid + "\"/></constellation>";
    };
    std::string deep = object, wide = "<object id=\"0\"/>";
    for (int k = 1; k < 60; ++k) {
      deep += "<constellation id=\"" + std::to_string(k + 1) + "\"><instance objectid=\"" +
              std::to_string(k) + "\"/></constellation>";
    }
    for (int k = 0; k < 30; ++k) {
      wide += constellation(std::to_string(k + 1), std::to_string(k));
    }
    const std::pair<std::string, const char*> defects[] = {
        {with(object, "<v2>1</v2>", "<v2>\n4</v2>"), "part:2: a triangle uses vertex 4 of 4"},
        {with(object, "<v2>1</v2>", "<v2>-1</v2>"), "a triangle uses vertex -1 of 4"},
        {with(object, "<v2>1</v2>", "<v2>1.5</v2>"), "part:2: v2 '1.5'"},
        {with(object, "<v2>1</v2>", ""), "part:2: <triangle> has no <v2>"},
        {with(object, "<v2>1</v2>", "<v2>1</v2><v2>1</v2>"), "<triangle> has two <v2>"},
        {with(object, "<y>1</y>", "<y>0,5</y>"), "part:2: y '0,5'"},
        {with(object, "<y>1</y>", "<y>nan</y>"), "part:2: y 'nan'"},
        {with(object, "<y>1</y>", "<y>1e308</y>") +
             "\n<constellation><instance objectid=\"1\"><deltay>1e308</deltay></instance>"
             "</constellation>",
         "part:2: a corner of the object is not finite"},
        {with(with(object, "<vertices>", "<a>"), "</vertices>", "</a>"),
         "<mesh> has no <vertices>"},
        {with(object, "<volume>", "<volume type=\"support\">"), "a volume is a support"},
        {object + "\n" + object, "part:3: id '1' is that of line 2 too"},
        {object + constellation("2", "7"), "part:3: an instance names object '7', which is not"},
        {object + constellation("2", ""), "an instance names object ''"},
        {object + constellation("2", "2"), "part:2: constellation '2' places itself"},
        {object + constellation("2", "3") + constellation("3", "2"), "places itself"},
        {object + "\n<constellation id=\"2\"><instance objectid=\"1\"/><instance objectid=\"2\"/>"
                  "</constellation>",
         "part:3: constellation '2' places itself"},
        {object + constellation("2", "3") + constellation("3", "2") + constellation("4", "3"),
         "places itself"},
        {deep, "constellations are nested too deeply"},
        {wide, "place more than 1000000 parts"},
        {"<object id=\"1\"/>", "the file holds no face"}};
    for (const auto& defect : defects) {
      const auto& items = defect.first;
      const auto& says = defect.second;
      CAPTURE(items);
      const std::string text = amf_refusal(amf_of(items, "unit=\"meter\""));
      CAPTURE(text);
      CHECK(contains(text, says));
      CHECK(contains(text, "; "));
    }
    CHECK(contains(amf_refusal(zip_of({{"a.txt", "x"}})), "holds no file '*.amf'"));
  }
}
