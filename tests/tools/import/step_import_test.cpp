// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/support/program_run.hpp"
#include "tests/tools/import/step_files.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/import/mesh_import.hpp"
#include "tools/graph_compiler/import/node_mesh.hpp"
#include "tools/graph_compiler/mesh/mesh_nodes.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"
#include "tools/graph_compiler/program/scene_draft.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;
using haptic::sim::test::ScratchFolder;

namespace {

ImportedMesh import(const std::string& text, const ImportOptions& options = {}) {
  return import_bytes(text, ImportFormat::kStep, "part.step", {}, options);
}

std::string step_refusal(const std::string& text) {
  try {
    import(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

bool is_step_skipped() {
  if (can_import_step()) return false;
  MESSAGE("skipped: built without Open CASCADE");
  return true;
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// Lowest and highest corner [m].
std::pair<Point3, Point3> box_of_step(const RawMesh& mesh) {
  Point3 low = mesh.vertices.front(), high = low;
  for (const Point3& p : mesh.vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  return {low, high};
}

void check_step_box(const std::string& text, const std::string& node, const Point3& low,
                    const Point3& high) {
  CAPTURE(node);
  const ImportedMesh imported = node_of(import(text), node);
  CHECK(imported.mesh.file == "part.step#" + node);
  const auto [found_low, found_high] = box_of_step(imported.mesh);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(found_low[k] == doctest::Approx(low[k]).epsilon(1e-9));
    CHECK(found_high[k] == doctest::Approx(high[k]).epsilon(1e-9));
  }
}

/// Largest distance of a middle of a facet of the cylinder's side from its radius.
double side_error(const RawMesh& mesh, double radius_m) {
  double largest = 0.0;
  for (const RawFace& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Point3& a = mesh.vertices[face.vertices[k]];
      const Point3& b = mesh.vertices[face.vertices[(k + 1) % 3]];
      const bool at_side = std::abs(std::hypot(a[0], a[1]) - radius_m) < 1e-9 &&
                           std::abs(std::hypot(b[0], b[1]) - radius_m) < 1e-9;
      // Chords of the discs are no edges of the side but where they are short.
      if (!at_side || a[2] == b[2]) continue;
      largest = std::max(largest, radius_m - std::hypot(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])));
    }
  }
  return largest;
}

}  // namespace

TEST_SUITE("tools.step_import") {
  TEST_CASE("a build without Open CASCADE names the package") {
    if (can_import_step()) return;
    const std::string text = step_refusal(step_box({1, 2, 3}));
    CHECK(contains(text, "part.step: this program was built without"));
    CHECK(contains(text, "install libocct-data-exchange-dev"));
  }

  TEST_CASE("a box in any unit is twelve triangles in metres") {
    if (is_step_skipped()) return;
    const std::pair<const char*, double> units[] = {
        {kStepMillimetre, 1e-3}, {kStepMetre, 1.0}, {kStepInch, 0.0254}};
    for (const auto& named : units) {
      const auto& unit = named.first;
      const auto& unit_m = named.second;
      CAPTURE(unit);
      const ImportedMesh imported = import(step_box({1, 2, 3}, unit));
      CHECK(imported.unit_m == doctest::Approx(unit_m).epsilon(1e-12));
      CHECK(imported.mesh.file == "part.step");
      CHECK(imported.mesh.faces.size() == 12);
      const Surface surface = clean(imported.mesh);
      CHECK(violation(surface) == "");
      CHECK(surface.vertices.size() == 8);
      CHECK(volume(surface) == doctest::Approx(6 * std::pow(unit_m, 3)).epsilon(1e-9));
      REQUIRE(imported.deflection.has_value());
      CHECK(imported.deflection->found_m == 0.0);
    }
  }

  TEST_CASE("a face without area is left out, and told") {
    if (is_step_skipped()) return;
    const ImportedMesh imported = import(step_box_with_sliver());
    CHECK(imported.mesh.faces.size() == 12);
    CHECK(volume(clean(imported.mesh)) == doctest::Approx(6e-6).epsilon(1e-9));
    REQUIRE(imported.mesh.warnings.size() == 1);
    CHECK(imported.mesh.warnings[0] == "left out: 1 face without area, narrower than 1e-10 m");
  }

  TEST_CASE("a cylinder is as near to its round face as asked, and finer where asked for less") {
    if (is_step_skipped()) return;
    const std::string text = step_cylinder(10, 30);
    std::size_t faces = 0;
    for (const double asked_m : {1e-3, 1e-4, 1e-5}) {
      CAPTURE(asked_m);
      const ImportedMesh imported = import(text, {asked_m});
      REQUIRE(imported.deflection.has_value());
      CHECK(imported.deflection->asked_m == doctest::Approx(asked_m));
      CHECK(imported.deflection->found_m <= asked_m);
      CHECK(imported.deflection->found_m > 0.0);
      const double error_m = side_error(imported.mesh, 0.01);
      CHECK(error_m > 0.0);
      CHECK(error_m <= asked_m);
      CHECK(error_m <= imported.deflection->found_m * (1 + 1e-9));
      CHECK(imported.mesh.faces.size() > faces);
      faces = imported.mesh.faces.size();
      const Surface surface = clean(imported.mesh);
      CHECK(violation(surface) == "");
      const double exact_m3 = std::numbers::pi * 1e-4 * 0.03;
      CHECK(volume(surface) < exact_m3);
      CHECK(volume(surface) > exact_m3 * (1 - 4 * asked_m / 0.01));
    }
  }

  TEST_CASE("the default deflection is a share of the size at any size") {
    if (is_step_skipped()) return;
    std::size_t faces = 0;
    for (const double size : {0.1, 1.0, 100.0, 1e4}) {
      CAPTURE(size);
      const ImportedMesh imported = import(step_cylinder(size, 2 * size));
      const double diagonal_m = 1e-3 * size * std::sqrt(4.0 + 4.0 + 4.0);
      REQUIRE(imported.deflection.has_value());
      CHECK(imported.deflection->asked_m ==
            doctest::Approx(kDeflectionShare * diagonal_m).epsilon(0.01));
      if (faces > 0) CHECK(imported.mesh.faces.size() == faces);
      faces = imported.mesh.faces.size();
    }
  }

  TEST_CASE("products of an assembly are nodes at their places, instances apart") {
    if (is_step_skipped()) return;
    const std::string text = step_assembly();
    const ImportedMesh whole = import(text);
    CHECK(whole.mesh.faces.size() == 4 * 12);
    std::vector<std::string> names, parts;
    for (const NamedNode& node : named_nodes(whole.mesh)) {
      names.push_back(node.name);
      if (node.is_part) parts.push_back(node.name);
    }
    CHECK(names == std::vector<std::string>{"machine", "plate", "pair", "bolt:1", "bolt:2", "nut"});
    CHECK(parts == std::vector<std::string>{"plate", "bolt:1", "bolt:2", "nut"});
    // Turned once, and below the pair twice: x becomes y, then -x.
    check_step_box(text, "plate", {-0.1, 0, 0}, {0, 0.1, 0.01});
    check_step_box(text, "bolt:1", {-0.01, -0.02, 0.01}, {0, 0, 0.04});
    check_step_box(text, "bolt:2", {-0.06, -0.02, 0.01}, {-0.05, 0, 0.04});
    check_step_box(text, "pair", {-0.06, -0.02, 0.01}, {0, 0, 0.04});
    check_step_box(text, "nut", {-0.008, 0, 0.05}, {0, 0.008, 0.058});
    // The facets of each follow its own size.
    CHECK(whole.deflection->asked_m == node_of(whole, "plate").deflection->asked_m);
    CHECK(node_of(whole, "nut").deflection->asked_m ==
          doctest::Approx(kDeflectionShare * std::sqrt(3.0) * 0.008).epsilon(0.01));
    CHECK_THROWS_WITH_AS(node_of(whole, "bolt"),
                         doctest::Contains("part.step: 2 nodes have the name 'bolt'"), InputError);
    CHECK_THROWS_WITH_AS(node_of(whole, "plat"), doctest::Contains("did you mean 'plate'?"),
                         InputError);
  }

  TEST_CASE("the bodies of a single product are nodes by their names") {
    if (is_step_skipped()) return;
    check_step_box(step_bodies(), "body1", {0, 0, 0}, {0.01, 0.02, 0.03});
    check_step_box(step_bodies(), "body2", {0.1, 0, 0}, {0.11, 0.02, 0.03});
    check_step_box(step_bodies(), "part", {0, 0, 0}, {0.11, 0.02, 0.03});
    std::vector<std::string> parts;
    for (const NamedNode& node : named_nodes(import(step_bodies()).mesh)) {
      if (node.is_part) parts.push_back(node.name);
    }
    CHECK(parts == std::vector<std::string>{"body1", "body2"});
  }

  TEST_CASE("an assembly is drafted, with each product at its place") {
    if (is_step_skipped()) return;
    const ScratchFolder folder("step_assembly");
    std::ofstream(folder.file("machine.step")) << step_assembly();
    DraftRequest request;
    request.moving = folder.file("machine.step");
    request.folder = folder.file("");
    request.name = "machine";
    const SceneDraft draft = draft_scene(request);
    CHECK(contains(draft.toml,
                   "[moving]                # the part in the hand\n"
                   "mesh = \"machine.step#nut\"\nposition_m"));
    for (const char* fixed : {"plate", "bolt:1", "bolt:2"}) {
      CHECK(contains(draft.toml, "mesh = \"machine.step#" + std::string(fixed) + "\"\n"));
    }
    const CompiledScene compiled =
        compile_scene(parse_scene_file(draft.toml, "s.toml", folder.file("")), {});
    CHECK(compiled.parts.size() == 4);
  }

  TEST_CASE("damaged files are refused with what is wrong and how to fix it") {
    if (is_step_skipped()) return;
    const std::string box = step_box({1, 2, 3});
    const std::pair<std::string, const char*> damages[] = {
        {"", "the file is empty"},
        {"solid part", "does not begin with ISO-10303-21"},
        {"ISO-10303-21;", ""},
        {box.substr(0, box.size() / 2), ""},
        {step_box({1, 2, 3}, ""), "it states no unit of length"},
        {with(box, "SHAPE_DEFINITION_REPRESENTATION", "X"), ""},
        {with(box, "CLOSED_SHELL", "OPEN_BOOK"), ""}};
    for (const auto& damage : damages) {
      const auto& text = damage.first;
      const auto& says = damage.second;
      const std::string refusal = step_refusal(text);
      CAPTURE(text.substr(0, 100));
      CAPTURE(refusal);
      CHECK(refusal.starts_with("part.step: "));
      CHECK(contains(refusal, "; "));
      CHECK(contains(refusal, says));
    }
  }

  TEST_CASE("a scene: unit from the file, the deflection is a key and is told") {
    if (is_step_skipped()) return;
    const ScratchFolder folder("step_scenes");
    std::ofstream(folder.file("pin.step")) << step_cylinder(5, 20);
    std::ofstream(folder.file("part.off")) << "OFF\n";
    const auto parsed = [&](const std::string& keys) {
      return parse_scene_file("format = 1\nname = \"n\"\n[moving]\n" + keys +
                                  "\nposition_m = [0, 0, 9]\n[[static]]\nshape = \"box\"\n"
                                  "size_m = [1, 1, 1]\n[rendering]\nk_f_n_per_m = 800\n",
                              "scene.toml", std::filesystem::path(folder.file("")));
    };
    const CompiledScene compiled =
        compile_scene(parsed("mesh = \"pin.step\"\ndeflection_m = 1e-4"), {});
    CHECK_FALSE(compiled.parts[0].is_surface());
    CHECK(compiled.parts[0].volume_m3 ==
          doctest::Approx(std::numbers::pi * 25e-6 * 0.02).epsilon(0.05));
    REQUIRE(compiled.parts[0].deflection.has_value());
    CHECK(compiled.parts[0].deflection->asked_m == doctest::Approx(1e-4));
    CHECK(contains(report_as_text(compiled), "deflection_m = 0.0001: facets off the round faces"));
    CHECK_THROWS_WITH_AS(compile_scene(parsed("mesh = \"pin.step\"\nscale_to_m = 1.0"), {}),
                         doctest::Contains("scale_to_m of pin.step is not 0.001 m"), InputError);
  }

  TEST_CASE("deflection_m belongs to STEP files alone, and above 0") {
    const ScratchFolder folder("step_keys");
    std::ofstream(folder.file("pin.step")) << "ISO-10303-21;";
    std::ofstream(folder.file("part.off")) << "OFF\n";
    const auto refusal = [&](const std::string& keys) -> std::string {
      try {
        parse_scene_file("format = 1\nname = \"n\"\n[moving]\n" + keys +
                             "\n[[static]]\nshape = \"box\"\nsize_m = [1, 1, 1]\n"
                             "[rendering]\nk_f_n_per_m = 800\n",
                         "scene.toml", std::filesystem::path(folder.file("")));
      } catch (const InputError& error) {
        return error.what();
      }
      return "";
    };
    CHECK(refusal("mesh = \"pin.step\"\ndeflection_m = 1e-4") == "");
    CHECK(contains(refusal("mesh = \"pin.step\"\ndeflection_m = 0"), "scene.toml:5:16"));
    CHECK(contains(refusal("mesh = \"part.off\"\nscale_to_m = 1\ndeflection_m = 1e-4"),
                   "is for STEP files"));
    CHECK(contains(refusal("shape = \"box\"\nsize_m = [1, 1, 1]\ndeflection_m = 1e-4"),
                   "is for STEP files"));
  }
}
