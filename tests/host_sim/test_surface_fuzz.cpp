// SPDX-License-Identifier: Apache-2.0
// The proxy on triangle meshes under random devices, and proof that the checks can fail.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>

#include "host_sim/lab/surface_fuzz/surface_campaign.hpp"
#include "host_sim/lab/surface_fuzz/surface_comparison.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

SurfaceFuzzResult run(std::uint64_t ticks, std::uint64_t seed, std::uint32_t threads,
                      std::optional<std::size_t> scenes,
                      std::optional<SurfaceFault> fault = std::nullopt,
                      std::vector<double> frictions = {0.0}) {
  SurfaceFuzzSize size;
  size.ticks = ticks;
  size.seed = seed;
  size.scenes = scenes;
  size.fault = fault;
  size.frictions = std::move(frictions);
  return run_surface_fuzz(size, {threads, false});
}

void check_invariants(const SurfaceFuzzResult& result) {
  const SurfaceTotals t = result.totals();
  INFO(surface_fuzz_page(result));
  CHECK(t.ticks >= result.size.ticks);
  CHECK(t.held > t.ticks / 4);  // the obstacles were met
  CHECK(t.ways > t.ticks / 4);
  CHECK(t.failed() == 0);
  CHECK(t.failures.empty());
  MESSAGE(t.ticks << " ticks, " << t.held << " held: worst gap "
                  << static_cast<double>(t.worst_gap_m) << " m, on the way "
                  << static_cast<double>(t.worst_way_m) << " m, longest arrival "
                  << t.longest_arrival << " ticks, triangles met in " << t.meeting);
}

}  // namespace

