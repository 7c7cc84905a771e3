// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

using Files = std::vector<std::pair<std::string, std::string>>;

RawMesh threemf(const std::string& archive) {
  return import_bytes(archive, ImportFormat::k3mf, "part", {}).mesh;
}

RawMesh threemf(const std::string& resources, const std::string& build, const Files& further = {}) {
  return threemf(archive_of_3mf(metre_model_of_3mf(resources, build), further));
}

std::string threemf_refusal(const std::string& archive) {
  try {
    threemf(archive);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string item(const std::string& id, const std::string& attributes = "") {
  return "<item objectid=\"" + id + "\" " + attributes + "/>";
}

/// `components`: the elements of an object.
std::string assembly(const std::string& id, const std::string& components) {
  return "\n<object id=\"" + id + "\"><components>" + components + "</components></object>";
}

std::string component(const std::string& id, const std::string& attributes = "") {
  return "<component objectid=\"" + id + "\" " + attributes + "/>";
}

std::string shifted(double x, double y, double z) {
  return "transform=\"1 0 0 0 1 0 0 0 1 " + std::to_string(x) + " " + std::to_string(y) + " " +
         std::to_string(z) + "\"";
}

bool is_3mf_skipped() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

/// The one warning of a mesh with the tetrahedron alone.
std::string warning_of(const RawMesh& mesh) {
  CHECK(mesh.faces.size() == 4);
  REQUIRE(mesh.warnings.size() == 1);
  return mesh.warnings[0];
}

}  // namespace

TEST_SUITE("tools.threemf_import") {
  TEST_CASE("coordinates keep their double precision, and transforms have points as rows") {
    if (is_3mf_skipped()) return;
    const std::string fine = replaced(object_of_3mf("1"), "x=\"1\"", "x=\" +1.000000000123 \"");
    CHECK(threemf(fine, item("1")).vertices.front() == Point3{0, 0, 0});
    const RawMesh mesh = threemf(fine, item("1"));
    CHECK(std::ranges::count(mesh.vertices, Point3{1.000000000123, 0, 0}) == 1);
    // x to y, y to z, z to x, then the shift.
    const RawMesh turned =
        threemf(object_of_3mf("1"), item("1", "transform=\"0 2 0\n0 0 3 4 0 0 10 20 30\""));
    CHECK(has_corner_at(turned, {10, 22, 30}));
    CHECK(has_corner_at(turned, {10, 20, 33}));
    CHECK(has_corner_at(turned, {14, 20, 30}));
    CHECK(volume(clean(turned)) == doctest::Approx(4.0));
    CHECK(turned.warnings.empty());
  }

  TEST_CASE("a mirrored place turns the triangles, two of them do not") {
    if (is_3mf_skipped()) return;
    const std::string mirror = "transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"";
    const auto volume_of = [](const RawMesh& mesh) {
      double six = 0.0;
      for (const RawFace& face : mesh.faces) {
        const Point3 &a = mesh.vertices[face.vertices[0]], &b = mesh.vertices[face.vertices[1]],
                     &c = mesh.vertices[face.vertices[2]];
        six += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
      }
      return six / 6;
    };
    CHECK(volume_of(threemf(object_of_3mf("1"), item("1", mirror))) == doctest::Approx(1.0 / 6));
    const std::string twice = object_of_3mf("1") + assembly("2", component("1", mirror));
    CHECK(volume_of(threemf(twice, item("2", mirror))) == doctest::Approx(1.0 / 6));
  }

  TEST_CASE("components, nested, in further models of the archive, under any prefix") {
    if (is_3mf_skipped()) return;
    const std::string model = metre_model_of_3mf(
        assembly("7", "<component q:path=\"/3D/Objects/a%20b.model\" objectid=\"2\" " +
                          shifted(0, 0, 5) + "/>") +
            object_of_3mf("1"),
        item("7", shifted(30, 0, 0)) + item("1") +
            "<item objectid=\"1\" q:path=\"/3d/objects/A B.model\" " + shifted(0, -9, 0) + "/>",
        "xmlns:q=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" "
        "requiredextensions=\"q\"");
    std::string further = metre_model_of_3mf(
        assembly("2", component("1", shifted(0, 7, 0))) + object_of_3mf("1"), "");
    const RawMesh mesh = threemf(archive_of_3mf(model, {{"3D/Objects/a b.model", further}}));
    CHECK(mesh.faces.size() == 12);
    CHECK(mesh.warnings.empty());
    for (const Point3& corner : {Point3{31, 7, 5}, Point3{1, 0, 0}, Point3{0, -9, 1}}) {
      CHECK(has_corner_at(mesh, corner));
    }
    CHECK(contains(threemf_refusal(archive_of_3mf(model, Files{})),
                   "part: the archive holds no model '/3D/Objects/a%20b.model'"));
    further = replaced(further, "meter", "inch");
    CHECK(contains(threemf_refusal(archive_of_3mf(model, {{"3D/Objects/a b.model", further}})),
                   "its unit is not that of the first model"));
  }

  TEST_CASE("the core under a prefix, pictures, materials and a model that no .rels names") {
    if (is_3mf_skipped()) return;
    std::string prefixed = metre_model_of_3mf(object_of_3mf("1"), item("1"));
    for (const char* name : {"model", "resources", "object", "mesh", "vertices", "vertex",
                             "triangles", "triangle", "build", "item"}) {
      for (const std::string open : {"<", "</"}) {
        for (const std::string close : {" ", ">"}) {
          const std::string from = open + name + close, to = open + "c:" + name + close;
          for (std::size_t at = 0; (at = prefixed.find(from, at)) != std::string::npos;) {
            prefixed.replace(at, from.size(), to);
          }
        }
      }
    }
    prefixed = replaced(prefixed, "xmlns=", "xmlns:c=");
    CHECK(threemf(archive_of_3mf(prefixed)).faces.size() == 4);
    const std::string model = metre_model_of_3mf("<basematerials id=\"9\"/>" + object_of_3mf("1"),
                                                 item("1"), "requiredextensions=\"m p\"");
    CHECK(threemf(archive_of_3mf(model, {{"Metadata/thumbnail.png", "\x89PNG"}})).faces.size() ==
          4);
    CHECK(threemf(zip_of({{"3D/3dmodel.model", model}})).faces.size() == 4);
    CHECK(threemf(zip_of({{"_rels/.rels", "<Relationships/>"}, {"3D/3DModel.model", model}}))
              .faces.size() == 4);
  }

  TEST_CASE("two models as the root of the archive, and two roots of one, are refused") {
    if (is_3mf_skipped()) return;
    const std::string model = metre_model_of_3mf(object_of_3mf("1"), item("1"));
    const auto with_roots = [&](const std::string& first, const std::string& second) {
      const auto line = [](const std::string& target) {
        return "\n<Relationship Target=\"" + target +
               "\" Id=\"r\" "
               "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>";
      };
      return zip_of(
          {{"_rels/.rels", "<Relationships>" + line(first) + line(second) + "</Relationships>"},
           {"3D/a.model", model},
           {"3D/b.model", model}});
    };
    CHECK(threemf_refusal(with_roots("/3D/a.model", "/3D/b.model")) ==
          "part: _rels/.rels:3: two models are named as the root of the archive, '/3D/a.model' and "
          "'/3D/b.model'; leave the line of one of them, or export the file again");
    CHECK(threemf(with_roots("/3D/a.model", "3d/A.model")).faces.size() == 4);
    CHECK(contains(threemf_refusal(archive_of_3mf(model + "\n<model/>")),
                   "a second root element <model> stands behind the first"));
  }

  TEST_CASE("what is no material is left out, and told") {
    if (is_3mf_skipped()) return;
    const std::string part = object_of_3mf("1", "type=\"model\"");
    for (const std::string type : {"support", "solidsupport", "other"}) {
      CHECK(warning_of(threemf(part + "\n" + object_of_3mf("2", "name=\"n\" type=\"" + type + "\""),
                               item("1") + item("2") + item("2"))) ==
            "left out: object '2' named 'n' (line 3) and 1 more, since its type is '" + type + "'");
    }
    CHECK(contains(warning_of(threemf(part + object_of_3mf("2", "type=\"other\"") +
                                          assembly("3", component("1") + component("2")),
                                      item("3"))),
                   "since its type is 'other'"));
    CHECK(contains(
        warning_of(threemf(part + object_of_3mf("2"), item("1") + item("2", "printable=\"0\""))),
        "since its item is marked as not to be printed"));
    CHECK(warning_of(threemf(part + object_of_3mf("2"), item("1"))) ==
          "left out: object '2' (line 2), since no item of the build names it");
    CHECK(contains(warning_of(threemf(part + "<object id=\"2\"/>", item("1") + item("2"))),
                   "since it has no mesh"));
    CHECK(threemf(object_of_3mf("1", "type=\"surface\""), item("1", "printable=\"1\""))
              .warnings.empty());
    // Nothing is left.
    CHECK(contains(
        threemf_refusal(archive_of_3mf(metre_model_of_3mf(part, item("1", "printable=\"0\"")))),
        "part: nothing of it is material (left out: object '1'"));
  }

  TEST_CASE("modifiers and blockers of slicers are left out, and what they cut is refused") {
    if (is_3mf_skipped()) return;
    // The second of two volumes in one mesh.
    std::string two = object_of_3mf("1");
    const std::string more = "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/>";
    two = replaced(two, "</triangles>", more + more + "</triangles>");
    const auto prusa = [&](const std::string& metadata, const std::string& last = "5") {
      return archive_of_3mf(
          metre_model_of_3mf(two, item("1")),
          {{"Metadata/Slic3r_PE_model.config",
            "<config><object id=\"1\"><volume firstid=\"0\" lastid=\"3\"><metadata type=\"volume\" "
            "key=\"volume_type\" value=\"ModelPart\"/></volume>\n<volume firstid=\"4\" lastid=\"" +
                last + "\"><metadata type=\"volume\" " + metadata +
                "/></volume></object></config>"}});
    };
    CHECK(warning_of(threemf(prusa("key=\"volume_type\" value=\"ParameterModifier\""))) ==
          "left out: triangles 4 to 5 of object '1', since it is a modifier of PrusaSlicer");
    CHECK(contains(warning_of(threemf(prusa("key=\"modifier\" value=\"1\""))), "a modifier"));
    CHECK(threemf(prusa("key=\"volume_type\" value=\"ModelPart\"")).faces.size() == 6);
    CHECK(contains(threemf_refusal(prusa("key=\"volume_type\" value=\"NegativeVolume\"")),
                   "a negative volume of PrusaSlicer, which is to be cut out of it"));
    CHECK(contains(threemf_refusal(prusa("key=\"modifier\" value=\"1\"", "6")),
                   "name triangles 4 to 6 of object '1', which has 6"));
    CHECK(contains(threemf_refusal(prusa("key=\"modifier\" value=\"1\"", "-6")),
                   "part: Metadata/Slic3r_PE_model.config:2: lastid is negative"));

    const auto bambu = [&](const std::string& subtype) {
      return archive_of_3mf(
          metre_model_of_3mf(object_of_3mf("1") + object_of_3mf("2") +
                                 assembly("3", component("1") + component("2")),
                             item("3")),
          {{"Metadata/model_settings.config",
            "<config><object id=\"3\"><part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" "
            "subtype=\"" +
                subtype + "\"/></object></config>"}});
    };
    CHECK(contains(warning_of(threemf(bambu("support_blocker"))), "a support blocker of the"));
    CHECK(threemf(bambu("normal_part")).faces.size() == 8);
    CHECK(contains(threemf_refusal(bambu("negative_part")), "is a negative part of the slicer"));

    const auto cura = [](const std::string& value) {
      return threemf(
          object_of_3mf("1") + replaced(object_of_3mf("2"), "<mesh>",
                                        "<metadatagroup><metadata name=\"cura:infill_mesh\">" +
                                            value + "</metadata></metadatagroup><mesh>"),
          item("1") + item("2"));
    };
    CHECK(contains(warning_of(cura("True")), "a modifier of Cura"));
    CHECK(cura("False").faces.size() == 8);
  }

  TEST_CASE("required extensions that make or change geometry are refused") {
    if (is_3mf_skipped()) return;
    const auto requiring = [](const std::string& root, const std::string& prefixes) {
      return archive_of_3mf(metre_model_of_3mf(object_of_3mf("1"), item("1"),
                                               root + " requiredextensions=\"" + prefixes + "\""));
    };
    const std::string start = "xmlns:z=\"http://schemas.microsoft.com/3dmanufacturing/";
    CHECK(threemf(requiring(start + "material/2015/02\"", "z")).faces.size() == 4);
    CHECK(threemf(requiring(start + "trianglesets/2021/07\"", "z m\np")).faces.size() == 4);
    CHECK(threemf_refusal(requiring(start + "booleanoperations/2023/07\"", "z")) ==
          "part:2: the file requires extension 'z' of 3MF (parts cut by each other), which is not "
          "read; export the part as a plain mesh without this extension, or as STL");
    CHECK(contains(threemf_refusal(requiring("", "v")), "(fields in place of meshes)"));
    CHECK(contains(threemf_refusal(requiring("", "xyz")),
                   "'xyz' of 3MF (without a namespace, so that it is unknown)"));
    CHECK(contains(threemf_refusal(requiring("xmlns:m=\"urn:x\"", "m")),
                   "'m' of 3MF ('urn:x', which is unknown and may change parts)"));
  }

  TEST_CASE("beams and slices are refused where a part that is placed has them, required or not") {
    if (is_3mf_skipped()) return;
    const auto requiring = [](const std::string& prefixes, const std::string& objects) {
      return archive_of_3mf(metre_model_of_3mf(
          objects, item("1"),
          "xmlns:z=\"http://schemas.microsoft.com/3dmanufacturing/slice/2015/07\" "
          "requiredextensions=\"" +
              prefixes + "\""));
    };
    const std::string plain = object_of_3mf("1");
    CHECK(threemf(requiring("b z", plain)).faces.size() == 4);
    const std::string full =
        object_of_3mf("1", "z:meshresolution=\"fullres\" z:slicestackid=\"3\"");
    CHECK(threemf(requiring("z", full)).faces.size() == 4);
    const std::string rough =
        object_of_3mf("1", "z:meshresolution=\"lowres\" z:slicestackid=\"3\"");
    for (const char* prefixes : {"z", ""}) {
      CHECK(
          threemf_refusal(requiring(prefixes, "\n" + rough)) ==
          "part:3: the mesh is a rough one, in place of which slices are printed (lowres); export "
          "the part with its full mesh, or as STL");
    }
    CHECK(threemf(requiring("z", plain + replaced(rough, "id=\"1\"", "id=\"2\""))).faces.size() ==
          4);
    const std::string beams = replaced(object_of_3mf("1"), "</mesh>",
                                       "\n<b:beamlattice><b:beams/></b:beamlattice></mesh>");
    CHECK(contains(threemf_refusal(requiring("b", beams)), "part:3: the mesh holds beams"));
    CHECK(contains(threemf_refusal(archive_of_3mf(metre_model_of_3mf(beams, item("1")))),
                   "part:3: the mesh holds beams"));
    CHECK(contains(threemf_refusal(archive_of_3mf(
                       metre_model_of_3mf("<object id=\"1\">\n<v:levelset/></object>", item("1")))),
                   "part:3: the object is given by <v:levelset> and no mesh"));
  }

  TEST_CASE("defects of models are said with their line") {
    if (is_3mf_skipped()) return;
    const std::string object = object_of_3mf("1");
    std::string deep = object, wide = object;
    for (int k = 1; k < 99; ++k) {
      const std::string id = std::to_string(k), above = std::to_string(k + 1);
      deep += assembly(above, component(id));
      wide += assembly(above, component(id) + component(id));
    }
    struct Defect {
      std::string resources, build;
      const char* says;
    };
    const Defect defects[] = {
        {object, item("7"), "part:2: <item> names object '7', which is not in the model"},
        {assembly("2", component("9")), item("2"), "part:3: <component> names object '9'"},
        {assembly("2", component("2")), item("2"), "components of object '2' run in a circle"},
        {assembly("2", component("3")) + assembly("3", component("2")), item("2"),
         "part:3: the components of object '2' run in a circle"},
        {deep, item("99"), "components are nested too deeply"},
        {wide, item("31"), "place more than 1000000 objects"},
        {object + "\n" + object, item("1"), "part:3: object '1' is in line 2 too"},
        {object + "<object/>", item("1"), "an object has no id"},
        {object_of_3mf("1", "type=\"ghost\""), item("1"), "the type of the object is 'ghost'"},
        {object, item("1", "transform=\"1 0 0 0 1 0 0 0 1\""), "the transform is '1 0 0 0 1"},
        {object, item("1", "transform=\"1 0 0 0 1 0 0 0 1 a 0 0\""), "transform 'a' is not"},
        {object, item("1", "transform=\"1 0 0 0 1 0 0 0 0 0 0 0\""), "the transform flattens"},
        {replaced(object, "x=\"1\"", "x=\"nan\""), item("1"), "x 'nan'"},
        {replaced(object, "x=\"1\"", "x=\"1,5\""), item("1"), "x '1,5' has a comma"},
        {replaced(object, "x=\"1\"", ""), item("1"), "<vertex> has no x"},
        {replaced(object, "x=\"1\"", "x=\"1e308\""),
         item("1", "transform=\"1e9 0 0 0 1 0 0 0 1 0 0 0\""),
         "a corner of the object is not finite"},
        {replaced(object, "v2=\"2\"", "v2=\"4\""), item("1"), "a triangle uses vertex 4 of 4"},
        {replaced(object, "v2=\"2\"", "v2=\"-1\""), item("1"), "a triangle uses vertex -1 of 4"},
        {replaced(object, "v2=\"2\"", ""), item("1"), "<triangle> has no v2"},
        {"<object id=\"1\"><mesh/></object>", item("1"), "nothing of it is material"},
        {object, "", "its <build> has no <item>"}};
    for (const Defect& defect : defects) {
      CAPTURE(defect.resources);
      CAPTURE(defect.build);
      const std::string text =
          threemf_refusal(archive_of_3mf(metre_model_of_3mf(defect.resources, defect.build)));
      CAPTURE(text);
      CHECK(text.starts_with("part:"));
      CHECK(contains(text, defect.says));
      CHECK(contains(text, "; "));
    }
  }

  TEST_CASE("damaged archives") {
    if (is_3mf_skipped()) return;
    const std::string model = metre_model_of_3mf(object_of_3mf("1"), item("1"));
    for (const Packing packing : {Packing::kStored, Packing::kDeflated, Packing::kWide}) {
      const std::string archive = archive_of_3mf(model, packing);
      REQUIRE(threemf(archive).faces.size() == 4);
      // Cut off anywhere.
      for (std::size_t size = 0; size < archive.size(); size += 97) {
        CHECK(threemf_refusal(archive.substr(0, size)).starts_with("part: "));
      }
      CHECK(contains(threemf_refusal(replaced(archive, "x=\"1\"", "x=\"2\"")),
                     "the check sum of '3D/3dmodel.model' is not that of its bytes"));
      std::string encrypted = archive;
      encrypted[encrypted.rfind("PK\1\2") + 8] = 1;
      CHECK(contains(threemf_refusal(encrypted), "the ZIP archive is encrypted"));
      std::string packed = archive;
      packed[packed.rfind("PK\1\2") + 10] = 14;
      CHECK(contains(threemf_refusal(packed), "packed by method 14"));
    }
    CHECK(contains(threemf_refusal(archive_of_3mf(model, {{"3d/3DMODEL.model", model}})),
                   "the archive holds two files '/3D/3dmodel.model'"));
    CHECK(contains(threemf_refusal(archive_of_3mf("\xFF\xFE<")), "the text is UTF-16"));
    CHECK(contains(threemf_refusal(archive_of_3mf("<model")), "the text is no XML"));
    CHECK(contains(threemf_refusal(archive_of_3mf("")), "the file is empty"));
  }
}
