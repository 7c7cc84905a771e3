// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <string_view>

#include "hal/drivers/falcon_codec.hpp"

using namespace haptic::hal;

namespace {

constexpr std::uint64_t kFalconCodecSeed = 20240611;

FalconReport random_report(std::mt19937_64& random) {
  FalconReport r;
  for (std::int16_t& c : r.counts) c = static_cast<std::int16_t>(random() & 0xffffu);
  r.buttons = static_cast<std::uint8_t>(random() & 0xfu);
  r.homed = static_cast<std::uint8_t>(random() & 7u);
  return r;
}

}  // namespace

TEST_SUITE("hal.falcon_codec") {
  TEST_CASE("encode: numbers low nibble first, each plus 0x41, between brackets") {
    FalconCommand command;
    command.motors = {0x1234, -1, 0};
    command.homing = true;
    command.lights = kFalconRed;
    const FalconPacket p = encode(command);
    CHECK(std::string_view(reinterpret_cast<const char*>(p.data()), p.size()) ==
          "<EDCBPPPPAAAAJA>");
    FalconReport report;
    report.counts = {-32768, 32767, 16};
    report.buttons = 5;
    report.homed = 7;
    const FalconPacket q = encode(report);
    CHECK(std::string_view(reinterpret_cast<const char*>(q.data()), 13) == "<AAAIPPPHABAA");
    CHECK(q[13] == 0x41 + 0x75);
  }

  TEST_CASE("decode: gives back what was encoded, over random reports and commands") {
    std::mt19937_64 random(kFalconCodecSeed);
    CAPTURE(kFalconCodecSeed);
    for (int i = 0; i < 100000; ++i) {
      const FalconReport report = random_report(random);
      FalconReport back;
      REQUIRE(decode(encode(report), back));
      REQUIRE(back == report);
      FalconCommand command;
      command.motors = random_report(random).counts;
      command.homing = (random() & 1u) != 0;
      command.lights = static_cast<std::uint8_t>(random() & 0xeu);
      FalconCommand again;
      REQUIRE(decode(encode(command), again));
      REQUIRE(again == command);
    }
  }

  TEST_CASE("decode: any byte that cannot be is refused and leaves the result alone") {
    FalconReport report;
    report.counts = {1, 2, 3};
    const FalconPacket good = encode(report);
    for (std::size_t at = 0; at < good.size(); ++at) {
      if (at == 14) continue;  // padding
      for (int value = 0; value < 256; ++value) {
        const bool nibble = at >= 1 && at <= 12 && value >= 0x41 && value <= 0x50;
        const bool bits = at == 13 && value >= 0x41 && value <= 0x41 + 0x7f;
        FalconPacket bytes = good;
        bytes[at] = static_cast<std::uint8_t>(value);
        FalconReport back;
        back.buttons = 9;
        const bool accepted = decode(bytes, back);
        CHECK(accepted == (nibble || bits || bytes == good));
        if (!accepted) CHECK(back.buttons == 9);
      }
    }
  }

  TEST_CASE("FalconStream: finds every packet however the stream is cut, with noise between") {
    std::mt19937_64 random(kFalconCodecSeed);
    CAPTURE(kFalconCodecSeed);
    FalconStream stream;
    for (int i = 0; i < 5000; ++i) {
      const FalconReport report = random_report(random);
      for (std::uint64_t noise = random() % 4; noise > 0; --noise) {
        CHECK(stream.push(static_cast<std::uint8_t>(0x80u + noise)) == FalconStream::Step::kNone);
      }
      const FalconPacket packet = encode(report);
      for (std::size_t k = 0; k < packet.size(); ++k) {
        const auto step = stream.push(packet[k]);
        REQUIRE((step == FalconStream::Step::kPacket) == (k == 15));
        REQUIRE(step != FalconStream::Step::kBroken);
      }
      FalconReport back;
      REQUIRE(decode(stream.packet(), back));
      REQUIRE(back == report);
    }
  }

  TEST_CASE("FalconStream: a lost or added byte costs one packet at most, and is noticed") {
    std::mt19937_64 random(kFalconCodecSeed);
    CAPTURE(kFalconCodecSeed);
    for (int i = 0; i < 2000; ++i) {
      FalconStream stream;
      const std::size_t at = random() % 16;
      const bool lost = (random() & 1u) != 0;
      int whole = 0, broken = 0;
      for (int n = 0; n < 3; ++n) {
        FalconReport report;
        report.counts[0] = static_cast<std::int16_t>(n);
        const FalconPacket packet = encode(report);
        for (std::size_t k = 0; k < packet.size(); ++k) {
          const bool hit = n == 0 && k == at;
          if (hit && lost) continue;
          const int times = hit ? 2 : 1;
          for (int t = 0; t < times; ++t) {
            const auto step = stream.push(packet[k]);
            broken += step == FalconStream::Step::kBroken ? 1 : 0;
            FalconReport back;
            if (step == FalconStream::Step::kPacket && decode(stream.packet(), back) &&
                back == report) {
              ++whole;
            }
          }
        }
      }
      CAPTURE(at);
      CAPTURE(lost);
      CHECK(whole >= 2);
      // Doubled brackets hide: the first is noise. So does a packet whose head was lost.
      const bool hidden = lost ? at == 0 : at == 15;
      if (!hidden) CHECK(broken >= 1);
    }
  }
}
