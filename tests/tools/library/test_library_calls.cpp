// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/library/block_on_plate.hpp"

using namespace haptic::test;

namespace {

haptic_step_input input_at(double z_m, double time_s) {
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  input.pose[2] = z_m;
  input.time_s = time_s;
  return input;
}

/// Signals that each thread of this process blocks, by /proc: a bit for each, the first of
/// number 1.
std::vector<std::uint64_t> blocked_by_threads() {
  std::vector<std::uint64_t> blocked;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream status(task.path() / "status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigBlk:")) blocked.push_back(std::stoull(line.substr(7), nullptr, 16));
  }
  return blocked;
}

/// A session that ends with its test.
struct SessionBench {
  explicit SessionBench(haptic_hold hold = HAPTIC_HOLD_AGAIN) {
    haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
    options.hold = hold;
    REQUIRE(haptic_session_open(block_scene().data(), block_scene().size(), &options, &session) ==
            HAPTIC_OK);
  }
  ~SessionBench() { (void)haptic_session_free(&session); }
  SessionBench(const SessionBench&) = delete;
  SessionBench& operator=(const SessionBench&) = delete;

  haptic_state state() const {
    haptic_state now = HAPTIC_STATE_INIT;
    REQUIRE(haptic_session_state(session, &now) == HAPTIC_OK);
    return now;
  }
  /// The first state that `wanted` is true of; there is none within a minute: the test fails.
  template <class Wanted>
  haptic_state wait_for(const Wanted& wanted) const {
    haptic_state now = state();
    for (int k = 0; k < 60'000 && !wanted(now); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      now = state();
    }
    REQUIRE(wanted(now));
    return now;
  }
  std::uint64_t go_to(double z_m, double seconds) {
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    goal.pose[2] = z_m;
    goal.seconds = seconds;
    std::uint64_t number = 0;
    REQUIRE(haptic_session_move_hand(session, &goal, &number) == HAPTIC_OK);
    return number;
  }

  haptic_session* session = nullptr;
};

}  // namespace

