// SPDX-License-Identifier: Apache-2.0
// The cost of a tick on fixed scenes: its scenes, its figures, and the comparison of two builds.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "host_sim/lab/cost/cost_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

constexpr std::size_t kRunTicks = 200;

/// Ticks with a force that grows, one unit of work more in each, and instructions where counted.
CostRun run_of_ticks(bool counted) {
  CostRun run;
  run.name = "slope";
  run.capacity.max_work_units = 1000;
  run.instructions.measured = counted;
  for (std::size_t i = 0; i < kRunTicks; ++i) {
    CostTick tick;
    tick.t_s = 1e-3 * static_cast<double>(i);
    tick.time_ns = 1000.0 + static_cast<double>(i);
    tick.counters.work_units = static_cast<std::uint32_t>(i);
    tick.instructions = counted ? 5000 - i : 0;
    tick.force_n[0] = 0.1 * static_cast<double>(i);
    tick.proxy_wxyz[0] = 1;
    tick.gap_m = i == 7 ? -1e-8 : 1e-3;
    if (i >= 150) tick.situation = ContactSituation::kFaceFace;
    run.ticks.push_back(tick);
  }
  return run;
}

void put(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// An earlier report of one run in a folder.
void put_report(const ScratchFolder& folder, const CostRun& run, const std::string& motion) {
  put(folder.file(run.name + ".csv"), cost_ticks_csv(run));
  put(folder.file(run.name + "_motion.csv"), motion);
}

}  // namespace

