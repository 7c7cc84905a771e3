// SPDX-License-Identifier: Apache-2.0
// The table of planners: rows as they are done, and a run that goes on after an interruption.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "host_sim/lab/planning/sampling_planners.hpp"
#include "host_sim/lab/studies/planning/planning_table.hpp"
#include "host_sim/report/kept_rows.hpp"
#include "host_sim/report/part_report.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

TEST_SUITE("host_sim.planning_table") {
  TEST_CASE(
      "kept rows: what is done is read back with the same bits, under the same options alone") {
    const ScratchFolder scratch("kept_rows");
    const std::string file = scratch.file("rows.txt");
    const std::vector<double> numbers{1.0 / 3, -2e-300, 7};
    {
      KeptRows rows(file, "seconds 3", true);
      CHECK(rows.find("one") == nullptr);
      rows.keep("one", numbers);
      rows.keep("two", {2});
    }
    KeptRows again(file, "seconds 3", true);
    REQUIRE(again.find("one") != nullptr);
    CHECK(*again.find("one") == numbers);
    CHECK(again.find("three") == nullptr);
    CHECK_THROWS_AS(KeptRows(file, "seconds 4", true), tools::InputError);
    CHECK(KeptRows(file, "seconds 4", false).find("one") == nullptr);
    write_whole_file(file, "seconds 3\none,1,x\n");
    CHECK_THROWS_AS(KeptRows(file, "seconds 3", true), tools::InputError);
    KeptRows none("", "seconds 3", true);
    none.keep("one", numbers);
    CHECK(none.find("one") == nullptr);
  }

  TEST_CASE("planners: a row is told when it is done, and is not run again") {
    const ScratchFolder scratch("planning_rows");
    PlanningOptions options;
    options.quick = options.ours_only = true;
    options.seeds = 1;
    options.puzzles = "peg";
    options.rows = scratch.file("rows.txt");
    std::size_t told = 0;
    const std::vector<PlanningRow> rows =
        run_planning(options, [&](const std::vector<PlanningRow>& done) { told += done.size(); });
    REQUIRE(rows.size() == 1);
    CHECK(told == 1);
    CHECK(planning_passed(rows));
    CHECK(rows[0].clearance_mm == 0.1);
    CHECK(rows[0].certified == rows[0].steps);
    // A number that no run gives shows that the row is taken as it stands.
    std::string text = text_of_file(options.rows);
    const std::size_t at = text.find("felt part,1,1,");
    REQUIRE(at != std::string::npos);
    write_whole_file(options.rows, text.insert(at + 12, "23"));
    options.resume = true;
    const std::vector<PlanningRow> again = run_planning(options);
    REQUIRE(again.size() == 1);
    CHECK(again[0].found == 231);
    CHECK(again[0].steps == rows[0].steps);
    options.seconds = 1;
    CHECK_THROWS_AS((void)run_planning(options), tools::InputError);
    const std::string page = planning_files(again, options)[0].content;
    for (const char* const column : {"clearance_mm", "limit_s", "seeds", "certified_percent"})
      CHECK(page.find(column) != std::string::npos);
  }

  TEST_CASE("planners: what failed with more room is not run with less, where that is asked") {
    if (sampling_planners().empty()) {
      MESSAGE("skipped: built without OMPL");
      return;
    }
    const ScratchFolder scratch("planning_failed");
    PlanningOptions options;
    options.seeds = 1;
    options.puzzles = "peg";
    options.rows = scratch.file("rows.txt");
    options.resume = options.until_failed = true;
    // Every row is kept, so nothing is run: one planner fails at 1 mm, ours at 0.5 mm.
    std::string text = "planners, seconds 120, seeds 1, until failed\n";
    for (const Puzzle& puzzle : planning_puzzles(options)) {
      const auto row = [&](const std::string& planner, bool found) {
        text += puzzle.name + " " + planner + ",1," + (found ? "1" : "0") + ",1,1,10,4,4\n";
      };
      row("felt part", puzzle.clearance_mm != 0.5);
      for (const std::string& planner : sampling_planners())
        row(planner, planner != "EST" || puzzle.clearance_mm != 1);
    }
    write_whole_file(options.rows, text);
    const std::vector<PlanningRow> rows = run_planning(options);
    CHECK_FALSE(planning_passed(rows));
    for (const PlanningRow& row : rows) {
      CAPTURE(row.planner);
      CAPTURE(row.clearance_mm);
      CHECK(row.runs == (row.planner == "EST" && row.clearance_mm < 1 ? 0 : 1));
    }
  }
}
