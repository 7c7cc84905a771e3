// SPDX-License-Identifier: Apache-2.0
// The guide study in its short form, and what its verdict sees.
#include <doctest/doctest.h>

#include "host_sim/lab/studies/planning/guide_study.hpp"

using namespace haptic;
using namespace haptic::sim;

TEST_SUITE("host_sim.guide_study") {
  TEST_CASE("study: few runs, the same with two threads, sound and within the stated energy") {
    GuideStudyOptions options;
    // The plan is another in single precision, and of the hands that it serves less well, 2 of 16,
    // both are among the first four.
    options.runs = HAPTIC_REAL_IS_FLOAT ? 8 : 4;
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
      if (cell.guide != "none" && cell.guide != "other hole") CHECK(cell.inserted_share() > 0.5);
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

  TEST_CASE("study: a plan enters the hole upright, with the clearance that the hole has") {
    GuideStudyOptions options;
    options.plans = 3;
    const GuideStudyBench bench = guide_study_bench(options);
    const double rim_m = bench.task.goal.x0_w.z() + bench.task.depth_m;
    for (const StudyGuide& guide : bench.guides) {
      if (guide.name != "plan") continue;
      for (const tools::SceneBytes& scene : guide.scenes) {
        SceneView view;
        REQUIRE(SceneView::open(scene.span(), view) == RtStatus::kOk);
        std::size_t inside = 0;
        for (const GuideStation& station : view.guide_stations()) {
          if (static_cast<double>(station.x0_m[2]) > rim_m - 1e-3) continue;
          ++inside;
          CHECK(static_cast<double>(station.clearance_m) > 0.9e-3 * options.clearance_mm);
        }
        CHECK(inside > 20);
      }
    }
  }

  TEST_CASE("verdict: a worse guide, too much energy and an unsound run are each seen") {
    InsertionRun in;
    in.inserted = true;
    StudyCell none{"light", "none", false, {in, in}}, plan{"light", "plan", false, {in, in}};
    CHECK(verdict_of({none, plan}).passed());
    plan.runs[0].inserted = false;
    CHECK_FALSE(verdict_of({none, plan}).helps);
    plan.runs[0] = in;
    plan.runs[0].time_s = plan.runs[1].time_s = 1e-3;
    CHECK_FALSE(verdict_of({none, plan}).as_fast);
    plan.runs = {in, in};
    plan.runs[0].peak_n = plan.runs[1].peak_n = 1e-3;
    CHECK_FALSE(verdict_of({none, plan}).as_gentle);
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
