// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <csignal>
#include <fstream>

#include "tests/support/program_run.hpp"
#include "tests/tools/import/import_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/shapes/solid_facts.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/part_mesh.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;
using haptic::sim::test::ScratchFolder;

namespace {

ImportedMesh import(const std::string& bytes, ImportFormat format,
                    const std::filesystem::path& folder = {}) {
  return import_bytes(bytes, format, "part", folder);
}

std::string refusal_of(const std::string& bytes, ImportFormat format) {
  try {
    import(bytes, format);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool is_skipped() {
  if (can_import()) return false;
  MESSAGE("skipped: built without assimp, tinyxml2 or zlib");
  return true;
}

/// Once welded: a tetrahedron of this volume.
void check_tetrahedron(const ImportedMesh& imported, double volume_m3) {
  CHECK(imported.mesh.file == "part");
  CHECK(imported.mesh.faces.size() == 4);
  CHECK(imported.mesh.vertex_places.size() == imported.mesh.vertices.size());
  const Surface surface = clean(imported.mesh);
  CHECK(violation(surface) == "");
  CHECK(surface.vertices.size() == 4);
  CHECK(volume(surface) == doctest::Approx(volume_m3).epsilon(1e-6));
}

std::string scene_with(const std::string& part) {
  return "format = 1\nname = \"n\"\n[moving]\n" + part +
         "\nposition_m = [0, 0, 9]\n[[static]]\nshape = \"box\"\nsize_m = [1, 1, 1]\n"
         "[rendering]\nk_f_n_per_m = 800\n";
}

}  // namespace

TEST_SUITE("tools.mesh_import") {
  TEST_CASE("formats by extension") {
    CHECK(import_format_of("a/b.3MF") == ImportFormat::k3mf);
    CHECK(import_format_of("b.glb") == ImportFormat::kGlb);
    CHECK(import_format_of("b.gltf") == ImportFormat::kGltf);
    CHECK(import_format_of("b.Dae") == ImportFormat::kDae);
    CHECK(import_format_of("b.amf") == ImportFormat::kAmf);
    CHECK(import_format_of("b.STEP") == ImportFormat::kStep);
    CHECK(import_format_of("b.stp") == ImportFormat::kStep);
    CHECK_FALSE(import_format_of("b.stl").has_value());
    CHECK_FALSE(import_format_of("b.ply").has_value());
    CHECK_FALSE(import_format_of("dae").has_value());
  }

  TEST_CASE("a build without the libraries names the packages") {
    if (can_import()) return;
    for (const std::string& text :
         {refusal_of(tetrahedron_glb(), ImportFormat::kGlb), refusal_of("", ImportFormat::k3mf)}) {
      CHECK(contains(text, "part: this program was built without"));
      CHECK(contains(text, "install libassimp-dev, libtinyxml2-dev and zlib1g-dev"));
    }
  }

  TEST_CASE("every format gives the same tetrahedron, in its unit") {
    if (is_skipped()) return;
    struct Sample {
      std::string bytes;
      ImportFormat format;
      double unit_m;
    };
    const Sample samples[] = {
        {tetrahedron_gltf(), ImportFormat::kGltf, 1.0},
        {tetrahedron_glb(), ImportFormat::kGlb, 1.0},
        {tetrahedron_amf(), ImportFormat::kAmf, 1e-3},
        {tetrahedron_amf("unit=\"inch\""), ImportFormat::kAmf, 0.0254},
        {tetrahedron_dae(), ImportFormat::kDae, 1.0},
        {tetrahedron_dae("<unit name=\"inch\" meter=\"0.0254\"/>"), ImportFormat::kDae, 0.0254},
        {archive_of_3mf(model_of_3mf()), ImportFormat::k3mf, 1e-3},
        {archive_of_3mf(model_of_3mf(), Packing::kDeflated), ImportFormat::k3mf, 1e-3},
        {archive_of_3mf(model_of_3mf(), Packing::kWide), ImportFormat::k3mf, 1e-3},
        {archive_of_3mf(model_of_3mf("unit=\"centimeter\"")), ImportFormat::k3mf, 1e-2}};
    for (const Sample& sample : samples) {
      CAPTURE(static_cast<int>(sample.format));
      const ImportedMesh imported = import(sample.bytes, sample.format);
      CHECK(imported.unit_m == sample.unit_m);
      check_tetrahedron(imported, std::pow(sample.unit_m, 3) / 6);
    }
  }

  TEST_CASE("nodes: each mesh at its places, mirrored ones turned, axes as in the file") {
    if (is_skipped()) return;
    const ImportedMesh twice =
        import(archive_of_3mf(model_of_3mf("unit=\"meter\"",
                                           "<item objectid=\"1\"/><item objectid=\"1\" "
                                           "transform=\"1 0 0 0 1 0 0 0 1 10 20 30\"/>")),
               ImportFormat::k3mf);
    REQUIRE(twice.mesh.faces.size() == 8);
    CHECK(twice.mesh.faces[0].group != twice.mesh.faces[7].group);
    const Surface both = clean(twice.mesh);
    CHECK(both.solid_count == 2);
    CHECK(volume(both) == doctest::Approx(2.0 / 6));
    bool moved = false;
    for (const Point3& p : twice.mesh.vertices) moved = moved || p == Point3{11, 20, 30};
    CHECK(moved);

    const ImportedMesh mirrored =
        import(tetrahedron_gltf("\"scale\":[1,1,-2],"), ImportFormat::kGltf);
    CHECK(volume_m3(mirrored.mesh) == doctest::Approx(2.0 / 6));
    // The place is in units of the file too.
    const ImportedMesh dae = import(tetrahedron_dae("<unit meter=\"0.5\"/><up_axis>Y_UP</up_axis>",
                                                    "<translate>10 20 30</translate>"),
                                    ImportFormat::kDae);
    moved = false;
    for (const Point3& p : dae.mesh.vertices) moved = moved || p == Point3{5, 10, 15.5};
    CHECK(moved);
  }

  TEST_CASE("damaged files are refused with what is wrong and how to fix it") {
    if (is_skipped()) return;
    const std::string model = model_of_3mf();
    const auto with = [](std::string text, const std::string& from, const std::string& to) {
      return text.replace(text.find(from), from.size(), to);
    };
    // The last entry of an archive states another size.
    const auto claiming = [](std::string archive, std::uint32_t size) {
      const std::size_t at = archive.rfind("PK\1\2") + 24;
      for (unsigned k = 0; k < 4; ++k) archive[at + k] = static_cast<char>(size >> (8 * k));
      return archive;
    };
    const std::string packed = archive_of_3mf(model, Packing::kDeflated);
    struct Damage {
      std::string bytes;
      ImportFormat format;
      const char* says;
    };
    const Damage damages[] = {
        {"", ImportFormat::kAmf, "the file is empty"},
        {"glTF", ImportFormat::kGlb, ""},
        {"{", ImportFormat::kGltf, "no glTF file"},
        {with(tetrahedron_gltf(), "\"2.0\"", "\"1.0\""), ImportFormat::kGltf,
         "it is glTF of version '1.0', and version 2 is read"},
        {with(tetrahedron_gltf(), "\"2.0\"", "1.1"), ImportFormat::kGltf,
         "it is glTF of version 1.1"},
        {std::string("glTF\1\0\0\0", 8) + std::string(32, ' '), ImportFormat::kGlb,
         "it is glTF of version 1, and version 2 is read"},
        {with(tetrahedron_gltf(), "\"bufferView\":0,\"componentType\":5126,\"count\":4",
              "\"bufferView\":0,\"componentType\":5126,\"count\":3"),
         ImportFormat::kGltf, "3 of its 4 triangles use vertices that are not there"},
        {tetrahedron_gltf("", "../buffer"), ImportFormat::kGltf, ""},
        {tetrahedron_gltf("\"scale\":[1,0,1],"), ImportFormat::kGltf, "a node flattens its mesh"},
        {tetrahedron_amf("unit=\"ell\""), ImportFormat::kAmf, "the unit is 'ell'; the units are"},
        {"<amf><object>", ImportFormat::kAmf, "the text is no XML"},
        {"<dae/>", ImportFormat::kAmf, "the root element is 'dae'"},
        {"<amf/>", ImportFormat::kAmf, ""},
        {tetrahedron_dae("<unit meter=\"-1\"/>"), ImportFormat::kDae, "the unit is '-1'"},
        {tetrahedron_dae("<unit meter=\"one\"/>"), ImportFormat::kDae, "unit 'one'"},
        {with(tetrahedron_dae(), "0 2 1 0 1 3", "0 2 1 0 1 9"), ImportFormat::kDae, ""},
        {model, ImportFormat::k3mf, "no ZIP archive"},
        {archive_of_3mf(model).substr(9), ImportFormat::k3mf, ""},
        {zip_of({{"a.txt", "x"}}), ImportFormat::k3mf, "it holds no 3MF model"},
        {claiming(packed, 1u << 30), ImportFormat::k3mf, "the ZIP archive is damaged"},
        {claiming(packed, 99), ImportFormat::k3mf, "the ZIP archive is damaged"},
        {claiming(packed, (1u << 30) + 1), ImportFormat::k3mf,
         "unpacks to 1073741825 bytes, limit 1073741824"},
        {archive_of_3mf(model_of_3mf("unit=\"yard\"")), ImportFormat::k3mf, "the unit is 'yard'"},
        {archive_of_3mf(with(model, "v2=\"2\"", "v2=\"77\"")), ImportFormat::k3mf, ""},
        {archive_of_3mf(model_of_3mf("", "")), ImportFormat::k3mf,
         "its <build> has no <item>, so none of its objects is placed"},
        {archive_of_3mf(model_of_3mf("", "\n<item objectid=\"7\"/>")), ImportFormat::k3mf,
         "part:3: <item> names object '7', which is not in the model"},
        {with(tetrahedron_dae(), "<instance_geometry", "\n<instance_controller url=\"#c\"/><a"),
         ImportFormat::kDae, "part:3: a node bends its mesh by controller '#c'"}};
    for (const Damage& damage : damages) {
      CAPTURE(damage.bytes);
      const std::string text = refusal_of(damage.bytes, damage.format);
      CAPTURE(text);
      CHECK(text.starts_with("part:"));
      CHECK(contains(text, "; "));
      CHECK(contains(text, damage.says));
    }
  }

  TEST_CASE("extensions of glTF that a file requires are refused unless they are of the looks") {
    if (is_skipped()) return;
    const auto requiring = [](const std::string& extension) {
      const std::string text = tetrahedron_gltf();
      return "{\"extensionsRequired\":[\"KHR_materials_unlit\"," + extension + "]," +
             text.substr(1);
    };
    CHECK(import(requiring("\"KHR_texture_transform\""), ImportFormat::kGltf).mesh.faces.size() ==
          4);
    for (const char* name : {"EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "ACME_dents"}) {
      const std::string text =
          refusal_of(requiring('"' + std::string(name) + '"'), ImportFormat::kGltf);
      CHECK(text == "part: the file requires extension '" + std::string(name) +
                        "', which is not read; export it without this extension, or as STL");
    }
    CHECK(contains(refusal_of(requiring("7"), ImportFormat::kGltf), "requires extension ''"));
    // In a .glb the key takes the place of another.
    std::string glb = tetrahedron_glb();
    const std::string from = "\"asset\":{\"version\":\"2.0\"},\"scene\":0,";
    std::string to = "\"extensionsRequired\":[\"A_\"],";
    to.resize(from.size(), ' ');
    glb.replace(glb.find(from), from.size(), to);
    CHECK(contains(refusal_of(glb, ImportFormat::kGlb), "requires extension 'A_'"));

    std::string whole_numbers = tetrahedron_gltf();
    whole_numbers.replace(whole_numbers.find("5126"), 4, "5122");
    CHECK(contains(refusal_of(whole_numbers, ImportFormat::kGltf),
                   "accessor 0 holds corners that are no floats"));
  }

  TEST_CASE("a glTF node that bends, morphs or multiplies its mesh is refused") {
    if (is_skipped()) return;
    for (const auto& [node, says] : std::vector<std::pair<std::string, std::string>>{
             {"\"skin\":0,", "node 0 bends its mesh by a skin"},
             {"\"weights\":[0,0.5],", "node 0 morphs its mesh"},
             {"\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{}}},",
              "node 0 places its mesh many times"}}) {
      CHECK(contains(refusal_of(tetrahedron_gltf(node), ImportFormat::kGltf), says));
    }
    CHECK(import(tetrahedron_gltf("\"weights\":[0],"), ImportFormat::kGltf).mesh.faces.size() == 4);
    std::string morphed = tetrahedron_gltf();
    morphed.replace(morphed.find("\"primitives\""), 0, "\"weights\":[1],");
    CHECK(contains(refusal_of(morphed, ImportFormat::kGltf), "mesh 0 is morphed"));
  }

  TEST_CASE("a .gltf opens buffers below its folder and nothing else") {
    if (is_skipped()) return;
    const ScratchFolder folder("gltf_buffers");
    std::filesystem::create_directories(folder.file("in"));
    std::ofstream(folder.file("in/part.bin"), std::ios::binary) << gltf_buffer();
    std::ofstream(folder.file("out.bin"), std::ios::binary) << gltf_buffer();
    std::ofstream(folder.file("in/part.gltf")) << tetrahedron_gltf("", "part");
    std::ofstream(folder.file("in/sly.gltf")) << tetrahedron_gltf("", "../out");
    CHECK(import_mesh(folder.file("in/part.gltf")).mesh.faces.size() == 4);
    CHECK_THROWS_WITH_AS(
        import_mesh(folder.file("in/sly.gltf")),
        (folder.file("in/sly.gltf") +
         ": buffer 0 is '../out.bin', and no such file may be read; a buffer is a file *.bin in "
         "the "
         "folder of the .gltf or below it; put it there, or export the part as .glb")
            .c_str(),
        InputError);
    std::ofstream(folder.file("in/lone.gltf")) << tetrahedron_gltf("", "absent");
    CHECK_THROWS_WITH_AS(import_mesh(folder.file("in/lone.gltf")),
                         doctest::Contains("buffer 0 is 'absent.bin'"), InputError);
    CHECK_THROWS_AS(import_mesh(folder.file("in/absent.gltf")), InputError);
  }

  TEST_CASE("scale_to_m may be left out where the file has a unit, and must agree with it") {
    if (is_skipped()) return;
    const ScratchFolder folder("import_scenes");
    std::ofstream(folder.file("part.amf")) << tetrahedron_amf("unit=\"meter\"");
    std::ofstream(folder.file("part.off")) << "OFF\n";
    const auto parsed = [&](const std::string& part) {
      return parse_scene_file(scene_with(part), "scene.toml",
                              std::filesystem::path(folder.file("")));
    };
    const CompiledScene compiled = compile_scene(parsed("mesh = \"part.amf\""), {});
    CHECK(compiled.parts[0].volume_m3 == doctest::Approx(1.0 / 6));
    CHECK(compiled.parts[0].scale_to_m == std::array<double, 3>{1, 1, 1});
    CHECK_NOTHROW(compile_scene(parsed("mesh = \"part.amf\"\nscale_to_m = 1.0"), {}));
    CHECK_THROWS_WITH_AS(compile_scene(parsed("mesh = \"part.amf\"\nscale_to_m = 0.001"), {}),
                         "scene.toml:5:14: scale_to_m of part.amf is not 1 m, the unit that the "
                         "file states; leave scale_to_m out, or correct the file",
                         InputError);
    CHECK_THROWS_AS(parsed("mesh = \"part.off\""), InputError);
  }
}
