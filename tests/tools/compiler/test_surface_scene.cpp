// SPDX-License-Identifier: Apache-2.0
// Scenes with surfaces: what a facet's tables hold, and that damage to them is refused.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>

#include "rt_core/haptic_core.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;

namespace {

/// What rounding may leave: of unit vectors at a right angle, and of a height in parts of 1 cm.
constexpr Real kAligned = HAPTIC_REAL_IS_FLOAT ? 1e-6_r : 1e-12_r;
constexpr Real kRounding_m = HAPTIC_REAL_IS_FLOAT ? 1e-8_r : 1e-15_r;

/// A unit square of two triangles in z = 0, folded up along its diagonal by `rise`, open all round.
void write_sheet(const std::string& path, double rise) {
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 1 1 " << rise << "\nv 0 1 0\nf 1 2 4\nf 2 3 4\n";
}

void write_surface_cube(const std::string& path) {
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
                         "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

/// A cube of a centimetre over the sheet; `more` is appended.
SceneFile sheet_scene(const ScratchFolder& folder, double rise, const std::string& more = "") {
  write_sheet(folder.file("sheet.obj"), rise);
  write_surface_cube(folder.file("cube.obj"));
  std::ofstream(folder.file("scene.toml"))
      << "format = 1\nname = \"sheet\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.01\n"
         "position_m = [0, 0, 0.05]\n[[static]]\nmesh = \"sheet.obj\"\nscale_to_m = 0.02\n"
         "[rendering]\nk_f_n_per_m = 800\n"
      << more;
  return read_scene_file(folder.file("scene.toml"));
}

/// Section `id` of a blob as an array that may be changed.
template <typename T>
T* section(SceneBytes& bytes, SectionId id) {
  SceneHeader header;
  std::memcpy(&header, bytes.span().data(), sizeof header);
  for (std::uint32_t k = 0; k < header.section_count; ++k) {
    SectionEntry entry;
    std::memcpy(&entry, bytes.span().data() + header.section_table + k * sizeof entry,
                sizeof entry);
    if (entry.id == id) return reinterpret_cast<T*>(bytes.span().data() + entry.offset);
  }
  return nullptr;
}

RtStatus opened(const CompiledScene& compiled, const std::function<void(SceneBytes&)>& damage) {
  SceneBytes bytes{compiled.bytes};
  damage(bytes);
  const std::uint64_t hash = scene_content_hash(bytes.span());
  std::memcpy(bytes.span().data() + offsetof(SceneHeader, content_hash), &hash, sizeof hash);
  SceneView view;
  return SceneView::open(bytes.span(), view);
}

/// Wrench on the hand after the cube has gone from `from_m` to `to_m` in half a second and stood
/// there as long.
Wrench pressed(const SceneBytes& bytes, double x_m, double from_m, double to_m) {
  SceneView view;
  REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
  SceneBytes state{std::vector<std::byte>(HapticCore::state_bytes(view))};
  HapticCore* core = nullptr;
  REQUIRE(HapticCore::create(state.span(), view, core) == RtStatus::kOk);
  StepResult result;
  for (int k = 0; k <= 1000; ++k) {
    StepInput input;
    input.sequence = static_cast<std::uint64_t>(k);
    const double share = std::min(1.0, k / 500.0);
    input.pose_wa.p_wa =
        Vec3(static_cast<Real>(x_m), 0.005_r, static_cast<Real>(from_m + share * (to_m - from_m)));
    result = core->step(input);
  }
  return result.wrench_w;
}

}  // namespace

TEST_SUITE("tools.surface_scene") {
  TEST_CASE("a folded sheet is two facets with two sides, and cones of what goes on beside them") {
    const ScratchFolder folder("sheet");
    const CompiledScene compiled = compile_scene(sheet_scene(folder, 0.5), {});
    const SceneBytes bytes{compiled.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    CHECK(view.has_facets());
    CHECK_FALSE(view.lists_pairs());
    CHECK_FALSE(view.piece(0).is_facet());
    REQUIRE(view.pieces().size() == 3);
    CHECK((view.piece(0).lanes != nullptr && view.piece(0).arcs != nullptr));
    for (const std::uint32_t p : {1u, 2u}) {
      const PieceView facet = view.piece(p);
      CHECK(facet.is_facet());
      CHECK((facet.arcs == nullptr && facet.lanes == nullptr));
      CHECK(facet.vertex_count == 3);
      CHECK(facet.face_normal(0) == Vec3(-facet.face_normal(1)));
      CHECK(plane_count(*facet.record) == 5);
      int folds = 0;
      for (std::uint32_t e = 0; e < facet.edge_count; ++e) {
        std::uint32_t ways = 0;
        CHECK(facet.all_at_edge(e, [&](const Vec3& way) {
          CHECK(way.norm() == doctest::Approx(1.0));
          CHECK(std::abs(way.dot(ConstVec3Map(facet.edge_directions[e].unit))) < kAligned);
          return ++ways > 0;
        }));
        folds += ways == 2 ? 1 : 0;
        // Its tilts are those of the two faces: opposite, as long as the facet is wide there.
        const ConstVec3Map end = facet.vertex(facet.edges[e].vertex[0]);
        const Real width_m = ConstVec3Map(facet.edge_directions[e].unit)
                                 .cross(facet.vertex(facet.edges[e].apex[0]) - end)
                                 .norm();
        for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
          const Vec3 expected = width_m * facet.face_normal(facet.edges[e].face[k]);
          CHECK((facet.tilt(e, k) - expected).norm() < kRounding_m);
        }
        // The side's plane: away from the facet, through both ends of the edge.
        const std::uint32_t side = facet.face_count + e;
        for (std::uint32_t v = 0; v < facet.vertex_count; ++v) {
          CHECK(facet.plane_normal(side).dot(facet.vertex(v)) <=
                facet.plane_offset(side) + kRounding_m);
        }
      }
      CHECK(folds == 1);
    }
  }

  TEST_CASE("a solid in the plane of a sheet holds the part where the sheet does") {
    const ScratchFolder folder("sheet");
    const SceneBytes bytes{
        compile_scene(sheet_scene(folder, 0.0,
                                  "[[static]]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.01]\n"
                                  "position_m = [-0.03, 0.01, -0.005]\n"),
                      {})
            .bytes};
    const Wrench on_sheet = pressed(bytes, 0.005, 0.005, -0.002);
    const Wrench on_solid = pressed(bytes, -0.035, 0.005, -0.002);
    constexpr Real kRounding_n = 1e5_r * std::numeric_limits<Real>::epsilon();
    CHECK(on_sheet.force_w.z() > 1.6_r);
    CHECK(std::abs(on_solid.force_w.z() - on_sheet.force_w.z()) < kRounding_n);
  }

  TEST_CASE("a flat sheet is one facet") {
    const ScratchFolder folder("sheet");
    CHECK(compile_scene(sheet_scene(folder, 0.0), {}).parts[1].reason ==
          "4 open edges (a solid needs none); 2 triangles, 1 facet");
  }

  TEST_CASE("a sheet without thickness holds a part from either side") {
    const ScratchFolder folder("sheet");
    const SceneBytes bytes{compile_scene(sheet_scene(folder, 0.0), {}).bytes};
    const Wrench above = pressed(bytes, 0.005, 0.05, -0.03);
    CHECK(above.force_w[2] == doctest::Approx(800 * 0.03).epsilon(1e-4));
    const Wrench below = pressed(bytes, 0.005, -0.05, 0.02);
    CHECK(below.force_w[2] == doctest::Approx(-800 * 0.03).epsilon(1e-4));
    CHECK(std::abs(above.force_w[0]) + std::abs(above.force_w[1]) < 1e-9);
    // Beside the sheet there is nothing.
    CHECK(pressed(bytes, 0.03, 0.05, -0.03).force_w.norm() == 0);
  }

  TEST_CASE("a part that never turns is held by a sheet as one that may turn, without a torque") {
    const ScratchFolder folder("sheet");
    const char* const kNeverTurns = "[motion_limits]\norientation = { max_angle_rad = 0 }\n";
    const CompiledScene compiled = compile_scene(sheet_scene(folder, 0.5, kNeverTurns), {});
    const SceneBytes bytes{compiled.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    CHECK((view.has_facets() && view.is_locked()));
    // With the corner of the cube over the fold: a part that may turn rolls off it.
    const Wrench locked = pressed(bytes, 0.005, 0.05, -0.03);
    CHECK(locked.force_w[2] > 5);
    CHECK(locked.torque_w == Vec3::Zero());
    const Wrench flat =
        pressed(SceneBytes{compile_scene(sheet_scene(folder, 0.0, kNeverTurns), {}).bytes}, 0.005,
                0.05, -0.03);
    CHECK(flat.force_w[2] == doctest::Approx(800 * 0.03).epsilon(1e-4));
  }

  TEST_CASE("an edge that lies flat between two triangles is no edge to the part") {
    const ScratchFolder folder("sheet");
    SceneFile scene = sheet_scene(folder, 1e-9);  // too high for one facet, too low to feel
    const CompiledScene compiled = compile_scene(scene, {});
    REQUIRE(compiled.parts[1].surface->facets == 2);
    const Wrench above = pressed(SceneBytes{compiled.bytes}, 0.005, 0.05, -0.03);
    CHECK(above.force_w[2] == doctest::Approx(800 * 0.03).epsilon(1e-4));
    CHECK(std::abs(above.force_w[0]) + std::abs(above.force_w[1]) < 1e-3);
  }

  TEST_CASE("damage to the cones of a facet is refused") {
    const ScratchFolder folder("sheet");
    const CompiledScene compiled = compile_scene(sheet_scene(folder, 0.5), {});
    REQUIRE(opened(compiled, [](SceneBytes&) {}) == RtStatus::kOk);
    const auto refused = [&](const std::function<void(SceneBytes&)>& damage, RtStatus status) {
      CHECK(opened(compiled, damage) == status);
    };
    refused([](SceneBytes& b) { section<ConeRange>(b, SectionId::kConeRanges)[2].begin = 1000; },
            RtStatus::kBlobBadIndex);
    refused([](SceneBytes& b) { section<ConeRange>(b, SectionId::kConeRanges)[5].count = 1000; },
            RtStatus::kBlobBadIndex);
    refused([](SceneBytes& b) { section<Real>(b, SectionId::kConeDirections)[0] += 0.25_r; },
            RtStatus::kBlobBadNumber);
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[0].cone_begin = 0; },
            RtStatus::kBlobBadIndex);
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[2].cone_begin = 0; },
            RtStatus::kBlobBadIndex);
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[1].flat_edges = 1; },
            RtStatus::kBlobBadCount);
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[2].flat_edges = 0; },
            RtStatus::kBlobBadCount);
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[2].lane_begin += 24; },
            RtStatus::kBlobBadCount);
    const auto side = [&](const std::function<void(Real*)>& damage) {
      refused([&](SceneBytes& b) { damage(section<Real>(b, SectionId::kConeDirections)); },
              RtStatus::kBlobBadNumber);
    };
    side([](Real* n) { n[0] += 1e-3_r; });
    side([](Real* n) { n[7] = std::numeric_limits<Real>::quiet_NaN(); });
    side([](Real* n) { std::swap_ranges(n, n + 3, n + 3); });
    side([](Real* n) {
      for (int k = 0; k < 3; ++k) n[k] = -n[k];
    });
    refused([](SceneBytes& b) { section<PieceRecord>(b, SectionId::kPieces)[1].volume_m3 = 1e-9; },
            RtStatus::kBlobBadNumber);
    refused(
        [](SceneBytes& b) {
          section<SceneParameters>(b, SectionId::kParameters)->goal_contact = 1;
        },
        RtStatus::kBlobBadNumber);
    refused(
        [](SceneBytes& b) { section<SceneParameters>(b, SectionId::kParameters)->work_units += 1; },
        RtStatus::kBlobBadCapacity);
  }

  TEST_CASE("what a surface cannot have is refused with what to do") {
    const ScratchFolder folder("sheet");
    CHECK_THROWS_WITH_AS(compile_scene(sheet_scene(folder, 0.5, "goal_contact = true\n"), {}),
                         doctest::Contains("leave out [rendering] goal_contact"), InputError);
  }

  TEST_CASE("a start outside the scene's limits is told: the core holds the part inside") {
    const ScratchFolder folder("sheet");
    // The grip stands at the middle of the cube of a centimetre, 5 cm up.
    const auto told = [&](const std::string& limit) {
      std::string text;
      for (const std::string& warning :
           warnings_of(compile_scene(sheet_scene(folder, 0.5, "[motion_limits]\n" + limit), {}))) {
        if (warning.find("outside the scene's limits") != std::string::npos) text += warning;
      }
      return text;
    };
    CHECK(told("workspace = { min_m = [0, 0, 0], max_m = [0.1, 0.1, 0.0551] }\n") == "");
    CHECK(told("workspace = { min_m = [0, 0, 0], max_m = [0.1, 0.1, 0.0549] }\n")
              .find("grip point's z is 0.055 m, and [motion_limits] workspace max_m is") !=
          std::string::npos);
    CHECK(told("orientation = { about = [0, 0, 0, 1], max_angle_rad = 0.1 }\n")
              .find("turned by 3.14159 rad from the middle") != std::string::npos);
  }

  TEST_CASE("a warning about epsilon names the part that it is about, also behind a surface") {
    const ScratchFolder folder("sheet");
    const SceneFile scene =
        sheet_scene(folder, 0.5,
                    "epsilon_m = 0.002\n[[static]]\nshape = \"cylinder\"\nradius_m = 0.01\n"
                    "height_m = 0.02\nsegments = 32\nposition_m = [0.1, 0, 0]\n");
    const CompiledScene compiled = compile_scene(scene, {});
    std::vector<std::string> all = warnings_of(compiled);
    std::ranges::sort(all);
    CHECK(std::ranges::adjacent_find(all) == all.end());  // each once
    const std::vector<std::string> warnings = epsilon_warnings(compiled);
    REQUIRE(!warnings.empty());
    INFO(warnings.back());
    CHECK(warnings.back().find("cylinder") != std::string::npos);
    for (const std::string& warning : warnings)
      CHECK(warning.find("sheet.obj") == std::string::npos);
  }
}
