// SPDX-License-Identifier: Apache-2.0
// The guide study in its short form, and what its verdict sees.
#include <doctest/doctest.h>

#include "host_sim/lab/planning/guide_study.hpp"

using namespace haptic::sim;

TEST_SUITE("host_sim.guide_study") {
  TEST_CASE("study: few runs, the same with two threads, sound and within the stated energy") {
    GuideStudyOptions options;
    options.runs = 4;
    options.plans = 1;
    const GuideStudyBench bench = guide_study_bench(options);
    const std::vector<StudyCell> cells = run_guide_study(bench, options);
    CHECK(cells.size() == 3 * bench.guides.size());
    const StudyVerdict verdict = verdict_of(cells);
    CHECK(verdict.sound);
    CHECK(verdict.within_energy);
    for (const StudyCell& cell : cells) {
      CAPTURE(cell.hand);
      CAPTURE(cell.guide);
      // Its plan comes down upright; that of the scene's own start enters the hole tilted, which a
      // hand that holds the peg upright is kept out by (COMMANDS.md).
      if (cell.guide == "other start") CHECK(cell.inserted_share() > 0.5);
      for (const InsertionRun& run : cell.runs) {
        CHECK((run.stated_j > 0) == (cell.guide != "none"));
        CHECK(run.time_s <= bench.task.limit_s + 1e-9);
      }
    }
    options.threads = 2;
    const std::vector<OutputText> files = guide_study_files(bench, cells, options);
    const std::vector<OutputText> again =
        guide_study_files(bench, run_guide_study(bench, options), options);
    REQUIRE(files.size() == again.size());
    for (std::size_t k = 0; k < files.size(); ++k) CHECK(files[k].content == again[k].content);
  }

  TEST_CASE("verdict: fewer that are in, too much energy and an unsound run are each seen") {
    InsertionRun in;
    in.inserted = true;
    StudyCell none{"light", "none", false, {in, in}}, plan{"light", "plan", false, {in, in}};
    CHECK(verdict_of({none, plan}).passed());
    plan.runs[0].inserted = false;
    CHECK_FALSE(verdict_of({none, plan}).helps);
    // A wrong guide may do harm.
    plan.wrong = true;
    CHECK(verdict_of({none, plan}).passed());
    plan.runs[0].guide_j = 1e-9;
    CHECK_FALSE(verdict_of({none, plan}).within_energy);
    plan.runs[0] = in;
    plan.runs[0].sound = false;
    CHECK_FALSE(verdict_of({none, plan}).sound);
  }
}
