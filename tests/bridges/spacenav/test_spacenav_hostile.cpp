// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <climits>
#include <string>
#include <vector>

#include "tests/bridges/spacenav/spacenav_bench.hpp"
#include "tests/support/all_checks.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic;
using namespace haptic::test;
using hal::BridgeRead;

namespace {

constexpr std::int64_t kBridgeTurn_ns = 1'000'000;
constexpr std::uint64_t kGarbageSeed = 20261130;

using EightWords = std::array<std::int32_t, 8>;
constexpr EightWords kFullRight{0, 500, 0, 0, 0, 0, 0, 8};

}  // namespace

TEST_SUITE("bridges.spacenav_hostile") {
  TEST_CASE("daemon killed and started again: lost, and open again where it is back") {
    for (const int version : {0, 1}) {
      CAPTURE(version);
      SpacenavBench bench(version);
      REQUIRE(bench.open() == "");
      bench.daemon.report({500, 0, 0, 0, 0, 0});
      CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
      bench.daemon.kill();
      CHECK(bench.read(2 * kBridgeTurn_ns) == BridgeRead::kLost);
      CHECK(bench.read(3 * kBridgeTurn_ns) == BridgeRead::kLost);
      bench.bridge.close();
      CHECK(has(bench.open(), "no spacenavd listens at"));
      REQUIRE(bench.daemon.start());
      REQUIRE(bench.open() == "");
      CHECK(has(bench.bridge.facts().words, "given up: the daemon ended it"));
      CHECK(bench.read(1000 * kBridgeTurn_ns) == BridgeRead::kNew);
      CHECK(bench.sample.pose_dh.p_m[0] == 0.0_r);  // at the origin again, and at rest
      CHECK(bench.sample.twist_d.linear_m_per_s[0] == 0.0_r);
    }
  }

  TEST_CASE("device unplugged or another plugged in: lost, then nothing, then the new one") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
    bench.daemon.unplug();
    CHECK(bench.read(2 * kBridgeTurn_ns) == BridgeRead::kLost);
    CHECK(has(bench.open(), "has no device; plug one in"));
    EmulatedDevice other;
    other.product_id = 0xc635;
    bench.daemon.plug(other);
    REQUIRE(bench.open() == "");
    CHECK(has(bench.bridge.facts().name, "256f:c635"));
    CHECK(has(bench.bridge.facts().words, "given up: a device was removed"));
    CHECK(bench.read(3 * kBridgeTurn_ns) == BridgeRead::kNew);
    bench.daemon.plug({});
    CHECK(bench.read(4 * kBridgeTurn_ns) == BridgeRead::kLost);
    REQUIRE(bench.open() == "");
    CHECK(has(bench.bridge.facts().words, "given up: a device was added"));
  }

  TEST_CASE("half messages: nothing is taken until a message is whole") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
    const auto bytes = std::as_bytes(std::span(kFullRight));
    std::int64_t now_ns = 2 * kBridgeTurn_ns;
    for (int message = 0; message < 3; ++message) {
      for (std::size_t k = 0; k + 1 < bytes.size(); ++k) {
        bench.daemon.say_bytes(bytes.subspan(k, 1));
        REQUIRE(bench.read(now_ns) != BridgeRead::kLost);
        CHECK(bench.bridge.counts().events == static_cast<std::uint64_t>(message));
      }
      bench.daemon.say_bytes(bytes.last(1));
      CHECK(bench.read(now_ns) == BridgeRead::kNew);
      now_ns += kBridgeTurn_ns;
    }
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.0002));
    // The last one never becomes whole.
    bench.daemon.say_bytes(bytes.first(31));
    CHECK(bench.read(now_ns) != BridgeRead::kLost);
    bench.daemon.kill();
    CHECK(bench.read(now_ns + kBridgeTurn_ns) == BridgeRead::kLost);
    REQUIRE(bench.daemon.start());
    REQUIRE(bench.open() == "");  // nothing of it is left
    bench.daemon.say(kFullRight);
    CHECK(bench.read(now_ns + 2 * kBridgeTurn_ns) == BridgeRead::kNew);
    CHECK(bench.bridge.counts().events == 4u);
    CHECK(bench.bridge.counts().unknown == 0u);
  }

  TEST_CASE("1e4 messages of unknown types among good ones: ignored and counted") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    Random random(kGarbageSeed);
    std::vector<std::int32_t> words;
    std::int64_t now_ns = kBridgeTurn_ns;
    for (int turn = 0; turn < 1000; ++turn, now_ns += kBridgeTurn_ns) {
      words.clear();
      for (int k = 0; k < 10; ++k) {
        for (int word = 0; word < 8; ++word)
          words.push_back(static_cast<std::int32_t>(random.next()));
        auto& type = words[words.size() - 8];
        type = type < 0 ? type & ~0xff : (type & 0xffff) + 7;  // neither an event nor an answer
      }
      words.insert(words.end(), kFullRight.begin(), kFullRight.end());
      bench.daemon.say(words);
      REQUIRE(bench.read(now_ns) == BridgeRead::kNew);
    }
    CHECK(bench.bridge.counts().unknown == 10'000u);
    CHECK(bench.bridge.counts().events == 1000u);
    CHECK(bench.sample.pose_dh.p_m[0] == doctest::Approx(0.0999));
  }

  TEST_CASE("256 messages of unknown types in a row: lost, and why is said") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
    std::vector<std::int32_t> words;
    for (int k = 0; k < 51; ++k) words.insert(words.end(), {77, 1, 2, 3, 4, 5, 6, 7});
    for (int turn = 2; turn < 7; ++turn) {  // 255 of them
      bench.daemon.say(words);
      CHECK(bench.read(turn * kBridgeTurn_ns) == BridgeRead::kSame);
    }
    bench.daemon.say(std::span(words).first(8));
    CHECK(bench.read(7 * kBridgeTurn_ns) == BridgeRead::kLost);
    CHECK(bench.bridge.counts().unknown == 256u);
    REQUIRE(bench.open() == "");
    CHECK(has(bench.bridge.facts().words, "256 messages in a row"));
  }

  TEST_CASE("numbers of no device, as a sensitivity that is a NaN makes them: no motion") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
    std::uint64_t impossible = 0;
    std::int64_t now_ns = 2 * kBridgeTurn_ns;
    for (const std::int32_t giant : {INT_MIN, INT_MAX, 32769, -32769, 0x7fc00000, 0x7f800000}) {
      for (std::size_t axis = 1; axis <= 6; ++axis, now_ns += kBridgeTurn_ns) {
        EightWords unit{0, 100, 100, 100, 100, 100, 100, 8};
        unit[axis] = giant;
        bench.daemon.say(unit);
        CHECK(bench.read(now_ns) == BridgeRead::kSame);
        CHECK(bench.bridge.counts().impossible == ++impossible);
      }
    }
    // The largest that a device can report is full speed, no more.
    bench.daemon.say(EightWords{0, 32768, -32768, 0, 0, 0, 0, INT_MIN});
    CHECK(bench.read(now_ns) == BridgeRead::kNew);
    CHECK(bench.sample.twist_d.linear_m_per_s[0] == doctest::Approx(0.1));
    CHECK(bench.sample.twist_d.linear_m_per_s[2] == doctest::Approx(-0.1));

    // What a daemon of version 0 sends in the 0.3 s in which it holds the question for a number.
    SpacenavBench old(0);
    REQUIRE(old.open() == "");
    old.daemon.say(EightWords{0, INT_MIN, INT_MIN, INT_MIN, INT_MIN, INT_MIN, INT_MIN, 8});
    CHECK(old.read(kBridgeTurn_ns) == BridgeRead::kNew);  // the first sample of a connection
    CHECK(old.sample.twist_d.linear_m_per_s[0] == 0.0_r);
    CHECK(old.bridge.counts().impossible == 1u);
  }

  TEST_CASE("a slow daemon: waited for, or taken for one of version 0, whose late answer is none") {
    {
      SpacenavBench bench;
      bench.daemon.answer_after(100);
      REQUIRE(bench.open() == "");
      CHECK(bench.bridge.version() == 1);
    }
    {
      SpacenavBench bench;
      bench.daemon.answer_after(360);
      REQUIRE(bench.open() == "");
      CHECK(bench.bridge.version() == 0);
      for (int k = 0; k < 500 && bench.daemon.client_version() == 0; ++k) usleep(1000);
      bench.daemon.say(kFullRight);  // behind the answer, four bytes between two units
      for (int k = 0; k < 500 && bench.bridge.counts().events == 0; ++k) {
        CHECK(bench.read((k + 1) * kBridgeTurn_ns) != BridgeRead::kLost);
        usleep(1000);
      }
      CHECK(bench.bridge.counts().events == 1u);
      CHECK(bench.bridge.counts().unknown == 0u);
    }
    {
      SpacenavBench bench;
      bench.daemon.be_mute(true);
      REQUIRE(bench.open() == "");
      CHECK(bench.bridge.version() == 0);
    }
  }

  TEST_CASE("a daemon that knows version 1 and answers nothing more: refused within its time") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    std::string why;
    bench.daemon.answer_version_alone(true);
    CHECK_FALSE(bench.bridge.open(why));
    CHECK(has(why, "accepts version 1 of its protocol and does not answer"));
    CHECK(bench.bridge.watched().fd < 0);
  }

  TEST_CASE("read: 64 messages a turn at most, each in its order, and no heap calls") {
    SpacenavBench bench;
    REQUIRE(bench.open() == "");
    CHECK(bench.read(kBridgeTurn_ns) == BridgeRead::kNew);
    std::vector<std::int32_t> words;
    for (int k = 0; k < 160; ++k) words.insert(words.end(), {1, k % 32, 1, 0, 0, 0, 0, 0});
    bench.daemon.say(words);
    std::uint64_t calls = 0;
    {
      const RtGuard guard;
      for (int turn = 2; turn <= 4; ++turn) {
        REQUIRE(bench.read(turn * kBridgeTurn_ns) == BridgeRead::kNew);
        if (turn < 4)
          REQUIRE(bench.bridge.counts().events == static_cast<std::uint64_t>(64 * (turn - 1)));
      }
      calls = guard.heap_calls();
    }
    CHECK(calls == 0);
    CHECK(bench.bridge.counts().events == 160u);
    CHECK(bench.sample.switches == 0xffffffffu);
  }

  TEST_CASE("any bytes: within reach, of finite numbers, and lost or counted") {
    Random random(kGarbageSeed + 1);
    CAPTURE(kGarbageSeed);
    const int rounds = trials(12, 4000);
    for (int round = 0; round < rounds; ++round) {
      SpacenavBench bench;
      REQUIRE(bench.open() == "");
      std::int64_t now_ns = kBridgeTurn_ns;
      BridgeRead read = BridgeRead::kNew;
      for (int turn = 0; turn < 200 && read != BridgeRead::kLost; ++turn) {
        std::vector<std::byte> bytes(random.next() % 200);
        const bool wild = random.next() % 4 == 0;
        for (std::byte& byte : bytes)
          byte = static_cast<std::byte>(wild || random.next() % 16 == 0 ? random.next() : 0);
        if (!wild) bytes.resize(bytes.size() / 32 * 32);
        for (std::size_t k = 0; !wild && k < bytes.size(); k += 32)
          bytes[k] = static_cast<std::byte>(random.next() % 8);
        bench.daemon.say_bytes(bytes);
        now_ns += static_cast<std::int64_t>(random.next() % 100'000'000);
        read = bench.read(now_ns);
        REQUIRE(is_finite(twist_of(bench.sample.twist_d)));
        REQUIRE(vec3_of(bench.sample.pose_dh.p_m).norm() <= 0.2501_r);
        REQUIRE(std::abs(pose_of(bench.sample.pose_dh).q_wa.norm() - 1) < 1e-6_r);
      }
    }
  }
}
