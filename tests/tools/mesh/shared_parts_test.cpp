// SPDX-License-Identifier: Apache-2.0
/// Real parts, where the shared folder is present; the counts are those its description files
/// state.
#include <doctest/doctest.h>

#include <filesystem>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {
namespace {

struct Part {
  const char* file;
  std::array<double, 3> scale;
  std::size_t vertices;
  std::size_t triangles;  ///< a polygon of n corners counts n - 2, before stitching
  std::size_t shells;
  double volume_m3;
  std::size_t stitched;
};

constexpr std::array<double, 3> kOne = {1, 1, 1};
constexpr std::array<double, 3> kMilli = {0.001, 0.001, 0.001};

const Part kParts[] = {
    {"square_peg/4gon_peg.stl", kMilli, 8, 12, 1, 7.99996e-05, 0},
    {"square_peg/4gon_box_t5mm.stl", kMilli, 16, 32, 1, 0.000137975, 0},
    {"cube_in_cup/cube.obj", {0.079, 0.079, 0.079}, 8, 12, 1, 0.000493039, 0},
    {"cube_in_cup/cube_cup.obj", kOne, 16, 28, 1, 0.000424, 0},
    {"octagon_peg/8gon_peg.stl", kMilli, 16, 28, 1, 0.000113137, 0},
    {"octagon_peg/8gon_box_t5mm.stl", kMilli, 24, 48, 1, 0.000120568, 0},
    {"prism_stack/r2_sds10_shr0_drf0_hlw0_shx0_shy0_scx45_scy45_scz50.stl", kOne, 20, 36, 1,
     0.00010125, 0},
    {"prism_stack/r3_sds4_shr75_drf0_hlw0_shx0_shy0_scx41_scy49_scz71.stl", kOne, 8, 12, 1,
     0.000126015, 0},
    {"corner_bracket/15.obj", {0.003, 0.003, 0.001}, 12, 20, 1, 3.672e-05, 0},
    {"ell_fixture/ell_boxes.obj", kOne, 16, 24, 2, 0.00019176, 0},
    {"ell_fixture/fixture_boxes.obj", kOne, 56, 84, 7, 3.36e-05, 0},
    {"rect_peg_16mm/factory_rectangular_peg_16mm_loose_subdiv_3x.obj", kOne, 898, 1792, 1,
     7.87023e-06, 0},
    // 72 open edges as found; two open sheets that the stitching joins to one shell.
    {"rect_peg_16mm/factory_rectangular_hole_16mm_subdiv_3x.obj", kOne, 548, 1040, 1, 4.13864e-06,
     56},
    {"plug_socket/plug.stl", kOne, 48, 88, 2, 5.14945e-05, 0},
    {"plug_socket/plug_wall.stl", kOne, 64, 128, 1, 0.00189921, 0},
    {"gear_on_shaft/industreal_gear_base.obj", kOne, 2490, 4992, 1, 5.93834e-05, 0},
    // 10 244 and 20 492 at a finer weld; slivers below the weld radius go here as well.
    {"gear_on_shaft/industreal_gear_small.obj", kOne, 10228, 20460, 1, 3.47459e-06, 0},
};

const std::filesystem::path kData = std::filesystem::path(HAPTIC_SHARED_DIR) / "data";

bool absent() {
  if (std::filesystem::exists(kData)) {
    return false;
  }
  MESSAGE("skipped: no folder " << kData.string());
  return true;
}

}  // namespace

TEST_SUITE("tools.mesh_shared_parts") {
  TEST_CASE("every part that is a solid becomes a valid surface of the stated counts") {
    if (absent()) {
      return;
    }
    for (const Part& part : kParts) {
      CAPTURE(part.file);
      const RawMesh raw = read_mesh(kData / part.file);
      const Surface surface = clean_surface(raw, {part.scale, {}});
      CHECK(violation(surface) == "");
      CHECK(surface.vertices.size() == part.vertices);
      std::size_t triangles = 0;
      for (const SurfaceFace& face : surface.faces) {
        triangles += face.vertices.size() - 2;
      }
      CHECK(triangles - part.stitched == part.triangles);
      CHECK(step_count(surface, "T-junctions") == part.stitched);
      CHECK(surface.shells.size() == part.shells);
      CHECK(surface.solid_count == part.shells);
      CHECK(volume(surface) == doctest::Approx(part.volume_m3).epsilon(5.0e-6));
      for (const CleaningStep& step : surface.steps) {
        CHECK(step.largest_move_m <= 0.5 * surface.plane_tolerance_m);
      }
    }
  }

  TEST_CASE("the brick is refused for its two open edges") {
    if (absent()) {
      return;
    }
    const RawMesh raw = read_mesh(kData / "brick_stack/lego.obj");
    const std::string text = refusal(raw, {{0.1, 0.1, 0.1}, {}});
    CHECK(contains(text, "lego.obj: open: 2 edges without a partner, longest hole at (0.0305"));
  }
}

}  // namespace haptic::tools::test
