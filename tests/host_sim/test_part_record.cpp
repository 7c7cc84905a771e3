// SPDX-License-Identifier: Apache-2.0
// Recordings of a scene with parts: poses of driven ones, and what the hand lets go and takes.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "hal/usb/bus_recorder.hpp"
#include "host_sim/device/bus_player.hpp"
#include "host_sim/device/device_stack.hpp"
#include "host_sim/session/core_session.hpp"
#include "tests/host_sim/record_bytes.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using Bytes = std::vector<std::uint8_t>;
using Kind = hal::RecordedGiven::Kind;

namespace {

constexpr std::uint32_t kPeg = 1;
constexpr int kReleased = 1900, kRestarted = 2900, kPeriods = 4000;

/// A block in the hand, a peg beside it, and a plate that its owner pushes against the block.
std::vector<std::byte> scene_bytes(const haptic::sim::test::ScratchFolder& folder) {
  const std::string path = folder.file("plate.toml");
  std::ofstream(path) << "format = 1\nname = \"plate\"\n"
                         "[[part]]\nname = \"block\"\nrole = \"hand\"\nshape = \"box\"\n"
                         "size_m = [0.04, 0.04, 0.03]\nposition_m = [0, 0, 0]\n"
                         "[[part]]\nname = \"peg\"\nrole = \"placed\"\nshape = \"box\"\n"
                         "size_m = [0.02, 0.02, 0.05]\nposition_m = [0, 0.1, 0]\n"
                         "[[part]]\nname = \"plate\"\nrole = \"driven\"\nshape = \"box\"\n"
                         "size_m = [0.02, 0.1, 0.1]\nposition_m = [-0.1, 0, 0]\n"
                         "fastest_m_per_s = 0.5\nfastest_rad_per_s = 2.0\npush_n = 60\n"
                         "[[part]]\nname = \"wall\"\nrole = \"fixed\"\nshape = \"box\"\n"
                         "size_m = [0.02, 0.3, 0.3]\nposition_m = [0.09, 0, 0]\n"
                         "[rendering]\nk_f_n_per_m = 600\n";
  return tools::compile_scene(tools::read_scene_file(path), {}).bytes;
}

HandAction resting_hand(double t_s) {
  HandAction action;
  action.target.x0_w = Vector(0.002 * std::sin(3 * t_s), 0.001 * std::sin(5 * t_s), 0);
  action.switches = t_s < 0.2 ? 0u : 1u;
  return action;
}

/// A pose of the plate 10 ms after the last one: to and fro, up to 4 mm into where the block was.
FrameRecord plate_at(int period, std::uint64_t number, std::int64_t now_ns) {
  FrameRecord record;
  record.number = number;
  record.stamp_ns = now_ns;
  record.p_m[0] = -0.1 + 0.037 * (1 - std::cos(2e-3 * period));
  record.fastest_m_per_s = 0.5;
  record.fastest_rad_per_s = 2;
  record.late_ns = 100'000'000;
  return record;
}

struct PartsRecord {
  Bytes file;
  hal::RecorderEnd end;
  bool took = false, pushed = false;
};

/// The plate pushes the block; the hand lets that go and takes the peg; the servo begins again.
PartsRecord record_parts(const std::vector<std::byte>& scene, const std::string& path) {
  CoreSession session(scene, "plate");
  StackSettings settings = reference_stack(StackCarrier::kUsb);
  settings.model.hand = *hand_named("light");
  DeviceStack stack(session, settings, resting_hand);
  hal::BusRecorder recorder(path, stack.bus_session(), hal::RecorderDrain::kCaller);
  recorder.follow(*session.hand());
  stack.record(&recorder, &hal::BusRecorder::watch, &recorder);
  PartsRecord result;
  for (int k = 0; k < kPeriods; ++k) {
    if (k % 10 == 0) {
      const auto number = static_cast<std::uint64_t>(k / 10 + 1);
      stack.drive(0, plate_at(k, number, stack.now_ns()));
    }
    PartHand& hand = *session.hand();
    if (k == kReleased) hand.release();
    if (k > kReleased && hand.phase() == PartHand::Phase::kEmpty) {
      REQUIRE(hand.prepare(kPeg) == RtStatus::kOk);
      result.took = true;
    }
    if (k == kRestarted) stack.restart_servo();
    const StackTick tick = stack.step();
    result.pushed = result.pushed || tick.acting.force_w.norm() > 0.5;
    REQUIRE(recorder.drain());
  }
  stack.record(nullptr, nullptr, nullptr);
  result.end = recorder.finish();
  result.file = read_recording(path);
  return result;
}

PlayResult play(const std::vector<std::byte>& scene, std::span<const std::uint8_t> file) {
  CoreSession session(scene, "plate");
  return play_session(session, file, "session.hrec");
}

constexpr std::size_t kHead = haptic::sim::test::kRecordHead;

hal::BusRecord given_record(const Bytes& file, Kind kind, std::size_t count) {
  return haptic::sim::test::record_of(file, static_cast<std::uint8_t>(kind), count);
}

/// A payload's byte with other bits, and the check sum put right.
Bytes changed(Bytes file, const hal::BusRecord& record, std::size_t byte, std::uint8_t bits) {
  file[record.offset + kHead + byte] ^= bits;
  haptic::sim::test::put_check(file, record.offset, kHead + record.payload.size());
  return file;
}

}  // namespace

TEST_SUITE("host_sim.part_record") {
  TEST_CASE("driven parts and what the hand takes play back to the same bits") {
    const haptic::sim::test::ScratchFolder folder("part_record");
    const std::vector<std::byte> scene = scene_bytes(folder);
    const PartsRecord recorded = record_parts(scene, folder.file("s.hrec"));
    REQUIRE(recorded.end.playable());
    CHECK(recorded.took);
    CHECK(recorded.pushed);
    const PlayResult played = play(scene, recorded.file);
    INFO(played.text);
    CHECK(!played.diverged);
    CHECK(played.complete);
    CHECK(played.ticks >= kPeriods - 1);
    CHECK(hal::given_of(given_record(recorded.file, Kind::kTake, 0)).number == kPeg);

    SUBCASE("a pose that is another by some 10 nm, and a part that is not there, are found") {
      const hal::BusRecord pose = given_record(recorded.file, Kind::kFrame, 120);
      const std::size_t x_byte = 4 + 8 + 8 + 3;  // its low bits
      const PlayResult other = play(scene, changed(recorded.file, pose, x_byte, 0x80));
      CHECK(other.diverged);
      CHECK(other.tick > 0);
      const hal::BusRecord take = given_record(recorded.file, Kind::kTake, 0);
      const PlayResult none = play(scene, changed(recorded.file, take, 0, 0x20));
      CHECK(none.diverged);
      CHECK(none.text.find("the hand takes part 33") != std::string::npos);
      const PlayResult nowhere = play(scene, changed(recorded.file, pose, 0, 0x40));
      CHECK(nowhere.diverged);
      CHECK(nowhere.text.find("a pose of driven part 65") != std::string::npos);
    }
    SUBCASE("a cut file is played to its last whole record") {
      const hal::BusRecord take = given_record(recorded.file, Kind::kTake, 0);
      const auto cut = std::span(recorded.file).first(take.offset + kHead + 1);
      const PlayResult part = play(scene, cut);
      CHECK(!part.diverged);
      CHECK(!part.complete);
      CHECK(part.ticks > kReleased);
    }
  }
}
