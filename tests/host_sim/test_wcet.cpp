// SPDX-License-Identifier: Apache-2.0
// Worst-case tests of a scene: what they count, find and write. No time is asserted.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "host_sim/lab/wcet/chrome_trace.hpp"
#include "host_sim/lab/wcet/flow_facts.hpp"
#include "host_sim/lab/wcet/scene_motion.hpp"
#include "host_sim/lab/wcet/wcet_report.hpp"
#include "tests/host_sim/wcet_scene.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

/// Counts only: no wake-ups, a search of few motions.
WcetPlan small_plan() {
  WcetPlan plan;
  plan.scene = "test";
  plan.motion = "smooth path";
  plan.most_same_state = 20;
  plan.exhaustive = false;
  plan.wakeup_seconds = 0;
  plan.adversarial.evaluations = 70;  // more than the patience of a climb
  return plan;
}

bool same_motion(const std::vector<MotionSample>& a, const std::vector<MotionSample>& b) {
  return std::ranges::equal(a, b, [](const MotionSample& x, const MotionSample& y) {
    return x.t_s == y.t_s && std::ranges::equal(x.p, y.p) && std::ranges::equal(x.q_wxyz, y.q_wxyz);
  });
}

const AdversarialFinding& found(const std::vector<AdversarialFinding>& list, AdversarialGoal goal) {
  return *std::ranges::find(list, goal, &AdversarialFinding::goal);
}

}  // namespace

