// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "tests/bridges/record_bench.hpp"
#include "tests/bridges/spacenav/spacenav_bench.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::TapKind;

namespace {

tools::ReplayResult replay_spacenav(const std::string& path) {
  tools::Recording recording(path);
  tools::SpacenavSettings settings;
  settings.full_scale = 500;
  tools::SpacenavDevice device(settings);
  return tools::replay_calls(recording, device);
}

/// A hand on the device for 300 ms, its buttons, the daemon killed and started again.
void record_session(RecordBench& bench, int version) {
  SocketFolder folder;
  SpacenavEmulator daemon(folder.path(), version);
  REQUIRE(daemon.start());
  daemon.plug({});
  auto device = bench.recorded(std::make_unique<tools::SpacenavDevice>(
      SpacenavBench::settings(folder.path(), EmulatedDevice{})));
  hal::BridgeSample sample;
  std::string why;
  std::int64_t now_ns = 5'000'000'000;
  for (int again = 0; again < 2; ++again) {
    REQUIRE(device->open(why));
    for (int k = 0; k < 150; ++k) {
      const auto axis = static_cast<std::int16_t>(3 * k - 200);
      if (k % 3 == 0) daemon.report({axis, 20, 0, 0, axis, 7});
      if (k % 40 == 5) daemon.press(k % 2, true);
      now_ns += 1'000'000;
      (void)hal::sleep_until(hal::monotonic_ns() + 200'000);
      CHECK(device->read(now_ns, sample) != hal::BridgeRead::kLost);
    }
    daemon.kill();
    for (int k = 0; k < 1000 && device->read(now_ns += 1'000'000, sample) != hal::BridgeRead::kLost;
         ++k)
      (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
    device->close();
    CHECK_FALSE(device->open(why));
    REQUIRE(daemon.start());
    daemon.plug({});
  }
  device.reset();
  bench.recorder.reset();
}

}  // namespace

TEST_SUITE("bridges.recorded_spacenav") {
  TEST_CASE("a session with a daemon of either version gives its poses again to the bit") {
    for (const int version : {0, 1}) {
      CAPTURE(version);
      RecordBench bench("recorded_spacenav");
      record_session(bench, version);
      CHECK(bench.count(TapKind::kOpened) == 4);
      check_same(replay_spacenav(bench.path), 200);
    }
  }

  TEST_CASE("one bit of what the daemon said, or of a pose, and the replay says where") {
    RecordBench bench("changed_spacenav");
    record_session(bench, 1);
    const std::vector<char> all = bench.bytes();
    // The low byte of an axis: another pose from there on.
    REQUIRE(bench.turn_bit(TapKind::kReceived, 4, 4));
    tools::ReplayResult result = replay_spacenav(bench.path);
    CHECK(result.different == 1);
    CHECK(has(result.first, bench.path + ": byte "));
    CHECK(has(result.first, "another pose than then"));
    bench.write(all);
    REQUIRE(bench.turn_bit(TapKind::kLooked, 8));
    result = replay_spacenav(bench.path);
    CHECK(result.different == 1);
    CHECK(has(result.first, "another pose than then"));
  }

  TEST_CASE("a byte changed anywhere: the replay ends, with a result or a refusal") {
    RecordBench bench("mutated_spacenav");
    record_session(bench, 1);
    check_mutations(bench, replay_spacenav, 60);
  }
  TEST_CASE("[long] a byte changed anywhere, many times") {
    RecordBench bench("mutated_spacenav_long");
    record_session(bench, 1);
    check_mutations(bench, replay_spacenav, 5000);
  }

  TEST_CASE("a disk that is full from the beginning: the poses are those without a recording") {
    PoseRecord first;
    for (const char* path : {"", "/dev/full"}) {
      SpacenavBench bench;
      tools::RecorderSettings settings;
      settings.path = path;
      if (*path != '\0') bench.bridge.set_tap(std::make_shared<tools::BridgeRecorder>(settings));
      REQUIRE(bench.open() == "");
      bench.daemon.report({100, -50, 30, 0, 20, 0});
      std::int64_t now_ns = 1'000'000'000;
      (void)bench.read(now_ns);
      for (int k = 0; k < 2000 && bench.bridge.counts().events == 0; ++k) {
        (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
        (void)bench.read(now_ns);
      }
      for (int k = 0; k < 100; ++k) {
        if (k % 10 == 0) (void)hal::sleep_until(hal::monotonic_ns() + 1'000'000);
        CHECK(bench.read(now_ns += 1'000'000) != hal::BridgeRead::kLost);
      }
      if (*path == '\0') first = bench.sample.pose_dh;
      for (int k = 0; k < 3; ++k) CHECK(bench.sample.pose_dh.p_m[k] == first.p_m[k]);
      CHECK(first.p_m[0] != 0);
    }
  }

  TEST_CASE("code that says something else to the daemon is found out") {
    RecordBench bench("other_spacenav");
    record_session(bench, 0);
    tools::Recording recording(bench.path);
    // Another first message than that of the recording.
    tools::ReplayTap tap(recording, std::array{TapKind::kSent});
    const std::byte word[4] = {};
    CHECK(tap.give(TapKind::kSent, word, {}) == -1);
    CHECK(has(tap.result().first, "says something else to the device"));
  }
}
