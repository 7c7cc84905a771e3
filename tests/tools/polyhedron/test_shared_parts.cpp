// SPDX-License-Identifier: Apache-2.0
/// Real parts from file to certified pieces: see tools/graph_compiler/METHOD.md section 10.
#include <doctest/doctest.h>

#include <filesystem>

#include "tests/tools/polyhedron/body_bytes.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/mesh/mesh_reader.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

struct Row {
  const char* file;
  std::array<double, 3> scale_to_m;
  std::size_t pieces;
  std::size_t face_planes_only;
  bool cover;
  double thinnest_m;  ///< no piece is thinner
};

constexpr std::array<double, 3> uniform(double s) { return {s, s, s}; }

const std::array<Row, 15> kRows{{
    {"square_peg/4gon_peg.stl", uniform(0.001), 1, 1, false, 0.028},
    {"square_peg/4gon_box_t5mm.stl", uniform(0.001), 4, 4, false, 0.015},
    {"cube_in_cup/cube.obj", uniform(0.079), 1, 1, false, 0.078},
    {"cube_in_cup/cube_cup.obj", uniform(1.0), 5, 5, false, 0.0099},
    {"octagon_peg/8gon_peg.stl", uniform(0.001), 1, 1, false, 0.036},
    {"octagon_peg/8gon_box_t5mm.stl", uniform(0.001), 8, 8, false, 0.0077},
    {"rect_peg_16mm/factory_rectangular_peg_16mm_loose_subdiv_3x.obj", uniform(1.0), 1, 1, false,
     0.0098},
    {"rect_peg_16mm/factory_rectangular_hole_16mm_subdiv_3x.obj", uniform(1.0), 4, 4, false,
     0.0043},
    {"corner_bracket/15.obj", {0.003, 0.003, 0.001}, 2, 2, false, 0.0179},
    {"ell_fixture/ell_boxes.obj", uniform(1.0), 2, 2, true, 0.029},
    {"ell_fixture/fixture_boxes.obj", uniform(1.0), 7, 7, true, 0.00099},
    {"plug_socket/plug.stl", uniform(1.0), 2, 2, false, 0.0099},
    {"plug_socket/plug_wall.stl", uniform(1.0), 8, 24, false, 0.026},
    {"prism_stack/r2_sds10_shr0_drf0_hlw0_shx0_shy0_scx45_scy45_scz50.stl", uniform(1.0), 1, 1,
     false, 0.038},
    {"prism_stack/r3_sds4_shr75_drf0_hlw0_shx0_shy0_scx41_scy49_scz71.stl", uniform(1.0), 1, 1,
     false, 0.038},
}};

std::filesystem::path folder() { return std::filesystem::path(HAPTIC_SHARED_DIR) / "data"; }

FlatBody flat_body(const char* file, const std::array<double, 3>& scale) {
  CleaningOptions options;
  options.scale_to_m = scale;
  return flatten(clean_surface(read_mesh(folder() / file), options), {});
}

TEST_SUITE("tools.shared_parts") {
  TEST_CASE("shared parts: as many pieces as measured before, certified") {
    if (!std::filesystem::exists(folder())) {
      MESSAGE("skipped: no folder with real parts");
      return;
    }
    for (const Row& row : kRows) {
      CAPTURE(row.file);
      FlatBody body = flat_body(row.file, row.scale_to_m);
      const Decomposition result = decompose(body, row.file, {});
      CHECK(result.pieces.size() == row.pieces);
      CHECK(result.face_plane_only_pieces <= row.face_planes_only);
      CHECK(result.certificate.holds());
      CHECK(result.certificate.cover == row.cover);
      CHECK(result.warnings.size() == (row.cover ? 1 : 0));
      CHECK(result.thinnest_m >= row.thinnest_m);
      const Certificate again = certify(body.world, body.solids, result.pieces, result.piece_solid);
      CHECK(again.holds());
      CHECK(to_body(body, result, row.file).pieces.size() == row.pieces);
    }
  }

  TEST_CASE("shared parts: two runs over the wall give the same bytes") {
    if (!std::filesystem::exists(folder())) {
      MESSAGE("skipped: no folder with real parts");
      return;
    }
    const auto run = [] {
      FlatBody body = flat_body("plug_socket/plug_wall.stl", uniform(1.0));
      const Decomposition result = decompose(body, "wall", {});
      return test::body_text(to_body(body, result, "wall"));
    };
    CHECK(run() == run());
  }

  TEST_CASE("shared parts: what is no solid, or too curved, is refused") {
    if (!std::filesystem::exists(folder())) {
      MESSAGE("skipped: no folder with real parts");
      return;
    }
    CHECK_THROWS_AS(flat_body("brick_stack/lego.obj", uniform(0.1)), InputError);
    CHECK_THROWS_AS(flat_body("gear_on_shaft/industreal_gear_base.obj", uniform(1.0)), InputError);
  }
}

}  // namespace
}  // namespace haptic::tools