TEST_SUITE("host_sim.wcet") {
  TEST_CASE("a report has warm and flushed times of the same ticks, apart from noise and work") {
    WcetScene s;
    const std::vector<MotionSample> motion = short_motion();
    const WcetReport report = measure_wcet(s.session, motion, small_plan());
    CHECK(report.passed());
    CHECK(report.same_state.ticks.size() >= 10);
    CHECK(report.same_state.warm.count == report.same_state.ticks.size());
    CHECK(report.same_state.flushed.count == report.same_state.ticks.size());
    CHECK(report.same_state.flushed_raw.count == 7 * report.same_state.ticks.size());
    CHECK(report.same_state.same_result);
    CHECK(report.same_state.ticks.front().tick == 0);
    CHECK(report.loop.raw.count == 7 * motion.size());
    CHECK(report.loop.exhaustive.count == 0);
    const auto json = nlohmann::json::parse(wcet_json(report));
    CHECK(json.at("wall_time_ns").contains("warm"));
    CHECK(json.at("wall_time_ns").contains("flushed"));
    CHECK(json.at("machine_noise_ns").contains("flushed_raw"));
    CHECK(json.at("adversarial").size() == goals_of(s.session.view()).size());
    CHECK_FALSE(json.at("instructions").at("measured").get<bool>());
    CHECK_FALSE(json.at("wall_time_ns").contains("instructions"));
    const std::string table = wcet_table(report, s.session.view(), motion);
    CHECK(table.find("its input, line") != std::string::npos);
    CHECK(table.find("instructions per tick: not measured: not asked for") != std::string::npos);
    CHECK(table.find("same state, warm") < table.find("same state, caches flushed"));
    CHECK(table.find("noise of this machine") != std::string::npos);
    CHECK(table.find("force_step") != std::string::npos);
  }

  TEST_CASE(
      "counters: the report's peaks are those of a run and of the search, bounds the header's") {
    WcetScene s;
    const std::vector<MotionSample> motion = short_motion();
    const WcetReport report = measure_wcet(s.session, motion, small_plan());
    s.session.core().reset();
    for (std::size_t i = 0; i < motion.size(); ++i)
      static_cast<void>(s.session.core().step(input_of(motion[i], i)));
    const StepCounters run = s.session.core().peaks();
    const SceneCapacity& capacity = s.session.view().header().capacity;
    const auto bound = [&](const char* name) {
      return *std::ranges::find_if(
          report.bounds, [&](const CounterBound& b) { return std::string(b.name) == name; });
    };
    CHECK(bound("edge_pairs").peak >= run.edge_pairs);
    CHECK(bound("feature_evaluations").peak >= run.feature_evaluations);
    CHECK(run.feature_evaluations > 0);
    CHECK(bound("feature_evaluations").bound == capacity.max_feature_evaluations);
    CHECK(bound("near_nodes").bound == capacity.max_near_nodes);
    StepCounters over = run;
    over.near_nodes = capacity.max_near_nodes;
    CHECK(all_held(counter_bounds(over, capacity)));
    over.near_nodes += 1;
    CHECK_FALSE(all_held(counter_bounds(over, capacity)));
    CHECK_FALSE(within_bounds(over, capacity));
  }

  TEST_CASE("adversarial search: same seed and evaluations, same findings; another seed, others") {
    WcetScene s;
    const std::vector<MotionSample> known = scene_motion(s.session, 0.5, 1);
    const AdversarialLimits limits{10, 100, 7};
    const auto first = adversarial_search(s.session, known, limits);
    const auto second = adversarial_search(s.session, known, limits);
    const auto other = adversarial_search(s.session, known, {10, 100, 8});
    bool differs = false;
    for (std::size_t k = 0; k < first.size(); ++k) {
      CHECK(first[k].evaluations == 100);
      CHECK(first[k].not_finite == 0);
      if (first[k].goal == AdversarialGoal::kTime) continue;  // the machine's clock has a say
      CAPTURE(to_text(first[k].goal));
      CHECK(first[k].value > 0);
      CHECK(first[k].value == second[k].value);
      CHECK(first[k].state_hash == second[k].state_hash);
      CHECK(same_motion(first[k].motion, second[k].motion));
      differs = differs || !same_motion(first[k].motion, other[k].motion);
    }
    CHECK(differs);
  }

  TEST_CASE("adversarial search: more motions never find less") {
    WcetScene s;
    const std::vector<MotionSample> known = scene_motion(s.session, 0.5, 1);
    const auto few = adversarial_search(s.session, known, {10, 5, 7});
    const auto many = adversarial_search(s.session, known, {10, 150, 7});
    for (std::size_t k = 0; k < few.size(); ++k) {
      if (few[k].goal != AdversarialGoal::kTime) CHECK(many[k].value >= few[k].value);
    }
    const auto step = AdversarialGoal::kForceStep;
    CHECK(found(many, step).value > found(few, step).value);
  }

  TEST_CASE("adversarial motions: the file gives the same states, and no hand is that fast") {
    WcetScene s;
    const ScratchFolder folder("wcet_motion");
    const std::vector<MotionSample> known = scene_motion(s.session, 0.5, 1);
    for (const AdversarialFinding& f : adversarial_search(s.session, known, {10, 70, 2})) {
      const std::string path = folder.file(motion_file_name(f, 2));
      write_motion_csv(path, f.motion);
      const std::vector<MotionSample> read = read_motion_csv(path);
      REQUIRE(read.size() == kMotionSegments * kSegmentTicks);
      s.session.core().reset();
      std::uint64_t hash = 0;
      for (std::size_t i = 0; i < read.size(); ++i)
        hash = s.session.core().step(input_of(read[i], i)).state_hash;
      CHECK(hash == f.state_hash);
      // The grip point of this scene is A's origin.
      const double period_s = 1 / s.session.view().parameters().rate_hz;
      for (std::size_t i = 1; i < read.size(); ++i) {
        const Vector step(read[i].p[0] - read[i - 1].p[0], read[i].p[1] - read[i - 1].p[1],
                          read[i].p[2] - read[i - 1].p[2]);
        CHECK(step.norm() <= kAdversarialSpeed_m_per_s * period_s + 1e-8);
      }
    }
  }

  TEST_CASE("a motion made from the scene touches it, and is the same for the same seed") {
    WcetScene s;
    const std::vector<MotionSample> motion = scene_motion(s.session, 1, 5);
    CHECK(motion.size() == 1001);
    CHECK(same_motion(motion, scene_motion(s.session, 1, 5)));
    CHECK_FALSE(same_motion(motion, scene_motion(s.session, 1, 6)));
    s.session.core().reset();
    std::size_t contact = 0;
    for (std::size_t i = 0; i < motion.size(); ++i)
      contact += s.session.core().step(input_of(motion[i], i, GoalContact::kAsked)).d_near_m <= 0;
    CHECK(contact > 10);
    // The scene starts in contact; the wander leaves the start pose all the same.
    const Vector gone(motion.back().p[0] - motion[0].p[0], motion.back().p[1] - motion[0].p[1],
                      motion.back().p[2] - motion[0].p[2]);
    CHECK(gone.norm() > 1e-4);
  }

  TEST_CASE("trace: parses, one bar per tick with its counts, in order") {
    WcetScene s;
    const std::vector<MotionSample> motion = short_motion();
    const WcetResult r = measure(s.session, motion, 2, false);
    const auto json = nlohmann::json::parse(chrome_trace(r.ticks, motion, "s\xff"));
    const auto& events = json.at("traceEvents");
    REQUIRE(events.size() == motion.size() + 2);
    CHECK(events[0].at("ph") == "M");
    for (std::size_t i = 0; i < motion.size(); ++i) {
      const auto& e = events[i + 2];
      CHECK(e.at("ph") == "X");
      CHECK(e.at("ts").get<double>() == 1e6 * motion[i].t_s);
      CHECK(e.at("dur").get<double>() == 1e-3 * r.ticks[i].core_ns);
      CHECK(e.at("args").at("tick") == i);
      CHECK(e.at("args").at("feature_evaluations") == r.ticks[i].counters.feature_evaluations);
      CHECK(e.at("args").at("work_units") == work_units(r.ticks[i].counters));
    }
    CHECK(events[2].at("args").at("flags").get<std::string>().find("first_tick") !=
          std::string::npos);
  }

  TEST_CASE("trace: every event has what the Trace Event Format asks of its phase") {
    WcetScene s;
    const std::vector<MotionSample> motion = short_motion();
    const WcetResult r = measure(s.session, motion, 2, false);
    const auto json = nlohmann::json::parse(chrome_trace(r.ticks, motion, "test"));
    REQUIRE(json.is_object());
    const auto unit = json.at("displayTimeUnit").get<std::string>();
    CHECK((unit == "ms" || unit == "ns"));
    const auto& events = json.at("traceEvents");
    REQUIRE(events.is_array());
    std::size_t names = 0, bars = 0;
    double last_us = -1;
    for (const auto& e : events) {
      CHECK(e.at("name").is_string());
      CHECK(e.at("pid").is_number_integer());
      CHECK(e.at("tid").is_number_integer());
      CHECK(e.at("args").is_object());
      const auto phase = e.at("ph").get<std::string>();
      if (phase == "M") {
        const auto name = e.at("name").get<std::string>();
        CHECK((name == "process_name" || name == "thread_name"));
        CHECK(e.at("args").at("name").is_string());
        CHECK(e.size() == 5);
        ++names;
        continue;
      }
      REQUIRE(phase == "X");
      CHECK(e.at("cat").is_string());
      const auto ts_us = e.at("ts").get<double>(), dur_us = e.at("dur").get<double>();
      CHECK(ts_us > last_us);  // bars of one thread in order, each of some length
      CHECK(dur_us > 0);
      CHECK(dur_us < 1e6);
      last_us = ts_us;
      CHECK(e.size() == 8);
      for (const auto& [key, value] : e.at("args").items()) {
        const std::string name = key;
        CAPTURE(name);
        CHECK((value.is_number() || value.is_string()));
      }
      ++bars;
    }
    CHECK(names == 2);
    CHECK(bars == motion.size());
  }

  TEST_CASE("flow facts name every capacity with the header's number") {
    WcetScene s;
    const SceneCapacity& c = s.session.view().header().capacity;
    const std::string text = flow_facts(s.session.view(), "a\nname");
    const auto has = [&](const char* name, std::uint64_t bound) {
      CAPTURE(name);
      CHECK(text.find("\n" + std::string(name) + "\t" + std::to_string(bound) + "\t") !=
            std::string::npos);
    };
    has("state_bytes", c.state_bytes);
    has("moving_lanes", c.moving_lanes);
    has("pair_count", c.pair_count);
    has("total_features", c.total_features);
    has("largest_pair_features", c.largest_pair_features);
    has("largest_near", c.largest_near);
    has("max_pair_visits", c.max_pair_visits);
    has("max_support_pairs", c.max_support_pairs);
    has("max_feature_evaluations", c.max_feature_evaluations);
    has("max_edge_pairs", c.max_edge_pairs);
    has("max_near_nodes", c.max_near_nodes);
    has("max_hull_points", c.max_hull_points);
    has("max_plane_gaps", c.max_work_units);
    has("max_valid_nodes", c.max_work_units);
    has("max_full_searches", c.max_full_searches);
    has("max_search_work", c.max_work_units);
    has("max_proxy_passes", c.max_proxy_passes);
    has("max_proxy_rejected", c.max_proxy_rejected);
    has("max_proxy_rounds", c.max_proxy_rounds);
    has("max_qp_rows", c.max_qp_rows);
    has("max_qp_iterations", c.max_qp_iterations);
    has("max_qp_programs", c.max_qp_programs);
    has("max_qp_steps", c.max_qp_steps);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      CHECK((line.starts_with("#") || std::ranges::count(line, '\t') == 2));
  }

  TEST_CASE("program: a whole quick run writes its files; a damaged bound is exit 1") {
    const WcetScene s;
    const ScratchFolder folder("wcet");
    const std::string scene = folder.file("s.rtscene"), out = folder.file("out");
    std::ofstream(scene, std::ios::binary)
        .write(reinterpret_cast<const char*>(s.bytes.data()),
               static_cast<std::streamsize>(s.bytes.size()));
    const std::string common =
        "wcet --no-instructions --scene '" + scene + "' --quick --evaluations 5";
    const ProgramResult good =
        run_program(HAPTIC_HOST_SIM, common + " --seed 4 --out '" + out + "' --flow-facts '" +
                                         folder.file("facts.tsv") + "'");
    CHECK(good.exit_code == 0);
    CHECK(good.out.find("every bound holds") != std::string::npos);
    for (const char* name :
         {"wcet.csv", "wcet.json", "wcet.svg", "trace.json", "wakeups.txt",
          "adversarial_work_seed4.csv", "adversarial_time_seed4.csv",
          "adversarial_force_step_seed4.csv", "adversarial_torque_step_seed4.csv",
          "adversarial_situation_changes_seed4.csv"}) {
      CAPTURE(name);
      CHECK(std::filesystem::file_size(out + "/" + name) > 100);
    }
    CHECK(nlohmann::json::parse(text_of_file(out + "/trace.json")).contains("traceEvents"));
    CHECK(text_of_file(out + "/wcet.svg").ends_with("</svg>\n"));
    CHECK(text_of_file(folder.file("facts.tsv")).find("\nmax_near_nodes\t") != std::string::npos);
    const ProgramResult replayed =
        run_program(HAPTIC_HOST_SIM, "replay --check --scene '" + scene + "' --motion '" + out +
                                         "/adversarial_force_step_seed4.csv'");
    CHECK(replayed.exit_code == 0);

    const ProgramResult damaged =
        run_program(HAPTIC_HOST_SIM, common + " --fault feature_evaluations");
    CHECK(damaged.exit_code == 1);
    CHECK(damaged.out.find("OVER ITS BOUND") != std::string::npos);
    CHECK(run_program(HAPTIC_HOST_SIM, common + " --fault luck").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, common + " --seconds 1").exit_code == 2);
  }
}
