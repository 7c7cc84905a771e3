// SPDX-License-Identifier: Apache-2.0
// Live sessions of the programs: what they publish, the trace of a device, and what is refused.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "host_sim/session/core_session.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "tests/host_sim/recorded_input.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tests/support/program_run.hpp"
#include "tools/live/live_trace.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

std::string sample_scene_in(const ScratchFolder& folder) {
  const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
  std::ofstream(folder.file("s.rtscene"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  return "'" + folder.file("s.rtscene") + "'";
}

StepTrace trace_of(std::uint64_t tick) {
  StepTrace trace;
  trace.tick = trace.sequence = tick;
  trace.stamp_ns = trace.now_ns = static_cast<std::int64_t>(tick) * 1'000'000;
  trace.pose_p_m[0] = 1e-4 * static_cast<double>(tick);
  trace.pose_q_xyzw[3] = 1;
  trace.rendered_force_n[2] = static_cast<double>(tick);
  trace.state_hash = tick;
  trace.link = static_cast<std::uint8_t>(LinkState::kReady);
  return trace;
}

}  // namespace

TEST_SUITE("host_sim.live_session") {
  TEST_CASE("what a closed loop publishes gives the state hashes again, and its records") {
    const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    CoreSession session(bytes, "sample");
    ClosedLoop loop(session, DeviceModel{}, *hand_named("firm"), 1000.0);
    std::vector<MotionSample> motion(300);
    for (std::size_t k = 0; k < motion.size(); ++k) {
      motion[k].t_s = 1e-3 * static_cast<double>(k);
      motion[k].p[2] = 0.12 - 1e-3 * static_cast<double>(k);
    }
    const auto board = std::make_unique<LiveBoard>();
    LiveWriter writer(*board);
    LiveReader reader(*board);
    const std::vector<LoopRecord> records = run_loop(loop, motion, [&](const LoopRecord& record) {
      writer.publish(live_tick(recorded_tick(record, 1000.0), record.tick.tick), {record.tick, 7});
      const TickRecord& newest = reader.newest().record;
      CHECK(newest.tick == record.tick.tick);
      CHECK(std::memcmp(&newest, &record.tick, sizeof newest) == 0);
      CHECK(reader.newest().hand_stamp == 7);
    });
    std::uint64_t first = 0;
    std::vector<LiveTick> ticks(1000);
    REQUIRE(reader.copy(first, ticks) == records.size());
    bool touched = false;
    for (std::size_t k = 0; k < records.size(); ++k) {
      const LiveTick& tick = ticks[k];
      CHECK(tick.sequence == k);
      CHECK(tick.marks == (k == 0 ? kMarkAccepted | kMarkReset : kMarkAccepted));
      REQUIRE(hash_after(session.core(), tick) == tick.state_hash);
      touched = touched || records[k].tick.situation != ContactSituation::kNone;
    }
    CHECK(touched);
  }

  TEST_CASE("what leads the hand along a plan comes through the board") {
    TickRecord record;
    record.guide = {{1, 2, 3}, {4, 5, 6}, 0.02, 0.001, GuideState::kOn, 4};
    const auto board = std::make_unique<LiveBoard>();
    LiveWriter(*board).publish({}, {record});
    LiveReader reader(*board);
    const TickGuide& guide = reader.newest().record.guide;
    CHECK(guide.state == GuideState::kOn);
    CHECK(guide.station == 4);
    CHECK(std::equal(guide.force_n, guide.force_n + 3, record.guide.force_n));
    CHECK(std::equal(guide.torque_nm, guide.torque_nm + 3, record.guide.torque_nm));
    CHECK(guide.to_go_m == 0.02);
    CHECK(guide.off_m == 0.001);
  }

  TEST_CASE("trace of a device: each report once, mapped; what does not go on is marked") {
    std::vector<std::byte> room(2 * FlightRecorder::bytes_for(64) + 64);
    void* begin = room.data();
    std::size_t space = room.size();
    auto* aligned = static_cast<std::byte*>(std::align(64, space - 64, begin, space));
    const std::size_t each = FlightRecorder::bytes_for(64);
    FlightRecorder servo({aligned, each}), spare({aligned + each, each});
    const auto board = std::make_unique<LiveBoard>();
    WorkspaceMap map;
    map.scale = 2;
    map.grip_a = Vec3(0, 0, 1);
    TraceFollower follower({{aligned, each}, {aligned + each, each}}, map, *board);
    LiveReader reader(*board);
    follower.look();
    CHECK(reader.written() == 0);

    for (std::uint64_t tick = 1; tick <= 3; ++tick) servo.write(trace_of(tick));
    follower.look();
    follower.look();
    REQUIRE(reader.written() == 3);
    CHECK(reader.newest().record.force_n[2] == 3);
    CHECK(reader.newest().knows_felt == 0);
    CHECK(std::isnan(reader.newest().record.apart_m));

    StepTrace same = trace_of(4);
    same.sequence = 3;  // no new report in this tick
    servo.write(same);
    StepTrace lost = trace_of(5);
    lost.link = static_cast<std::uint8_t>(LinkState::kAbsent);
    servo.write(lost);
    servo.write(trace_of(6));
    StepTrace wild = trace_of(7);
    wild.pose_q_xyzw[0] = std::nan("");
    servo.write(wild);
    follower.look();
    REQUIRE(reader.written() == 4);

    spare.write(trace_of(20));  // the spare goes on, later
    follower.look();
    REQUIRE(reader.written() == 5);
    std::uint64_t first = 0;
    std::vector<LiveTick> ticks(10);
    REQUIRE(reader.copy(first, ticks) == 5);
    const std::uint64_t hashes[] = {1, 2, 3, 6, 20};
    const std::uint64_t marks[] = {kMarkReset, 0, 0, kMarkReset, kMarkReset};
    for (std::size_t k = 0; k < 5; ++k) {
      CAPTURE(k);
      CHECK(ticks[k].state_hash == hashes[k]);
      CHECK(ticks[k].marks == marks[k]);
      CHECK(ticks[k].p_wa_m[0] == doctest::Approx(2e-4 * static_cast<double>(hashes[k])));
      CHECK(ticks[k].p_wa_m[2] == doctest::Approx(-1.0));
    }
  }

  TEST_CASE("serve: says its address, runs for its time; what cannot be is refused") {
    const ScratchFolder folder("live_session");
    const std::string scene = sample_scene_in(folder);
    const ProgramResult served = run_program(HAPTIC_HOST_SIM, "serve 2 --seconds 0.3");
    CHECK(served.exit_code == 0);
    CHECK(served.out.find("live view: http://127.0.0.1:") != std::string::npos);
    CHECK(served.out.find("ws://127.0.0.1:") != std::string::npos);
    CHECK(served.out.find("served ") != std::string::npos);
    CHECK(served.out.find("\nfollowed the hand in all ") != std::string::npos);
    // The part of the sample starts inside its obstacle.
    const ProgramResult inside = run_program(HAPTIC_HOST_SIM, "serve " + scene + " --seconds 0.3");
    CHECK(inside.exit_code == 1);
    CHECK(inside.out.find("\nFAILED: ") != std::string::npos);
    CHECK(served.out.find("whoever reaches") == std::string::npos);
    const ProgramResult open = run_program(HAPTIC_HOST_SIM, "serve 2 --seconds 0.1 --bind 0.0.0.0");
    CHECK(open.exit_code == 0);
    CHECK(open.out.find("whoever reaches this machine and has the token") != std::string::npos);

    const ListeningSocket taken("127.0.0.1", 0);
    const ProgramResult busy =
        run_program(HAPTIC_HOST_SIM, "serve " + scene + " --port " + std::to_string(taken.port()));
    CHECK(busy.exit_code == 4);
    CHECK(busy.err.find("give another --port") != std::string::npos);
    CHECK(run_program(HAPTIC_HOST_SIM, "serve " + scene + " --bind localhost").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "serve " + scene + " --port 70000").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "serve " + scene + " --hand none").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "serve no.rtscene").exit_code == 3);
    CHECK(run_program(HAPTIC_HOST_SIM,
                      "run " + scene + " --serve --carrier usb --record " + folder.file("s.hrec"))
              .exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "run " + scene + " --serve --json").exit_code == 2);
  }
}