TEST_SUITE("host_sim.surface_fuzz") {
  TEST_CASE("closed meshes: free at the ends and on the ways, no rise, and at rest in the end") {
    check_invariants(run(16000, 1, 2, std::nullopt, std::nullopt, {0.0}));
  }

  TEST_CASE("closed meshes with friction, drawn at random") {
    check_invariants(run(8000, 2, 2, 10, std::nullopt, {0.3}));
  }

  TEST_CASE("surfaces, open and torn ones too: no triangle is ever touched") {
    SurfaceFuzzSize size;
    size.ticks = 16000;
    size.seed = 4;
    size.frictions = {0.0, 0.3};
    size.as = PartKind::kSurface;
    size.strict = true;
    const SurfaceFuzzResult result = run_surface_fuzz(size, {2, false});
    check_invariants(result);
    CHECK(result.totals().meeting == 0);
  }

  TEST_CASE("surfaces against solids held apart by the same skin: the same forces") {
    const SurfaceComparison compared = compare_surfaces(PartKind::kSurface, false, {2, false});
    INFO(surface_comparison_page(compared));
    CHECK_FALSE(compared.failed());
    for (const SurfaceComparisonRow& row : compared.rows) {
      INFO(row.scene);
      CHECK(row.median_n < (sizeof(Real) == sizeof(float) ? 1e-3 : 1e-13));
      CHECK(row.p99_n < (sizeof(Real) == sizeof(float) ? 2 : 2e-6));
      CHECK(row.farther_off_n < (sizeof(Real) == sizeof(float) ? 2 : 1e-13));
    }
    // Both blocks have a flat top.
    CHECK(std::ranges::count_if(compared.rows, [](const auto& row) { return row.on_top > 50; }) ==
          6);
  }

  TEST_CASE("[long] closed meshes: the same on 40 pairs over a million ticks and another seed") {
    check_invariants(run(1000000, 3, 2, 40, std::nullopt, {0.0, 0.3}));
  }

  TEST_CASE("the result does not depend on the number of threads") {
    const SurfaceFuzzResult one = run(2000, 3, 1, 2), three = run(2000, 3, 3, 2);
    CHECK(surface_fuzz_page(one) == surface_fuzz_page(three));
    CHECK(surface_fuzz_page(one) != surface_fuzz_page(run(2000, 4, 3, 2)));
  }

  TEST_CASE("a mesh that lies 20 um elsewhere is found to be crossed") {
    CHECK(run(4000, 5, 2, 2, SurfaceFault::kDisplaced).totals().deep > 0);
  }

  TEST_CASE("the device's own pose crosses, and passes on the way") {
    const SurfaceTotals t = run(4000, 5, 2, 2, SurfaceFault::kGoal).totals();
    CHECK(t.deep > 0);
    CHECK(t.passages > 0);
  }

  TEST_CASE("a certificate of the core that is too generous leaves the part across the mesh") {
    CHECK(run(4000, 5, 2, 2, SurfaceFault::kCertificate).totals().deep > 0);
  }

  TEST_CASE("strict: solids are let in by less than the tolerance, which is then too deep") {
    SurfaceFuzzSize size;
    size.ticks = 1000;
    size.scenes = 2;
    size.frictions = {0.0};
    CHECK(run_surface_fuzz(size, {2, false}).totals().failed() == 0);
    size.strict = true;
    const SurfaceTotals t = run_surface_fuzz(size, {2, false}).totals();
    CHECK(t.deep > 0);
    CHECK(t.meeting >= t.deep);
  }

  TEST_CASE("one run alone does what it did among the others, and brings its files") {
    SurfaceFuzzSize size;
    size.ticks = 4000;
    size.scenes = 1;
    size.frictions = {0.0};
    size.fault = SurfaceFault::kGoal;
    const SurfaceFuzzResult all = run_surface_fuzz(size, {1, false});
    size.only = 3;
    const SurfaceFuzzResult one = run_surface_fuzz(size, {1, false});
    REQUIRE(one.rows.size() == 1);
    CHECK(one.rows[0].totals.deep == all.rows[3].totals.deep);
    CHECK(one.rows[0].totals.worst_gap_m == all.rows[3].totals.worst_gap_m);
    CHECK(one.files.size() == 3);
    CHECK(one.motion.size() == one.rows[0].totals.ticks);
    CHECK(one.totals().failures.lines().front().find(", run 3, tick ") != std::string::npos);
    size.only = 10;
    CHECK_THROWS_WITH_AS(static_cast<void>(run_surface_fuzz(size, {1, false})),
                         "no run 10; there are 10, from 0", tools::InputError);
  }

  TEST_CASE("a part that trembles by 2 um gains energy and never rests") {
    const SurfaceTotals t = run(1000, 5, 2, 1, SurfaceFault::kRestless).totals();
    CHECK(t.rises > 0);
    CHECK(t.unarrived > 0);
  }

  TEST_CASE("solids against the same solids: no difference; a device 1 mm off: whole newtons") {
    const SurfaceComparison same = compare_surfaces(PartKind::kSolid, false, {2, false});
    INFO(surface_comparison_page(same));
    CHECK(same.rows.size() == 12);
    CHECK_FALSE(same.failed());
    for (const SurfaceComparisonRow& row : same.rows) {
      INFO(row.scene);
      CHECK(row.held > row.ticks / 2);
      CHECK(row.largest_n == 0);
      CHECK(row.largest_force_n > 2);
    }
    const SurfaceComparison moved = compare_surfaces(PartKind::kSolid, true, {2, false});
    CHECK(moved.failed());
    CHECK(moved.rows.front().farther_off_n > 0.5);
  }

  TEST_CASE("a scene file is run as it says, about its own grip") {
    const std::string file = HAPTIC_SCENES_DIR "/square_peg_five/scene.toml";
    SurfaceFuzzSize size;
    size.ticks = 2000;
    size.scene_file = file;
    const SurfaceFuzzResult result = run_surface_fuzz(size, {2, false});
    INFO(surface_fuzz_page(result));
    CHECK(result.totals().failed() == 0);
    CHECK(result.totals().held > 100);
    size.fault = SurfaceFault::kGoal;
    CHECK(run_surface_fuzz(size, {2, false}).totals().deep > 0);
  }

  TEST_CASE("a scene file along a motion of a file: all of it, with many passes and with one") {
    SurfaceFuzzSize size;
    size.scene_file = HAPTIC_SCENES_DIR "/square_peg_five/scene.toml";
    size.motion_file = "surface_fuzz_motion.csv";
    std::vector<MotionSample> motion;
    for (int k = 0; k < 400; ++k) {  // from above down into the wall
      MotionSample at;
      at.t_s = 1e-3 * k;
      at.p[0] = 0.006;
      at.p[2] = 0.05 - 2e-4 * k;
      motion.push_back(at);
    }
    write_motion_csv(size.motion_file, motion);
    const SurfaceFuzzResult result = run_surface_fuzz(size, {2, false});
    INFO(surface_fuzz_page(result));
    REQUIRE(result.rows.size() == 2);
    for (const SurfaceFuzzRow& row : result.rows) {
      CHECK(row.motion == size.motion_file);
      CHECK(row.totals.ticks >= motion.size());
      CHECK(row.totals.held > 50);
    }
    CHECK(result.rows.back().totals.ways >= motion.size());
    CHECK(result.totals().failed() == 0);
    size.fault = SurfaceFault::kGoal;
    CHECK(run_surface_fuzz(size, {2, false}).totals().deep > 0);
    std::filesystem::remove(size.motion_file);
  }

  TEST_CASE("program: exit 0 and three files; a fault is exit 1 with seed, scene, tick and poses") {
    const std::string out = "surface_fuzz_out";
    const ProgramResult sound = run_program(
        HAPTIC_HOST_SIM, "surface-fuzz --ticks 1000 --scenes 2 --friction 0 --out " + out);
    INFO(sound.out << sound.err);
    CHECK(sound.exit_code == 0);
    for (const char* name : {"md", "csv", "json"}) {
      CHECK(std::filesystem::exists(out + "/surface_fuzz." + name));
    }
    const ProgramResult compared =
        run_program(HAPTIC_HOST_SIM, "surface-fuzz --compare --as solid --out " + out);
    INFO(compared.out << compared.err);
    CHECK(compared.exit_code == 0);
    for (const char* name : {"md", "csv", "json"}) {
      CHECK(std::filesystem::exists(out + "/surface_compare." + name));
    }
    std::filesystem::remove_all(out);
    for (const std::string fault : {"displaced", "goal", "restless", "certificate"}) {
      const ProgramResult damaged = run_program(
          HAPTIC_HOST_SIM, "surface-fuzz --ticks 1000 --scenes 1 --friction 0 --fault " + fault);
      INFO(fault << ": " << damaged.out << damaged.err);
      CHECK(damaged.exit_code == 1);
      CHECK(damaged.out.find(", seed ") != std::string::npos);
      CHECK(damaged.out.find(", run ") != std::string::npos);
      CHECK(damaged.out.find(", tick ") != std::string::npos);
      CHECK(damaged.out.find("part at p = (") != std::string::npos);
      CHECK(damaged.out.find("goal at p = (") != std::string::npos);
    }
    const ProgramResult one = run_program(
        HAPTIC_HOST_SIM, "surface-fuzz --ticks 1000 --scenes 1 --friction 0 --only 2 --out " + out);
    INFO(one.out << one.err);
    CHECK(one.exit_code == 0);
    CHECK(std::filesystem::exists(out + "/motion.csv"));
    const ProgramResult again =
        run_program(HAPTIC_HOST_SIM, "surface-fuzz --ticks 500 " + out + "/scene.toml");
    INFO(again.out << again.err);
    CHECK(again.exit_code == 0);
    std::filesystem::remove_all(out);
    CHECK(run_program(HAPTIC_HOST_SIM, "surface-fuzz --ticks 0").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "surface-fuzz a.toml --scenes 3").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "surface-fuzz no_such.toml").exit_code == 3);
  }
}
