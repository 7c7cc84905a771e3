// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"

using namespace haptic::tools;
using haptic::tools::test::contains;

namespace {

/// `moving` and `fixed` begin in lines 4 and 6 of the file where `moving` is one line.
std::string scene_text(const std::string& moving, const std::string& fixed) {
  return "format = 1\nname = \"shapes\"\n[moving]\n" + moving + "\n[[static]]\n" + fixed +
         "\n[rendering]\nk_f_n_per_m = 800\n";
}

const std::string kBox = "shape = \"box\"\nsize_m = [0.1, 0.1, 0.01]";

SceneFile parsed(const std::string& moving, const std::string& fixed = kBox) {
  return parse_scene_file(scene_text(moving, fixed), "scene.toml", ".");
}

std::string refusal_of(const std::string& moving) {
  try {
    parsed(moving);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_SUITE("tools.shape_scenes") {
  TEST_CASE("every shape is read with its defaults") {
    const auto shape = [](const std::string& lines) { return parsed(lines).moving.shape.value(); };
    CHECK(std::get<BoxShape>(shape(kBox)).size_m == Point3{0.1, 0.1, 0.01});
    CHECK(std::get<CylinderShape>(shape("shape='cylinder'\nradius_m=0.1\nheight_m=1")).segments ==
          32);
    CHECK(std::get<PrismShape>(shape("shape='prism'\nradius_m=0.1\nheight_m=1\nsides=5")).sides ==
          5);
    CHECK(
        std::get<ConeShape>(shape("shape='cone'\nradius_m=0.1\nheight_m=1\nsegments=9")).segments ==
        9);
    CHECK(std::get<SphereShape>(shape("shape='sphere'\nradius_m=2")).radius_m == 2.0);
    CHECK(std::get<CapsuleShape>(shape("shape='capsule'\nradius_m=1\nheight_m=3")).height_m == 3.0);
    const auto tube = std::get<TubeShape>(
        shape("shape='tube'\ninner_radius_m=0.01\nouter_radius_m=0.02\nheight_m=0.03"));
    CHECK(tube.inner_radius_m == 0.01);
    CHECK(tube.outer_radius_m == 0.02);
    const auto bolt = std::get<BoltShape>(shape("shape='bolt'\nsize='M8'"));
    CHECK(bolt.length_m == doctest::Approx(0.032));
    CHECK(bolt.clearance_m == doctest::Approx(14.375e-6));
    CHECK(bolt.width_across_flats_m == 0.013);
    CHECK(std::get<BoltShape>(shape("shape='bolt'\nsize='M8'\nlength_m=0.02\nfit='6h'"))
              .clearance_m == 0.0);
    const auto nut =
        std::get<NutShape>(shape("shape='nut'\nsize='M8'\nclearance_m=1e-5\nsegments=16"));
    CHECK(nut.clearance_m == 1e-5);
    CHECK(nut.segments == 16);
    CHECK(nut.height_m == 0.0068);
    const auto rod = std::get<ThreadShape>(shape("shape='thread'\nsize='M10'\nturns=3.5"));
    CHECK(rod.diameter_m == 0.01);
    CHECK_FALSE(rod.internal);
    const auto sleeve = std::get<ThreadShape>(
        shape("shape='thread'\ndiameter_m=0.01\npitch_m=0.001\nturns=3\ninternal=true\n"
              "outer_radius_m=0.01\nfit='6H/6g'"));
    CHECK(sleeve.internal);
    CHECK(sleeve.clearance_m == 0.0);
    const ScenePart part =
        parsed("shape='sphere'\nradius_m=2\nposition_m=[1,2,3]\nmaterial='pom'").moving;
    CHECK(part.mesh == "sphere");
    CHECK(part.position_m == Point3{1, 2, 3});
    CHECK(part.material == "pom");
  }

  TEST_CASE("what is wrong with a shape is said with its place") {
    struct Defect {
      const char *lines, *place, *says;
    };
    const Defect defects[] = {
        {"shape = \"capsul\"", "4:9: ", "did you mean 'capsule'?"},
        {"shape = \"xyzzyxyzzy\"", "4:9: ", "give one of box, prism"},
        {"shape = 5", "4:9: ", "give a string"},
        {"shape = \"box\"\nmesh = \"a.obj\"", "4:9: ", "keep one of the two"},
        {"mesh = \"a.obj\"\nradius_m = 1", "5:12: ", "belongs to a part with shape"},
        {"radius_m = 1", "3:1: ", "or a shape without a file"},
        {"shape = \"box\"\nscale_to_m = 1\nsize_m = [1, 1, 1]",
         "5:14: ", "in metres already; leave it out"},
        {"shape = \"box\"", "3:1: ", "size_m is missing; give the lengths"},
        {"shape = \"box\"\nsize_m = [1, 0, 1]", "5:14: ", "size_m[1] is 0"},
        {"shape = \"sphere\"\nradius_m = 1\nheight_m = 1",
         "6:12: ", "is no key of shape = \"sphere\", which has radius_m, segments"},
        {"shape = \"sphere\"\nradius = 1", "5:1: ", "did you mean 'radius_m'?"},
        {"shape = \"sphere\"\nradius_m = 1\nsegments = 30", "6:12: ", "multiple of 4"},
        {"shape = \"sphere\"\nradius_m = 1\nsegments = -4", "6:12: ", "whole number from 3 to 512"},
        {"shape = \"cone\"\nradius_m = 1", "3:1: ", "height_m is missing"},
        {"shape = \"prism\"\nradius_m = 1\nheight_m = 1", "3:1: ", "sides is missing"},
        {"shape = \"tube\"\ninner_radius_m = 2\nouter_radius_m = 1\nheight_m = 1",
         "5:18: ", "leaves no wall"},
        {"shape = \"bolt\"", "3:1: ", "size is missing"},
        {"shape = \"bolt\"\nsize = \"M7\"", "5:8: ", "give one of M3, M4"},
        {"shape = \"bolt\"\nsize = \"M8\"\nlength_m = 9", "6:12: ", "makes 7200 turns"},
        {"shape = \"nut\"\nsize = \"M8\"\nfit = \"6g\"", "6:7: ", "such as \"6H\""},
        {"shape = \"bolt\"\nsize = \"M8\"\nfit = \"6g\"\nclearance_m = 1e-5",
         "7:15: ", "fit is given too"},
        {"shape = \"thread\"\nsize = \"M8\"\npitch_m = 0.001\nturns = 3",
         "6:11: ", "size is given too"},
        {"shape = \"thread\"\nsize = \"M8\"", "3:1: ", "turns is missing"},
        {"shape = \"thread\"\nsize = \"M8\"\nturns = 3\ninternal = true",
         "3:1: ", "outer_radius_m is missing"},
        {"shape = \"thread\"\nsize = \"M8\"\nturns = 3\nouter_radius_m = 1",
         "7:18: ", "belongs to an internal thread"}};
    for (const Defect& defect : defects) {
      CAPTURE(defect.lines);
      const std::string text = refusal_of(defect.lines);
      CAPTURE(text);
      CHECK(text.starts_with(std::string("scene.toml:") + defect.place));
      CHECK(contains(text, defect.says));
    }
  }

  TEST_CASE("a peg in a tube compiles, and the report states the chord errors") {
    const CompiledScene compiled = compile_scene(
        parsed("shape = 'cylinder'\nradius_m = 0.01\nheight_m = 0.04\nsegments = 16\n"
               "position_m = [0, 0, 0.05]",
               "shape = 'tube'\ninner_radius_m = 0.0101\nouter_radius_m = 0.02\nheight_m = 0.03\n"
               "segments = 12"),
        {});
    REQUIRE(compiled.parts.size() == 2);
    CHECK(compiled.parts[0].pieces.size() == 1);
    CHECK(compiled.parts[1].pieces.size() == 12);
    for (const PartReport& part : compiled.parts) CHECK(part.certificate.holds());
    const nlohmann::json report = nlohmann::json::parse(report_as_json(compiled));
    const auto& peg = report["parts"][0]["shape"];
    CHECK(peg["kind"] == "cylinder");
    CHECK(peg["segments"] == 16);
    CHECK(peg["chord_error_m"].get<double>() ==
          doctest::Approx(0.01 * (1.0 - std::cos(std::numbers::pi / 16))));
    CHECK(report["parts"][1]["shape"]["kind"] == "tube");
    CHECK(contains(report_as_text(compiled),
                   "round surfaces in 16 segments, facets off them by at most 0.000192 m"));
    const std::vector<std::string> warnings = warnings_of(compiled);
    REQUIRE(warnings.size() == 1);
    CHECK(contains(warnings[0], "[moving] cylinder in [[static]] tube"));
  }

  TEST_CASE("round and pointed shapes are one convex piece") {
    for (const char* lines : {"shape = 'sphere'\nradius_m = 0.01\nsegments = 16",
                              "shape = 'capsule'\nradius_m = 0.01\nheight_m = 0.05\nsegments = 12",
                              "shape = 'cone'\nradius_m = 0.01\nheight_m = 0.05\nsegments = 12",
                              "shape = 'prism'\nradius_m = 0.01\nheight_m = 0.05\nsides = 5"}) {
      CAPTURE(lines);
      const CompiledScene compiled =
          compile_scene(parsed(std::string(lines) + "\nposition_m = [0, 0, 0.1]"), {});
      CHECK(compiled.parts[0].pieces.size() == 1);
      CHECK(compiled.parts[0].certificate.holds());
      CHECK(warnings_of(compiled).empty());
    }
  }
}
