// SPDX-License-Identifier: Apache-2.0
// What the worst-case report knows exactly: counted work and its bounds, instructions, stack.
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include "host_sim/lab/wcet/core_stack.hpp"
#include "host_sim/lab/wcet/flow_facts.hpp"
#include "host_sim/lab/wcet/instruction_counts.hpp"
#include "host_sim/session/counters_check.hpp"
#include "rt_core/scene/capacity.hpp"
#include "tests/host_sim/wcet_scene.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

TEST_SUITE("host_sim.wcet_counts") {
  TEST_CASE("work of the proxy is counted apart from the search's, with a bound of its own") {
    StepCounters c;
    c.work_units = 54321;
    CHECK(proxy_units(c) == 54321);
    CHECK(work_units(c) == 0);
    WcetScene s;
    SceneCapacity capacity = s.session.view().header().capacity;
    CHECK(proxy_bound(capacity) == 0);  // another law
    capacity.max_work_units = 54320;
    CHECK(proxy_bound(capacity) == 54320);
    CHECK_FALSE(within_bounds(c, capacity));
    capacity.max_work_units = 54321;
    CHECK(within_bounds(c, capacity));
    c.proxy_rejected = capacity.max_proxy_rejected + 1;
    CHECK_FALSE(within_bounds(c, capacity));
    c.proxy_rejected = 0;
    c.qp_iterations = capacity.max_qp_iterations + 1;
    CHECK_FALSE(within_bounds(c, capacity));
    for (const char* name : {"proxy_passes", "proxy_rejected", "proxy_rounds", "qp_rows",
                             "qp_iterations", "qp_programs", "qp_steps", "search_work"}) {
      CAPTURE(name);
      CHECK(std::ranges::count_if(counter_bounds(c, capacity), [&](const CounterBound& b) {
              return std::string(b.name) == name;
            }) == 1);
      CHECK_NOTHROW(static_cast<void>(damaged_bounds(capacity, name)));
    }
  }

  TEST_CASE("quadratic programs: bounds are the caps of the loops, none without passes") {
    constexpr ProgramBounds none = program_bounds(5, 0, true);
    static_assert(none.rounds == 0 && none.steps == 0);
    constexpr ProgramBounds few = program_bounds(5, 3, false);
    CHECK(few.rounds == kProxyRounds + kProxyRetries * kProxyRetryRounds);
    CHECK(few.rows == kMaxProxyRows);
    CHECK(few.programs == 3 * (few.rounds + kMaxBoundPrograms + 2 * kMaxCorrections));
    CHECK(few.steps == few.programs * kMaxQpIterations);
    CHECK(program_bounds(5, 3, true).rows == kMaxFrictionRows);
    CHECK(program_bounds(5, 3, true).programs ==
          few.programs +
              3 * (kMaxConePrograms + kMaxShiftPrograms + few.rounds + kMaxBoundPrograms));
    CHECK(program_bounds(120, 3, false).rows == 120);  // a correction has a row for each pair
    CHECK(program_bounds(625, 3, false).rows == kMaxFrictionRows);
  }

  TEST_CASE("a profile: ticks, functions, and the most expensive tick; what prepares is left out") {
    const std::string part_of_callers =
        "fn=(1) main\ncfn=(2) haptic::HapticCore::step(haptic::StepInput const&)\ncalls=1 0 \n";
    const auto tick = [&](int own, int below) {
      const std::string sum = std::to_string(own + below);
      return "part: 1\ndesc: Trigger: --dump-after=haptic::HapticCore::step\nsummary: " + sum +
             "\n" + part_of_callers + "0 " + sum + "\n\nfn=(2)\n0 " + std::to_string(own - 1) +
             "\ncfn=(3) haptic::(anonymous namespace)::rise(int, f(*)()) [clone .cold]\n"
             "calls=2 0 \n0 " +
             std::to_string(below) + "\n0 1\n\nfn=(3)\n+3 " + std::to_string(below) +
             "\n\ntotals: " + sum + "\n";
    };
    const std::string before =
        "part: 1\ndesc: Trigger: --dump-before=haptic::sim::run_once\ntotals: 0\n";
    const std::string end = "part: 9\ndesc: Trigger: Program termination\ntotals: 0\n";
    std::istringstream text(tick(500, 500) + before + tick(10, 5) + tick(20, 30) + tick(10, 5) +
                            end);
    const CallgrindProfile p = read_callgrind(text, "profile");
    CHECK(p.per_tick == std::vector<std::uint64_t>{15, 50, 15});
    CHECK(p.dearest_tick == 1);
    CHECK(p.total == 80);
    REQUIRE(p.whole.size() == 2);  // main does nothing itself
    REQUIRE(p.dearest.size() == 2);
    CHECK(p.dearest[0].name == "haptic::rise [part]");
    CHECK(p.dearest[0].self == 30);
    CHECK(p.dearest[1].name == "haptic::HapticCore::step");
    CHECK(p.dearest[1].self == 20);
    CHECK(p.dearest[1].inclusive == 50);
    CHECK(p.whole[0].name == "haptic::HapticCore::step");  // as many of its own: by name
    CHECK(p.whole[0].self == 40);
    CHECK(p.whole[0].inclusive == 80);
    CHECK(p.whole[1].self == 40);
    CHECK(p.whole[1].inclusive == 40);

    std::string wrong = tick(10, 5);
    wrong.replace(wrong.find("totals: 15"), 10, "totals: 16");
    std::istringstream damaged(wrong), empty(end);
    CHECK_THROWS_AS(static_cast<void>(read_callgrind(damaged, "p")), tools::InputError);
    CHECK_THROWS_AS(static_cast<void>(read_callgrind(empty, "p")), tools::InputError);
  }

  TEST_CASE("stack: the figures are the sums of their chains, within what the build allows") {
    const CoreStack& stack = core_stack();
    const std::string text = stack_text(stack);
    if (!stack.measured) {
      CHECK(std::string(stack.why_not).size() > 5);
      CHECK(text.find("not measured: ") != std::string::npos);
      return;
    }
    std::uint32_t sum = 0;
    for (const StackFrame& frame : stack.tick.chain) {
      sum += frame.bytes;
      CHECK(std::string(frame.function).starts_with("haptic::"));
    }
    CHECK(stack.tick.bytes == sum);
    CHECK(stack.tick.bytes > 200);
    CHECK(stack.tick.bytes <= stack.core.bytes);
    CHECK(stack.core.bytes <= stack.limit_bytes);
    CHECK(std::string(stack.tick.chain.front().function) == "haptic::HapticCore::step");
    CHECK(text.find(std::to_string(stack.tick.bytes)) != std::string::npos);
    WcetScene s;
    CHECK(flow_facts(s.session.view(), "x")
              .find("\nstack_bytes_tick\t" + std::to_string(sum) + "\t") != std::string::npos);
  }

  TEST_CASE("program: instructions of every tick, the same numbers twice, or why there are none") {
    const WcetScene s;
    const ScratchFolder folder("wcet_instructions");
    const std::string scene = folder.file("s.rtscene"), csv = folder.file("m.csv");
    std::ofstream(scene, std::ios::binary)
        .write(reinterpret_cast<const char*>(s.bytes.data()),
               static_cast<std::streamsize>(s.bytes.size()));
    write_motion_csv(csv, short_motion());
    const std::vector<MotionSample> motion = read_motion_csv(csv);
    InstructionQuestion question;
    question.program = HAPTIC_HOST_LAB;
    question.arguments = {"wcet", "--once", "--scene", scene, "--motion", csv};
    WcetScene again;
    question.state_hash = run_once(again.session, motion);
    question.ticks = motion.size();
    const InstructionCounts first = count_instructions(question);
    if (!first.measured) {
      MESSAGE("not measured: ", first.why_not);
      CHECK(first.why_not.find("valgrind") != std::string::npos);
      CHECK(instruction_table(first).find("not measured: ") != std::string::npos);
      return;
    }
    REQUIRE(first.profile.per_tick.size() == motion.size());
    CHECK(first.median > 500);
    CHECK(first.largest >= first.median);
    CHECK(first.largest == first.profile.per_tick[first.profile.dearest_tick]);
    const InstructionCounts second = count_instructions(question);
    CHECK(second.profile.per_tick == first.profile.per_tick);
    std::uint64_t sum = 0;
    for (const FunctionCost& f : first.profile.whole) sum += f.self;
    CHECK(sum == first.profile.total);
    const auto step =
        std::ranges::find(first.profile.dearest, "haptic::HapticCore::step", &FunctionCost::name);
    REQUIRE(step != first.profile.dearest.end());
    CHECK(step->inclusive == first.largest);
    CHECK(instruction_table(first).starts_with("instructions per tick, exact, of 60 ticks: "));

    question.state_hash ^= 1;  // another motion than was asked for
    const InstructionCounts other = count_instructions(question);
    CHECK_FALSE(other.measured);
    CHECK(other.why_not.find("valgrind ended in") != std::string::npos);
  }
}