TEST_SUITE("host_sim.cost") {
  TEST_CASE("figures: ranks of the counts, the largest tick, contact and gap") {
    const CostFigures counted = figures_of(run_of_ticks(true));
    CHECK(counted.mean_instructions == doctest::Approx(4900.5));
    CHECK(counted.p50_instructions == 4901);
    CHECK(counted.p99_instructions == 4999);
    CHECK(counted.most_instructions == 5000);
    CHECK(counted.largest_tick == 0);
    CHECK(counted.contact_ticks == 50);
    CHECK(counted.largest_us == doctest::Approx(1.199));
    CHECK(counted.least_gap_m == -1e-8);
    CHECK(counted.most_work == 199);
    CostRun wider = run_of_ticks(true);
    wider.capacity.max_work_units += 10;
    CHECK(figures_of(wider).work_bound == counted.work_bound + 10);
    CHECK(counted.work_bound == 1000);
    CHECK(counted.passed());
    const CostFigures uncounted = figures_of(run_of_ticks(false));
    CHECK(uncounted.most_instructions == 0);
    CHECK(uncounted.largest_tick == 199);
  }

  TEST_CASE("figures: a count over its bound and a result that is no number are each seen") {
    CostRun over = run_of_ticks(true);
    over.capacity.max_work_units = 198;
    CHECK_FALSE(figures_of(over).passed());
    CostRun broken = run_of_ticks(true);
    broken.ticks[3].torque_nm[2] = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(figures_of(broken).passed());
    CHECK(cost_table({&broken, 1}).find("NOT FINITE in 1 ticks") != std::string::npos);
  }

  TEST_CASE("cold: the first and every 50th tick, fewer and evenly of a large scene") {
    const std::vector<std::size_t> few = cold_ticks(120, 1000);
    CHECK(few == std::vector<std::size_t>{0, 50, 100});
    CHECK(cold_ticks(1, 1000).size() == 1);
    CHECK(cold_ticks(14600, 1000).size() == 292);
    const std::vector<std::size_t> large = cold_ticks(14600, std::uint64_t{1} << 30);
    CHECK(large == std::vector<std::size_t>{0, 3650, 7300, 10950});
    CHECK(cold_ticks(14600, std::uint64_t{1} << 40) == std::vector<std::size_t>{0});
  }

  TEST_CASE("cold: figures in microseconds, and a repeat that ends elsewhere is seen") {
    CostRun run = run_of_ticks(false);
    CHECK(figures_of(run).cold_ticks == 0);
    run.cold.ticks = {{0, 1000, 3000}, {50, 2000, 9000}, {100, 1500, 4000}};
    run.cold.warm = {3, 1500, 2000, 2000, 2000};
    run.cold.flushed = {3, 4000, 9000, 9000, 9000};
    run.cold.worst_flushed = 50;
    const CostFigures f = figures_of(run);
    CHECK(f.cold_ticks == 3);
    CHECK(f.same_warm_median_us == doctest::Approx(1.5));
    CHECK(f.cold_median_us == doctest::Approx(4));
    CHECK(f.cold_largest_us == doctest::Approx(9));
    CHECK(f.cold_largest_tick == 50);
    CHECK(f.passed());
    CHECK(cost_csv({&run, 1}).find(",3,1.500,4.000,9.000,50,") != std::string::npos);
    const auto json = nlohmann::json::parse(cost_json({&run, 1}, {}));
    CHECK(json["scenes"][0]["cold_us"]["largest_tick"] == 50);
    CHECK(cost_table({&run, 1}).find("DIFFERENT STATES") == std::string::npos);
    run.cold.same_result = false;
    CHECK_FALSE(figures_of(run).passed());
    CHECK(cost_table({&run, 1}).find("DIFFERENT STATES") != std::string::npos);
  }

  TEST_CASE("comparison: a run equals its own table, digit by digit") {
    const ScratchFolder folder("cost_same");
    CostRun run = run_of_ticks(true);
    run.ticks[5].force_n[1] = 1.0 / 3.0;
    run.ticks[6].proxy_m[2] = -4.9406564584124654e-324;
    put_report(folder, run, "motion");
    const CostDifference d =
        difference_of(run, "motion", read_earlier_run(folder.file(""), run.name));
    CHECK(d.missing.empty());
    CHECK(d.ticks == kRunTicks);
    CHECK(d.differing == 0);
    CHECK(d.force_n.largest == 0);
    REQUIRE(d.before);
    REQUIRE(d.after);
    CHECK(d.before->mean == d.after->mean);
    CHECK(d.before->largest == 5000);
  }

  TEST_CASE("comparison: the size of every difference, and where the largest is") {
    const ScratchFolder folder("cost_differs");
    const CostRun before = run_of_ticks(false);
    put_report(folder, before, "motion");
    CostRun after = run_of_ticks(true);
    after.ticks[40].force_n[1] = 0.3;
    after.ticks[40].force_n[2] = 0.4;
    after.ticks[30].torque_nm[0] = -0.02;
    after.ticks[50].proxy_m[2] = 1e-6;
    after.ticks[60].proxy_wxyz[0] = std::cos(0.005);
    after.ticks[60].proxy_wxyz[3] = std::sin(0.005);
    const CostDifference d =
        difference_of(after, "motion", read_earlier_run(folder.file(""), after.name));
    CHECK(d.differing == 4);
    CHECK(d.first_differing == 30);
    CHECK(d.largest_at == 40);
    CHECK(d.force_n.largest == doctest::Approx(0.5));
    CHECK(d.force_n.p99 == 0);
    CHECK(d.torque_nm.largest == doctest::Approx(0.02));
    CHECK(d.proxy_m.largest == doctest::Approx(1e-6));
    CHECK(d.proxy_rad.largest == doctest::Approx(0.01));
    CHECK_FALSE(d.before);
    CHECK(all_compared({&d, 1}));
    CHECK(comparison_table({&d, 1}).find("not counted in the earlier report") != std::string::npos);
    // A result that is no number is no small difference.
    after.ticks[70].force_n[0] = std::numeric_limits<double>::quiet_NaN();
    CHECK(std::isinf(difference_of(after, "motion", read_earlier_run(folder.file(""), after.name))
                         .force_n.largest));
  }

  TEST_CASE("comparison: a missing scene, tick or motion fails") {
    const ScratchFolder folder("cost_missing");
    const CostRun run = run_of_ticks(true);
    const auto compared = [&](const CostRun& now, const std::string& motion) {
      const CostDifference d =
          difference_of(now, motion, read_earlier_run(folder.file(""), now.name));
      CHECK(all_compared({&d, 1}) == d.missing.empty());
      return d.missing;
    };
    CHECK(compared(run, "motion") == "the scene");
    put_report(folder, run, "motion");
    CHECK(compared(run, "motion").empty());
    CHECK(compared(run, "another") == "the same motion");
    CostRun longer = run;
    longer.ticks.push_back(run.ticks.back());
    CHECK(compared(longer, "motion") == "ticks: 200 and not 201");
    std::filesystem::remove(folder.file(run.name + "_motion.csv"));
    CHECK(compared(run, "motion") == "its motion");
  }

  TEST_CASE("comparison: a table that is none is refused with its line") {
    const ScratchFolder folder("cost_refused");
    const CostRun run = run_of_ticks(true);
    const std::string table = cost_ticks_csv(run);
    const auto refusal = [&](const std::string& text) -> std::string {
      put(folder.file("slope.csv"), text);
      try {
        static_cast<void>(read_earlier_run(folder.file(""), "slope"));
      } catch (const tools::InputError& error) {
        return error.what();
      }
      return "";
    };
    CHECK(refusal(table).empty());
    CHECK(refusal(with_replaced(table, "fx_n", "fx")).find("slope.csv:1: no column fx_n") !=
          std::string::npos);
    CHECK(refusal(with_replaced(table, "\n1,0.001000,", "\n1,0.0010o0,"))
              .find("slope.csv:3: '0.0010o0' is no number") != std::string::npos);
    CHECK(refusal(with_replaced(table, "\n1,0.001000,", "\n1,0.001000,,")).find("slope.csv:3: ") !=
          std::string::npos);
    // A counter that this build does not have is no reason to refuse.
    CHECK(refusal(with_replaced(table, "qp_steps", "qp_hops")).empty());
  }

  TEST_CASE("scenes: those of host_sim/scenes are the files there, the others are whole") {
    for (const CostSceneName& each : cost_scene_names()) {
      const CostScene scene = cost_scene(each.name);
      CAPTURE(each.name);
      CHECK(scene.files.size() >= 2);  // scene and motion, and meshes unless its parts are shapes
      const bool again = cost_scene(each.name).files[1].content == scene.files[1].content;
      CHECK(again);
    }
    for (const OutputText& file : cost_scene("peg").files) {
      CAPTURE(file.name);
      CHECK(file.content ==
            file_text(std::string(HAPTIC_SCENES_DIR) + "/square_peg_five/" + file.name));
    }
    CHECK_THROWS_AS(static_cast<void>(cost_scene("pegg")), tools::UsageError);
    CHECK_THROWS_AS(static_cast<void>(program_beside("no_such_program")), tools::InputError);
  }

  TEST_CASE("the program: pairs as said, contact, files for replay, and equal when run again") {
    const ScratchFolder folder("cost_program");
    const std::string call = "cost --quick --no-instructions --repeats 1 --scenes ";
    const ProgramResult first =
        run_program(HAPTIC_HOST_LAB, call + "peg,peg32,assembly --out '" + folder.file("a") + "'");
    INFO(first.out, first.err);
    REQUIRE(first.exit_code == 0);
    const auto json = nlohmann::json::parse(file_text(folder.file("a/cost.json")));
    const std::size_t pairs[] = {5, 32, 361};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& scene = json["scenes"][k];
      CHECK(scene["pairs"] == pairs[k]);
      CHECK(2 * scene["contact_ticks"].get<std::size_t>() > scene["ticks"].get<std::size_t>());
      CHECK(scene["counters"]["plane_gaps"]["largest"].get<std::size_t>() > pairs[k]);
      CHECK_FALSE(scene["instructions"]["measured"].get<bool>());
      CHECK(scene["passed"].get<bool>());
      CHECK(scene["cold_us"]["ticks"] == cold_ticks(scene["ticks"].get<std::size_t>(), 1).size());
      CHECK(scene["cold_us"]["median"].get<double>() > 0);
    }
    for (const char* name : {"cost.csv", "cost.svg", "assembly.csv", "peg32.rtscene",
                             "peg32_motion.csv", "scenes/peg32/scene.toml"}) {
      CAPTURE(name);
      CHECK(std::filesystem::exists(folder.file("a/" + std::string(name))));
    }
    const std::string compare = call + "peg --compare '" + folder.file("a") + "' --out '";
    const ProgramResult again = run_program(HAPTIC_HOST_LAB, compare + folder.file("b") + "'");
    INFO(again.out, again.err);
    CHECK(again.exit_code == 0);
    CHECK(file_text(folder.file("a/peg.csv")) == file_text(folder.file("b/peg.csv")));
    CHECK(nlohmann::json::parse(
              file_text(folder.file("b/cost.json")))["comparison"][0]["differing"] == 0);
    // Into the folder that is read, a scene that is not there, a name that is none.
    CHECK(run_program(HAPTIC_HOST_LAB, compare + folder.file("a") + "'").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_LAB, call + "ell --compare '" + folder.file("a") + "' --out '" +
                                           folder.file("c") + "'")
              .exit_code == 1);
    CHECK(run_program(HAPTIC_HOST_LAB, call + "pegg --out '" + folder.file("c") + "'").exit_code ==
          2);
  }
}
