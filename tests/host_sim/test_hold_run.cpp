// SPDX-License-Identifier: Apache-2.0
// Seven parts put together by one simulated hand, as a script says.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/hold_run.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

const std::filesystem::path kFolder = std::filesystem::path(HAPTIC_SCENES_DIR) / "seven_parts";

std::vector<std::byte> seven_parts() {
  return tools::compile_scene(tools::read_scene_file(kFolder / "scene.toml"), {}).bytes;
}

struct Run {
  std::vector<LoopRecord> records;
  std::vector<HoldEvent> events;
  std::string failures;
};

Run run(CoreSession& session, const MotionScript& script) {
  ClosedLoop loop(session, {}, *hand_named("firm"), script.rate_hz);
  HoldRun holds(session, script.holds);
  Run result;
  result.records = run_loop(
      loop, make_motion(script), [&](const LoopRecord& record) { holds.after_tick(record.tick); },
      [&](double t_s) { holds.before_tick(t_s); });
  result.events = holds.events();
  result.failures = holds.failures();
  return result;
}

std::string refusal(CoreSession& session, const std::vector<HoldCommand>& commands) {
  try {
    const HoldRun holds(session, commands);
    return "";
  } catch (const tools::InputError& error) {
    return error.what();
  }
}

}  // namespace

TEST_SUITE("host_sim.hold_run") {
  TEST_CASE("seven parts are put together by one hand, and stay where they were let go") {
    CoreSession session(seven_parts(), "seven parts");
    const Run result = run(session, read_motion_script(kFolder / "motion.toml"));
    CHECK(result.failures == "");
    REQUIRE(result.events.size() == 13);  // the first part is held from the start
    for (const HoldEvent& event : result.events) {
      CAPTURE(event.part);
      CAPTURE(event.taken);
      CHECK(event.moved_m <= 10e-6);
      // Taken with no force; let go by a ramp of 50 ms.
      CHECK(event.force_step_n <= (event.taken ? 0.05 : 0.05 + event.force_n / 40));
      if (!event.taken) CHECK(event.force_n > 0.1);
    }
    // Where they stand in the end, at what they rest on.
    const double heights_m[] = {0.020, 0.023, 0.0275, 0.010, 0.010, 0.010, 0.010};
    const PartScenes& parts = *session.parts();
    for (std::uint32_t k = 0; k < 7; ++k) {
      CAPTURE(std::string(parts.name(k)));
      const PartPlace& place = session.hand()->places()[k];
      CHECK(place.p_wa_m[2] == doctest::Approx(heights_m[k]).epsilon(2e-3));
    }
    const LoopTotals totals = total(result.records);
    CHECK(totals.finite);
    CHECK_FALSE(totals.runs_away());
    CHECK(totals.smallest_gap_m > (HAPTIC_REAL_IS_FLOAT ? -2e-6 : -1e-6));
  }

  TEST_CASE("a run is the same to the bit when it is made again") {
    CoreSession session(seven_parts(), "seven parts");
    MotionScript script = read_motion_script(kFolder / "motion.toml");
    script.waypoints.resize(9);
    script.holds.resize(2);
    const Run first = run(session, script), second = run(session, script);
    CHECK(first.records.back().tick.state_hash == second.records.back().tick.state_hash);
    CHECK(first.records.back().tick.state_hash != first.records[900].tick.state_hash);
  }

  TEST_CASE("what a script cannot ask for is refused, and what it does not come to is told") {
    CoreSession session(seven_parts(), "seven parts");
    CHECK(haptic::test::has(refusal(session, {{0.1, "rung"}}), "hold = \"rung\": no such part"));
    CHECK(haptic::test::has(refusal(session, {{0.1, "table"}}),
                            "those are: peg, ring, cover, pin_1"));
    MotionScript script;
    script.waypoints.resize(2);
    script.waypoints[0].p[2] = script.waypoints[1].p[2] = 0.06;
    script.waypoints[1].t_s = 0.5;
    script.holds = {{0.49, "ring"}, {0.5, "cover"}};  // in the last tick
    CHECK(haptic::test::has(run(session, script).failures,
                            "the script ends before what it asks for"));
    tools::SceneFile one = tools::read_scene_file(kFolder / ".." / "round_peg" / "scene.toml");
    CoreSession alone(tools::compile_scene(one, {}).bytes, "one part");
    CHECK(haptic::test::has(refusal(alone, {{0.1, "peg"}}), "compile it with [[part]]"));
    CHECK(refusal(alone, {}) == "");
  }
}
