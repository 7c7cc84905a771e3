// SPDX-License-Identifier: Apache-2.0
// A session with the stand-in for Haply's service, kept and replayed.
#include <doctest/doctest.h>

#include "hal/clock/servo_clock.hpp"
#include "tests/bridges/haply/inverse_service.hpp"
#include "tests/bridges/record_bench.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/haply/haply_device.hpp"
#include "tools/bridges/haply/haply_replay.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::TapKind;

namespace {

/// The handle moves and turns; answers are wrong; the service is started again.
void record_session(RecordBench& bench, InverseKind kind, const std::string& version) {
  InverseService service(kind, version);
  tools::HaplySettings settings;
  settings.http_port = service.http_port();
  settings.websocket_port = service.websocket_port();
  auto device = bench.recorded(std::make_unique<tools::HaplyDevice>(settings));
  std::string why;
  hal::BridgeSample sample;
  for (int again = 0; again < 2; ++again) {
    REQUIRE(device->open(why));
    for (int k = 0; k < 60; ++k) {
      TableDevice table = service.device();
      table.position_m = {0.001 * k, -0.1, 0.1 + 0.002 * k};
      table.q_wxyz = {0.8, 0.6, 0, 0};
      table.a = k % 2 == 0;
      service.set(table);
      if (k == 30) service.answer_wrongly(WrongAnswer::kTruncated, 2);
      (void)device->read(hal::monotonic_ns(), sample);
      Wrench wrench;
      wrench.force_w.x() = static_cast<Real>(0.01 * k);
      (void)device->write(hal::monotonic_ns(), wrench);
      (void)hal::sleep_until(hal::monotonic_ns() + 2'000'000);
    }
    if (again == 0) {
      service.stop();
      service.start();
    }
    device->close();
  }
  device.reset();
  bench.recorder.reset();
}

tools::ReplayResult replay_file(const std::string& path) {
  tools::Recording recording(path);
  return tools::replay_haply(recording);
}

}  // namespace

TEST_SUITE("bridges.recorded_messages") {
  TEST_CASE("a session with a service of either version gives its poses again to the bit") {
    for (const auto& [kind, version] :
         {std::pair{InverseKind::k31, "3.1.1.0"}, std::pair{InverseKind::k35, "3.5.0.0"}}) {
      CAPTURE(version);
      RecordBench bench("recorded_haply");
      record_session(bench, kind, version);
      CHECK(bench.count(TapKind::kChosen) == 2);
      CHECK(bench.count(TapKind::kAsked) >= 2);
      check_same(replay_file(bench.path), 40);
    }
  }

  TEST_CASE("one bit of a message, or of a pose, and the replay says where") {
    RecordBench bench("changed_haply");
    record_session(bench, InverseKind::k35, "3.5.0.0");
    const std::vector<char> all = bench.bytes();
    REQUIRE(bench.turn_bit(TapKind::kParsed, 20));
    tools::ReplayResult result = replay_file(bench.path);
    CHECK(result.different == 1);
    CHECK(has(result.first, "another pose than then"));
    bench.write(all);
    // The first byte of a message that was read: no JSON any more.
    RecordBench other("changed_haply_message");
    other.write(all);
    {
      tools::Recording recording(other.path);
      tools::RecordEntry entry, before;
      std::uint64_t parsed_at = 0;
      std::size_t sent = 0;
      while (recording.next(entry)) {
        if (entry.kind == TapKind::kMessage && !entry.received.empty()) before = entry;
        if (entry.kind == TapKind::kParsed && parsed_at == 0) {
          parsed_at = before.at;
          sent = before.sent.size();
          break;
        }
      }
      std::vector<char> changed = all;
      changed[parsed_at + 32 + sent] = '[';
      const std::size_t size = 36 + sent + before.received.size();
      const std::uint32_t sum =
          hal::crc32({reinterpret_cast<const std::uint8_t*>(changed.data()) + parsed_at, size - 4});
      std::memcpy(changed.data() + parsed_at + size - 4, &sum, sizeof sum);
      other.write(changed);
    }
    result = replay_file(other.path);
    CHECK(has(result.first, "the message before"));
  }

  TEST_CASE("a byte changed anywhere: the replay ends, with a result or a refusal") {
    RecordBench bench("mutated_haply");
    record_session(bench, InverseKind::k35, "3.5.0.0");
    check_mutations(bench, replay_file, 60);
  }

  TEST_CASE("names of other programs are not in it") {
    RecordBench bench("private_haply");
    record_session(bench, InverseKind::k35, "3.5.0.0");
    tools::Recording recording(bench.path);
    for (tools::RecordEntry entry; recording.next(entry);) {
      if (entry.kind != TapKind::kAsked) continue;
      const std::string target(reinterpret_cast<const char*>(entry.sent.data()), entry.sent.size());
      CHECK(entry.received.empty() == (target == "/sessions"));
    }
  }
}
