// SPDX-License-Identifier: Apache-2.0
// Drivers that squeeze, push and carry a hand's part: the bounds of their studies, and proof that a
// bound can be missed.
#include <doctest/doctest.h>

#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include "host_sim/lab/bodies_study/bodies_study.hpp"
#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/lab/bodies_study/peer_run.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

BodiesStudy short_study(const char* name, std::optional<BodiesFault> fault = std::nullopt) {
  return run_bodies_study(name, {true, false, fault});
}

void check_kept(const BodiesStudy& study, std::size_t rows) {
  INFO(bodies_study_end(std::span(&study, 1)).said);
  CHECK(study.rows.size() == rows);
  CHECK(study.bounds() >= rows);
  CHECK(study.missed() == 0);
}

double figure_of(const StudyRow& row, const char* name) {
  const StudyFigure* const figure = row.find(name);
  REQUIRE(figure != nullptr);
  return figure->value;
}

}  // namespace

TEST_SUITE("host_sim.bodies_study") {
  TEST_CASE("squeeze: the driver lags by what there is no room for, and the hand feels nothing") {
    const BodiesStudy study = short_study("squeeze");
    check_kept(study, 2);
    for (const StudyRow& row : study.rows) {
      INFO(row.name);
      CHECK(figure_of(row, "before_n") == doctest::Approx(2).epsilon(0.02));
    }
    CHECK(figure_of(study.rows[0], "reported_n") == doctest::Approx(100).epsilon(1e-3));
    CHECK(figure_of(study.rows[1], "reported_n") > 1e5);  // without a limit
  }

  TEST_CASE("push: the part yields, the driver does not") {
    const BodiesStudy study = short_study("push");
    check_kept(study, 4);
    CHECK(figure_of(study.rows[0], "hand_n") == doctest::Approx(8).epsilon(0.02));
  }

  TEST_CASE("carry: a peg is at rest in a hole that goes at 0.87 m/s and 4 rad/s") {
    const BodiesStudy study = short_study("carry");
    check_kept(study, 1);
    CHECK(figure_of(study.rows[0], "hand_n") > 2);
  }

  TEST_CASE("cost: counts of every case, as a ratio to one body") {
    const BodiesStudy study = short_study("cost");
    check_kept(study, bodies_cost_cases().size());
    CHECK(figure_of(study.rows[1], "units_ratio") == 1);
    CHECK(figure_of(study.rows[2], "units_ratio") > 1);
    CHECK(std::isnan(figure_of(study.rows[1], "instructions_mean")));  // not asked for
  }

  TEST_CASE("size: no tick is over its bound, and the judge finds how deep MuJoCo is") {
    const BodiesStudy study = short_study("size");
    INFO(bodies_study_end(std::span(&study, 1)).said);
    const std::size_t ways = bodies_peer_ways().size();
    REQUIRE(study.rows.size() == 8 * (1 + ways));
    CHECK(study.missed() == 0);
    for (std::size_t k = 0; k < study.rows.size(); ++k) {
      INFO(study.rows[k].name);
      const bool is_law = k % (1 + ways) == 0;
      const bool touches = figure_of(study.rows[k], "contacts") > 0;
      const double depth_um = figure_of(study.rows[k], "depth_um");
      CHECK(depth_um >= 0);
      if (is_law && touches) CHECK(figure_of(study.rows[k], "units_largest") > 0);
      if (is_law || !touches) CHECK(depth_um < 0.2);
      if (!is_law && touches) CHECK(depth_um > 0.2);
    }
  }

  TEST_CASE("a certificate that is too generous misses the bound of the overlap") {
    const BodiesStudy study = short_study("push", BodiesFault::kCertificate);
    CHECK(study.missed() > 0);
    const CampaignEnd end = bodies_study_end(std::span(&study, 1));
    CHECK_FALSE(end.passed);
    CHECK(end.said.find("push, bar, ") != std::string::npos);
    CHECK(end.said.find(": depth_nm ") != std::string::npos);
    CHECK(end.said.ends_with(" bounds MISSED\n"));
  }

  TEST_CASE("figure: a value that is no number keeps no bound") {
    StudyFigure figure{"lag_um", "lag, um", std::numeric_limits<double>::quiet_NaN()};
    CHECK(figure.kept());
    figure.most = 1;
    CHECK_FALSE(figure.kept());
    figure.value = 1;
    CHECK(figure.kept());
    figure.least = 2;
    CHECK_FALSE(figure.kept());
  }

  TEST_CASE("program: exit 0 and three files; a fault is exit 1") {
    const ScratchFolder folder("bodies_study");
    const std::string out = folder.file("out");
    const ProgramResult sound =
        run_program(HAPTIC_HOST_SIM, "bodies --short --no-instructions --out " + out);
    INFO(sound.out << sound.err);
    CHECK(sound.exit_code == 0);
    CHECK(sound.out.ends_with(" bounds kept\n"));
    for (const char* end : {".csv", ".json", ".md"})
      CHECK(std::filesystem::file_size(out + "/bodies" + end) > 100);
    const ProgramResult damaged =
        run_program(HAPTIC_HOST_SIM, "bodies --study push --short --fault certificate");
    CHECK(damaged.exit_code == 1);
    const ProgramResult once = run_program(HAPTIC_HOST_SIM, "bodies --once 0 --short");
    CHECK(once.out.starts_with("250 ticks, final state hash "));
    CHECK(run_program(HAPTIC_HOST_SIM, "bodies --once 99").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "bodies --study nothing").exit_code == 2);
  }
}
