// SPDX-License-Identifier: Apache-2.0
// How the compiler's time and memory grow: the powers, what a refused part says, and the program.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "host_sim/lab/growth/growth_study.hpp"
#include "host_sim/session/child_run.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

TEST_SUITE("host_sim.growth") {
  TEST_CASE("powers are those of the last two parts") {
    GrowthRun run;
    run.series.name = "made up";
    for (const std::uint32_t size : {10u, 100u, 300u}) {
      GrownPart part;
      part.size = size;
      part.processor_s = 1e-4 * size * size;
      part.peak_bytes = std::uint64_t{1000} * size;
      part.scene_bytes = 5000;
      run.parts.push_back(part);
    }
    const GrowthExponents powers = exponents_of(run);
    CHECK(std::abs(powers.processor - 2) < 1e-9);
    CHECK(std::abs(powers.peak - 1) < 1e-9);
    CHECK(std::abs(powers.scene) < 1e-9);
    CHECK(grows_as_it_should({run}, 2.1));
    CHECK_FALSE(grows_as_it_should({run}, 1.9));
    run.parts.back().refusal = "no: \"it\"";
    CHECK_FALSE(grows_as_it_should({run}, 2.1));
    CHECK(exponents_of(run).processor == 0);
    CHECK(growth_csv({run}).find("made up,300,9.000,300000,5000,\"no: 'it'\"") !=
          std::string::npos);
    CHECK(growth_table({run}).find("REFUSED: no") != std::string::npos);
  }

  TEST_CASE("program: every small part is compiled; a power that it may not have is exit 1") {
    const std::string out = "growth_out";
    const ProgramResult sound =
        run_program(HAPTIC_HOST_SIM, "growth --quick --most-exponent 10 --out " + out);
    INFO(sound.out << sound.err);
    CHECK(sound.exit_code == 0);
    const std::string csv = file_text(out + "/growth.csv");
    for (const GrowthSeries& series : growth_series(true)) {
      for (const std::uint32_t size : series.sizes)
        CHECK(csv.find("\n" + series.name + "," + std::to_string(size) + ",") != std::string::npos);
    }
    const ProgramResult steep =
        run_program(HAPTIC_HOST_SIM, "growth --quick --most-exponent 0.01 --out " + out);
    CHECK(steep.exit_code == 1);
    CHECK(steep.out.find("A CHECK FAILED") != std::string::npos);
    std::filesystem::remove_all(out);
  }
}