TEST_SUITE("tools.library") {
  TEST_CASE("errors: each has a name and a text, and so has a number that is none") {
    for (int k = 0; k < HAPTIC_ERROR_COUNT; ++k) {
      CHECK(std::string(haptic_error_name(k)).starts_with("HAPTIC_"));
      CHECK(std::strlen(haptic_error_text(k)) > 3);
    }
    CHECK(std::string(haptic_error_name(HAPTIC_ERROR_LIMIT)) == "HAPTIC_ERROR_LIMIT");
    for (const int none : {-1, int{HAPTIC_ERROR_COUNT}, 1 << 30})
      CHECK(std::string(haptic_error_name(none)) == "HAPTIC_ERROR_UNKNOWN");
  }

  TEST_CASE("core: the spring presses; a replay gives the bits of single steps") {
    const CoreBench bench;
    haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
    std::vector<double> poses, wrenches(6 * 300), times;
    std::vector<std::uint64_t> hashes(300), stepped;
    for (int k = 0; k < 300; ++k) {
      const haptic_step_input input = input_at(0.020 - 1e-4 * k, 0.001 * k);
      poses.insert(poses.end(), input.pose, input.pose + 7);
      times.push_back(input.time_s);
      REQUIRE(haptic_core_step(bench.core(), &input, &output) == HAPTIC_OK);
      stepped.push_back(output.state_hash);
    }
    CHECK(output.wrench[2] == doctest::Approx(500 * 0.0249).epsilon(0.01));
    CHECK(output.felt_pose[2] == doctest::Approx(0.015).epsilon(1e-4));
    CHECK(output.situation == 5);  // face on face
    REQUIRE(haptic_core_reset(bench.core()) == HAPTIC_OK);
    haptic_replay replay = HAPTIC_REPLAY_INIT;
    replay.count = 300;
    replay.poses = poses.data();
    replay.times_s = times.data();
    replay.wrenches = wrenches.data();
    replay.state_hashes = hashes.data();
    REQUIRE(haptic_core_replay(bench.core(), &replay) == HAPTIC_OK);
    CHECK(hashes == stepped);
    CHECK(wrenches[6 * 299 + 2] == output.wrench[2]);
    // A pose that is refused: its index, and the ticks before it are done.
    poses[7 * 150 + 3] = std::nan("");
    REQUIRE(haptic_core_reset(bench.core()) == HAPTIC_OK);
    CHECK(haptic_core_replay(bench.core(), &replay) == HAPTIC_ERROR_POSE);
    CHECK(replay.done == 150);
  }

  TEST_CASE("core: the verdict of all ticks, its line, and of a refused pose") {
    const CoreBench bench;
    haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
    haptic_verdict verdict = HAPTIC_VERDICT_INIT;
    REQUIRE(haptic_core_verdict(bench.core(), &verdict) == HAPTIC_OK);
    CHECK(verdict.verdict == HAPTIC_VERDICT_NO_TICKS);
    for (int k = 0; k < 300; ++k) {
      const haptic_step_input input = input_at(0.020 - 1e-4 * k, 0.001 * k);
      REQUIRE(haptic_core_step(bench.core(), &input, &output) == HAPTIC_OK);
    }
    REQUIRE(haptic_core_verdict(bench.core(), &verdict) == HAPTIC_OK);
    CHECK(verdict.verdict == HAPTIC_VERDICT_FOLLOWED);
    CHECK(verdict.failures == 0);
    CHECK(verdict.ticks == 300);
    CHECK(verdict.followed_ticks == 300);
    CHECK(verdict.contact_ticks > 240);
    CHECK(verdict.contact_ticks < 252);
    CHECK(std::isnan(verdict.given_out_j));
    CHECK(std::string(verdict.text) == "followed the hand in all 300 ticks");
    haptic_step_input none = input_at(std::nan(""), 0.3);
    CHECK(haptic_core_step(bench.core(), &none, &output) == HAPTIC_ERROR_POSE);
    REQUIRE(haptic_core_verdict(bench.core(), &verdict) == HAPTIC_OK);
    CHECK(verdict.refused_ticks == 1);
    CHECK(std::string(verdict.text).find("1 tick with a pose that cannot be used") !=
          std::string::npos);
    REQUIRE(haptic_core_reset(bench.core()) == HAPTIC_OK);
    REQUIRE(haptic_core_verdict(bench.core(), &verdict) == HAPTIC_OK);
    CHECK(verdict.ticks == 0);
  }

  TEST_CASE("compile: what is wrong with a mesh is said with part, place and remedy") {
    BlockOnPlate scene;
    scene.block.triangles[4] = 99;
    haptic_compiled* handle = nullptr;
    CHECK(haptic_compile(&scene.input, &handle) == HAPTIC_ERROR_INPUT);
    const CompiledHandle compiled(handle);
    std::size_t count = 0;
    REQUIRE(haptic_compiled_message_count(handle, &count) == HAPTIC_OK);
    REQUIRE(count == 1);
    haptic_message message = HAPTIC_MESSAGE_INIT;
    REQUIRE(haptic_compiled_message(handle, 0, &message) == HAPTIC_OK);
    CHECK(message.severity == HAPTIC_SEVERE);
    CHECK(std::string(message.file) == "moving");
    CHECK(std::string(message.place) == "2");
    CHECK(std::string(message.cause) == "names vertex 99 of 8");
    CHECK(std::string(message.remedy) == "vertices are counted from 0");
    const void* bytes = nullptr;
    CHECK(haptic_compiled_bytes(handle, &bytes, &count) == HAPTIC_ERROR_SIZE);
  }

  TEST_CASE(
      "compile: an open mesh is a surface, no mesh at all is refused; arrays and files agree") {
    BlockOnPlate open;
    open.moving.triangle_count = 11;
    haptic_compiled* handle = nullptr;
    CHECK(haptic_compile(&open.input, &handle) == HAPTIC_OK);
    (void)haptic_compiled_free(&handle);
    open.moving.triangle_count = 0;
    CHECK(haptic_compile(&open.input, &handle) != HAPTIC_OK);
    (void)haptic_compiled_free(&handle);
    haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
    REQUIRE(haptic_scene_read(block_scene().data(), block_scene().size(), &info) == HAPTIC_OK);
    CHECK(std::string(info.name) == "block on plate");
    CHECK(info.parts == 2);
    CHECK(info.pairs == 1);
    CHECK(info.stiffness_n_per_m == 500);
    CHECK(info.rate_hz == 1000);
    CHECK(info.start_pose[2] == 0.035);
  }

  TEST_CASE("plan: round the plate to its underside; the same input gives the same bytes") {
    haptic_plan_input input = HAPTIC_PLAN_INPUT_INIT;
    input.goal_pose[2] = -0.035;
    input.shorten_work = 1'000'000;
    std::string first;
    for (int run = 0; run < 2; ++run) {
      haptic_planned* planned = nullptr;
      REQUIRE(haptic_plan(block_scene().data(), block_scene().size(), &input, &planned) ==
              HAPTIC_OK);
      const void* bytes = nullptr;
      const double* poses = nullptr;
      std::size_t count = 0;
      haptic_plan_facts facts = HAPTIC_PLAN_FACTS_INIT;
      REQUIRE(haptic_planned_bytes(planned, &bytes, &count) == HAPTIC_OK);
      const std::string file(static_cast<const char*>(bytes), count);
      CHECK(file.starts_with("haptic-plan "));
      if (run == 0) first = file;
      CHECK(file == first);
      REQUIRE(haptic_planned_facts(planned, &facts) == HAPTIC_OK);
      REQUIRE(haptic_planned_poses(planned, &poses, &count) == HAPTIC_OK);
      CHECK(count == facts.steps + 1);
      CHECK(poses[2] == doctest::Approx(0.035));
      CHECK(poses[7 * (count - 1) + 2] == doctest::Approx(-0.035));
      // Past an edge of the plate, so farther than straight through it.
      double widest = 0;
      for (std::size_t k = 0; k < count; ++k)
        widest = std::max({widest, std::abs(poses[7 * k]), std::abs(poses[7 * k + 1])});
      CHECK(widest > 0.05);
      CHECK(facts.length_m > 0.14);
      CHECK(haptic_planned_free(&planned) == HAPTIC_OK);
    }
  }
  TEST_CASE("plan: without time there is none, and the text says what helps") {
    haptic_plan_input input = HAPTIC_PLAN_INPUT_INIT;
    input.goal_pose[2] = -0.035;
    input.seconds = 0.001;
    haptic_planned* planned = nullptr;
    REQUIRE(haptic_plan(block_scene().data(), block_scene().size(), &input, &planned) ==
            HAPTIC_ERROR_NO_PLAN);
    haptic_plan_facts facts = HAPTIC_PLAN_FACTS_INIT;
    REQUIRE(haptic_planned_facts(planned, &facts) == HAPTIC_OK);
    CHECK(std::string(facts.text).find("give more seconds or another goal") != std::string::npos);
    CHECK(facts.nearest_m > 0);
    CHECK(haptic_planned_free(&planned) == HAPTIC_OK);
  }
  TEST_CASE("session: the hand presses the block onto the plate; a stop takes the force away") {
    SessionBench bench;
    const haptic_state ready = bench.wait_for([](const haptic_state& s) { return s.arming == 2; });
    CHECK(ready.link == 2);
    CHECK(ready.armings >= 1);
    CHECK(ready.hand_pose[2] == doctest::Approx(0.035).epsilon(1e-3));
    const std::uint64_t down = bench.go_to(0.005, 0.3);
    bench.wait_for([&](const haptic_state& s) { return s.goals_reached >= down; });
    // At rest: hand of 300 N/m and spring of 500 N/m, 10 mm apart.
    const haptic_state pressed = bench.wait_for(
        [](const haptic_state& s) { return std::abs(s.sent_wrench[2] - 1.875) < 0.02; });
    CHECK(pressed.felt_pose[2] == doctest::Approx(0.015).epsilon(1e-3));
    CHECK(pressed.gap_m > -1e-6);

    REQUIRE(haptic_session_stop(bench.session) == HAPTIC_OK);
    const haptic_state stopped =
        bench.wait_for([](const haptic_state& s) { return s.arming == 4; });
    CHECK((stopped.safety_faults & (1u << 6)) != 0);  // kFaultEmergencyStop
    CHECK(stopped.sent_wrench[2] == 0);
    // The hand does not press again by itself.
    const haptic_state later =
        bench.wait_for([&](const haptic_state& s) { return s.time_s > stopped.time_s + 0.3; });
    CHECK(later.armings == stopped.armings);
    CHECK(later.arming == 4);
    // Released and pressed again: the force is back.
    REQUIRE(haptic_session_hold(bench.session, HAPTIC_RELEASE) == HAPTIC_OK);
    bench.wait_for([](const haptic_state& s) { return s.hand_held == 0; });
    REQUIRE(haptic_session_hold(bench.session, HAPTIC_HOLD_AGAIN) == HAPTIC_OK);
    bench.wait_for([](const haptic_state& s) { return s.arming == 2 && s.sent_wrench[2] > 1; });
    REQUIRE(haptic_session_close(bench.session) == HAPTIC_OK);
    CHECK(bench.state().tick > 0);
  }

  TEST_CASE("session: the verdict goes on with the ticks, and stays after the end") {
    SessionBench bench;
    const std::uint64_t goal = bench.go_to(0.010, 0.3);
    (void)bench.wait_for([&](const haptic_state& s) { return s.goals_reached >= goal; });
    haptic_verdict verdict = HAPTIC_VERDICT_INIT, end = HAPTIC_VERDICT_INIT;
    REQUIRE(haptic_session_verdict(bench.session, &verdict) == HAPTIC_OK);
    CHECK(verdict.ticks > 0);
    CHECK(verdict.contact_ticks > 0);
    CHECK(std::string(verdict.text).starts_with("followed the hand in "));
    REQUIRE(haptic_session_close(bench.session) == HAPTIC_OK);
    REQUIRE(haptic_session_verdict(bench.session, &end) == HAPTIC_OK);
    CHECK(end.ticks >= verdict.ticks);
    CHECK(end.failures == 0);
    CHECK(haptic_session_verdict(nullptr, &end) == HAPTIC_ERROR_NULL);
    CHECK(haptic_session_verdict(bench.session, nullptr) == HAPTIC_ERROR_NULL);
  }

  TEST_CASE("session: a stop right after the begin holds, however late the first press is") {
    SessionBench bench;
    REQUIRE(haptic_session_stop(bench.session) == HAPTIC_OK);
    const haptic_state begin = bench.state();
    const haptic_state later =
        bench.wait_for([&](const haptic_state& s) { return s.time_s > begin.time_s + 0.3; });
    CHECK(later.arming == 4);
    CHECK(later.sent_wrench[2] == 0);
  }

  TEST_CASE("session: without the deadman nothing is sent; the history has every tick") {
    SessionBench bench(HAPTIC_RELEASE);
    const std::uint64_t down = bench.go_to(0.005, 0.2);
    const haptic_state there =
        bench.wait_for([&](const haptic_state& s) { return s.goals_reached >= down; });
    CHECK(there.armings == 0);
    CHECK(there.wrench[2] > 0.1);
    CHECK(there.sent_wrench[2] == 0);
    REQUIRE(haptic_session_close(bench.session) == HAPTIC_OK);
    std::vector<haptic_tick> ticks(20'000);
    std::size_t count = 0;
    REQUIRE(haptic_session_history(bench.session, ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    REQUIRE(count > 100);
    CHECK(ticks[count - 1].tick == bench.state().tick);
    for (std::size_t k = 1; k < count; ++k) CHECK(ticks[k].tick == ticks[k - 1].tick + 1);
    CHECK(ticks[0].hand_pose[2] == doctest::Approx(0.035).epsilon(1e-3));
  }

  TEST_CASE(
      "session: the plate moves; its owner is blocked for a second: the force ramps to zero") {
    constexpr std::uint32_t kFaultFrame = 1u << 13;
    SessionBench bench;
    const std::uint64_t down = bench.go_to(0.005, 0.3);
    bench.wait_for([&](const haptic_state& s) {
      return s.goals_reached >= down && s.arming == 2 && s.sent_wrench[2] > 1.5;
    });
    // A pose every 10 ms, until `wanted`: the plate goes up and down by a millimetre.
    haptic_frame frame = HAPTIC_FRAME_INIT;
    frame.fastest_m_per_s = 0.05;
    frame.late_s = 0.2;
    int poses = 0;
    const auto move_until = [&](const auto& wanted) {
      haptic_state now = bench.state();
      for (int k = 0; k < 6000 && !wanted(now); ++k) {
        frame.pose[2] = 0.001 * std::sin(0.1 * poses++);
        REQUIRE(haptic_session_frame(bench.session, &frame) == HAPTIC_OK);
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        now = bench.state();
      }
      REQUIRE(wanted(now));
      return now;
    };
    double lowest_m = 1, highest_m = 0;
    move_until([&](const haptic_state& s) {
      lowest_m = std::min(lowest_m, s.felt_pose[2]);
      highest_m = std::max(highest_m, s.felt_pose[2]);
      return poses > 100 && s.arming == 2 && s.sent_wrench[2] > 1;
    });
    CHECK(lowest_m < 0.0143);  // the block lies on the plate, 15 mm high in its middle
    CHECK(highest_m > 0.0157);
    // Blocked: no pose for a second of the session's time.
    const haptic_state before = bench.state();
    const haptic_state late = bench.wait_for([](const haptic_state& s) {
      return (s.safety_faults & kFaultFrame) != 0 && s.sent_wrench[2] == 0;
    });
    const haptic_state still =
        bench.wait_for([&](const haptic_state& s) { return s.time_s > before.time_s + 1.0; });
    CHECK(still.sent_wrench[2] == 0);
    CHECK(still.armings == late.armings);
    // Poses again: the hand presses the switch again, and the force is back.
    move_until([&](const haptic_state& s) {
      return s.armings > still.armings && s.arming == 2 && s.sent_wrench[2] > 1;
    });
    REQUIRE(haptic_session_close(bench.session) == HAPTIC_OK);
    // The profile of all of it: no step over the device's slew limit, and none of the old force.
    std::vector<haptic_tick> ticks(20'000);
    std::size_t count = 0;
    REQUIRE(haptic_session_history(bench.session, ticks.data(), ticks.size(), sizeof ticks[0],
                                   &count) == HAPTIC_OK);
    constexpr double kSlew_n_per_s = 2000, kLongestStep_s = 0.002;
    double largest_over_n = -1;
    std::size_t silent = 0;
    for (std::size_t k = 1; k < count; ++k) {
      const double passed_s = ticks[k].time_s - ticks[k - 1].time_s;
      const double step_n = std::abs(ticks[k].sent_wrench[2] - ticks[k - 1].sent_wrench[2]);
      largest_over_n =
          std::max(largest_over_n, step_n - kSlew_n_per_s * std::min(passed_s, kLongestStep_s));
      if (ticks[k].time_s <= late.time_s || ticks[k].time_s > still.time_s) continue;
      silent += 1;
      CHECK(ticks[k].sent_wrench[2] == 0);
    }
    CHECK(largest_over_n < 1e-9);
    CHECK(silent > 10);
  }

  TEST_CASE("session: a plate that jumps takes the force away, and so does a pose that is none") {
    SessionBench bench;
    const std::uint64_t down = bench.go_to(0.005, 0.3);
    const auto pressed = [&](const haptic_state& s) {
      return s.goals_reached >= down && s.arming == 2 && s.sent_wrench[2] > 1.5;
    };
    const haptic_state first = bench.wait_for(pressed);
    haptic_frame frame = HAPTIC_FRAME_INIT;
    frame.stands = 1;
    frame.pose[2] = 0.003;  // at once, as a first pose: nobody has moved it there
    REQUIRE(haptic_session_frame(bench.session, &frame) == HAPTIC_OK);
    // Let go of by that, the hand presses again: against the plate where it is now.
    const haptic_state lifted = bench.wait_for([&](const haptic_state& s) {
      return s.armings > first.armings && pressed(s) && s.felt_pose[2] > 0.0179;
    });
    CHECK(lifted.felt_pose[2] == doctest::Approx(0.018).epsilon(1e-3));
    frame.pose[0] = std::nan("");
    CHECK(haptic_session_frame(bench.session, &frame) == HAPTIC_ERROR_POSE);
    bench.wait_for([](const haptic_state& s) {
      return (s.safety_faults & (1u << 13)) != 0 && s.sent_wrench[2] == 0;
    });
    frame.pose[0] = 0;
    REQUIRE(haptic_session_frame(bench.session, &frame) == HAPTIC_OK);
    bench.wait_for([&](const haptic_state& s) { return s.armings > lifted.armings && pressed(s); });
  }

  TEST_CASE("session: a goal turns the part") {
    SessionBench bench;
    haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
    goal.pose[2] = 0.05;
    goal.pose[5] = std::sin(0.4);
    goal.pose[6] = std::cos(0.4);
    goal.seconds = 0.2;
    std::uint64_t number = 0;
    REQUIRE(haptic_session_move_hand(bench.session, &goal, &number) == HAPTIC_OK);
    const haptic_state there = bench.wait_for([&](const haptic_state& s) {
      return s.goals_reached >= number && std::abs(s.hand_pose[2] - 0.05) < 1e-4;
    });
    CHECK(there.hand_pose[5] == doctest::Approx(std::sin(0.4)).epsilon(1e-6));
  }

  TEST_CASE("session: its threads run no handler of the program, and this one's are as they were") {
    const auto bit = [](int number) { return std::uint64_t{1} << (number - 1); };
    const std::vector<std::uint64_t> before = blocked_by_threads();
    const auto of_errors = [&](std::uint64_t blocked) {
      return (blocked & (bit(SIGSEGV) | bit(SIGABRT) | bit(SIGFPE))) != 0;
    };
    const auto holds = [&](std::uint64_t blocked) {
      return (blocked & bit(SIGUSR1)) != 0 && (blocked & bit(SIGINT)) != 0 && !of_errors(blocked);
    };
    REQUIRE(std::none_of(before.begin(), before.end(), holds));
    {
      const SessionBench bench;
      const std::vector<std::uint64_t> during = blocked_by_threads();
      REQUIRE(during.size() >= before.size() + 2);
      const auto held = std::count_if(during.begin(), during.end(), holds);
      CHECK(static_cast<std::size_t>(held) == during.size() - before.size());
    }
    CHECK(blocked_by_threads() == before);
  }
}
