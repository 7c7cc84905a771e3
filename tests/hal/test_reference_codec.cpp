// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "hal/drivers/reference_codec.hpp"

using namespace haptic::hal;

namespace {

constexpr std::uint64_t kReferenceCodecSeed = 20'240'611;
constexpr int kRandomCount = 100'000;

/// Whole range, and its ends more often than chance has it.
class RandomNumbers {
 public:
  std::uint32_t bits() {
    const std::uint64_t draw = engine_();
    constexpr std::uint32_t kEnds[] = {0, 1, 0x7fff'ffff, 0x8000'0000, 0xffff'ffff};
    return draw >> 60 == 0 ? kEnds[draw % 5] : static_cast<std::uint32_t>(draw);
  }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  template <std::size_t N>
  void fill(std::array<std::int32_t, N>& values) {
    for (std::int32_t& value : values) value = static_cast<std::int32_t>(bits());
  }

 private:
  std::mt19937_64 engine_{kReferenceCodecSeed};
};

ReferenceReport random_report(RandomNumbers& random) {
  ReferenceReport report;
  report.status = static_cast<std::uint8_t>(random.bits() & kReferenceStatusBits);
  report.sequence = random.bits();
  report.time_us = std::uint64_t{random.bits()} << 32 | random.bits();
  random.fill(report.position);
  double q[4];
  double norm = 0;
  while (!(norm > 0.1)) {
    norm = 0;
    for (double& x : q) {
      x = 2 * random.unit() - 1;
      norm += x * x;
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    report.orientation[k] = static_cast<std::int32_t>(q[k] / std::sqrt(norm) * (1 << 30));
  }
  random.fill(report.velocity);
  random.fill(report.angular_velocity);
  report.switches = random.bits();
  report.faults = random.bits() & kReferenceFaultBits;
  report.accepted_tick = random.bits();
  report.rejected = random.bits();
  report.accepted_sequence = random.bits();
  report.gripper = random.bits();
  return report;
}

ReferenceCommand random_command(RandomNumbers& random) {
  ReferenceCommand command;
  command.drives_on = (random.bits() & 1) != 0;
  command.sequence = random.bits();
  command.tick = random.bits();
  random.fill(command.force);
  random.fill(command.torque);
  return command;
}

ReferenceBlock random_block(RandomNumbers& random) {
  ReferenceBlock block;
  block.twist_sensed = (random.bits() & 1) != 0;
  block.sensed_dof = static_cast<std::uint8_t>(random.bits() & 0x3f);
  block.driven_dof = static_cast<std::uint8_t>(random.bits() & 0x3f);
  block.report_period_us = static_cast<std::uint16_t>(random.bits() & 0xffff);
  block.watchdog_ms = static_cast<std::uint16_t>(random.bits() & 0xffff);
  for (std::uint32_t* const value :
       {&block.max_force, &block.max_torque, &block.max_force_rate_mn_per_s,
        &block.max_torque_rate_mnm_per_s, &block.max_stiffness_mn_per_m,
        &block.max_damping_mns_per_m, &block.mass_mg, &block.damping_uns_per_m, &block.friction,
        &block.encoder_step_nm, &block.encoder_step_nrad, &block.workspace_radius_um}) {
    *value = random.bits();
  }
  return block;
}

DeviceText random_text(RandomNumbers& random) {
  DeviceText text{};
  const std::size_t size = random.bits() % text.size();
  for (std::size_t k = 0; k < size; ++k) text[k] = static_cast<char>(0x20 + random.bits() % 0x5f);
  return text;
}

ReferenceLongBlock random_long_block(RandomNumbers& random) {
  ReferenceLongBlock block;
  block.first = random_block(random);
  block.is_displacement = (random.bits() & 1) != 0;
  block.latency_us = random.bits();
  block.largest_gap_um = random.bits();
  block.name = random_text(random);
  block.serial = random_text(random);
  return block;
}

template <std::size_t N, typename Record>
std::array<std::uint8_t, N> bytes_of(const Record& record) {
  std::array<std::uint8_t, N> bytes{};
  encode(record, bytes);
  return bytes;
}
constexpr auto kReportBytesOf = bytes_of<kReferenceReportBytes, ReferenceReport>;
constexpr auto kCommandBytesOf = bytes_of<kReferenceCommandBytes, ReferenceCommand>;
constexpr auto kBlockBytesOf = bytes_of<kReferenceBlockBytes, ReferenceBlock>;
constexpr auto kLongBlockBytesOf = bytes_of<kReferenceLongBlockBytes, ReferenceLongBlock>;

/// The check sum put right after a change of the bytes before it.
template <std::size_t N>
void seal(std::array<std::uint8_t, N>& bytes) {
  const std::uint32_t check = crc32(std::span(bytes).first(N - 4));
  for (unsigned k = 0; k < 4; ++k) bytes[N - 4 + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

/// Records that differ after a round trip, of kRandomCount.
template <std::size_t N, typename Record>
int broken_round_trips(Record (*draw)(RandomNumbers&)) {
  RandomNumbers random;
  int broken = 0;
  for (int i = 0; i < kRandomCount; ++i) {
    const Record sent = draw(random);
    Record read;
    if (decode(bytes_of<N>(sent), read) != CodecVerdict::kOk || !(read == sent)) ++broken;
  }
  return broken;
}

/// Single bit flips that are accepted or touch the record, and wrong lengths likewise.
template <std::size_t N, typename Record>
int accepted_damage(const Record& record) {
  const std::array<std::uint8_t, N> bytes = bytes_of<N>(record);
  const Record untouched;
  int accepted = 0;
  for (std::size_t bit = 0; bit < 8 * N; ++bit) {
    std::array<std::uint8_t, N> damaged = bytes;
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    Record read;
    if (decode(damaged, read) == CodecVerdict::kOk || !(read == untouched)) ++accepted;
  }
  for (std::size_t length = 0; length <= 2 * N; ++length) {
    std::vector<std::uint8_t> cut(bytes.begin(), bytes.end());
    cut.resize(length);
    Record read;
    const bool refused = decode(cut, read) == CodecVerdict::kBadLength && read == untouched;
    if (refused == (length == N)) ++accepted;
  }
  return accepted;
}

}  // namespace

TEST_SUITE("hal.reference_codec") {
  TEST_CASE("crc32: check values of the published algorithm") {
    const auto crc_of = [](std::string_view text) {
      const std::vector<std::uint8_t> bytes(text.begin(), text.end());
      return crc32(bytes);
    };
    CHECK(crc_of("") == 0);
    CHECK(crc_of("123456789") == 0xcbf43926u);
    CHECK(crc_of("The quick brown fox jumps over the lazy dog") == 0x414fa339u);
  }

  TEST_CASE("encode, decode: random records come back as they were") {
    INFO("seed " << kReferenceCodecSeed);
    CHECK(broken_round_trips<kReferenceReportBytes>(random_report) == 0);
    CHECK(broken_round_trips<kReferenceCommandBytes>(random_command) == 0);
    CHECK(broken_round_trips<kReferenceBlockBytes>(random_block) == 0);
    CHECK(broken_round_trips<kReferenceLongBlockBytes>(random_long_block) == 0);
  }

  TEST_CASE("decode: every flip of one bit and every wrong length is refused") {
    INFO("seed " << kReferenceCodecSeed);
    RandomNumbers random;
    for (int i = 0; i < 20; ++i) {
      CHECK(accepted_damage<kReferenceReportBytes>(random_report(random)) == 0);
      CHECK(accepted_damage<kReferenceCommandBytes>(random_command(random)) == 0);
      CHECK(accepted_damage<kReferenceBlockBytes>(random_block(random)) == 0);
      CHECK(accepted_damage<kReferenceLongBlockBytes>(random_long_block(random)) == 0);
    }
  }

  TEST_CASE("encode: each value stands where the protocol says, little end first") {
    ReferenceReport report;
    report.status = kReferenceCalibrated | kReferenceTwistValid;
    report.sequence = 0x04030201;
    report.time_us = 0x0807060504030201;
    report.position = {-1, 0x01020304, 0};
    report.velocity = {0, 0, 0x11223344};
    report.angular_velocity = {0, 0, 0x55667788};
    report.switches = 0xa1;
    report.faults = 0x21;
    report.accepted_tick = 0xb1;
    report.rejected = 0xc1;
    report.accepted_sequence = 0xd1;
    report.gripper = 0xe1;
    const auto bytes = kReportBytesOf(report);
    const auto u32_at = [&](std::size_t at) {
      return std::uint32_t{bytes[at]} | std::uint32_t{bytes[at + 1]} << 8 |
             std::uint32_t{bytes[at + 2]} << 16 | std::uint32_t{bytes[at + 3]} << 24;
    };
    CHECK(u32_at(0) == 0x05014852u);
    CHECK(u32_at(4) == 0x04030201u);
    CHECK(u32_at(8) == 0x04030201u);
    CHECK(u32_at(12) == 0x08070605u);
    CHECK(u32_at(16) == 0xffffffffu);
    CHECK(u32_at(20) == 0x01020304u);
    CHECK(u32_at(40) == 0x40000000u);
    CHECK(u32_at(52) == 0x11223344u);
    CHECK(u32_at(64) == 0x55667788u);
    CHECK(u32_at(68) == 0xa1u);
    CHECK(u32_at(72) == 0x21u);
    CHECK(u32_at(76) == 0xb1u);
    CHECK(u32_at(80) == 0xc1u);
    CHECK(u32_at(84) == 0xd1u);
    CHECK(u32_at(88) == 0xe1u);
    CHECK(u32_at(92) == crc32(std::span(bytes).first(92)));
  }

  TEST_CASE("decode: bytes under a right check sum are refused for what is wrong in them") {
    ReferenceReport report;
    ReferenceCommand command;
    ReferenceBlock block;
    const auto verdict_of = [](auto bytes, std::size_t at, std::uint8_t value, auto& record) {
      bytes[at] = value;
      seal(bytes);
      return decode(bytes, record);
    };
    const auto good = kReportBytesOf(report);
    CHECK(verdict_of(good, 0, 0x43, report) == CodecVerdict::kBadMagic);
    CHECK(verdict_of(good, 2, 2, report) == CodecVerdict::kBadVersion);
    CHECK(verdict_of(good, 3, 0x40, report) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(good, 3, 0x80, report) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(good, 72, 0x40, report) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(good, 43, 0x41, report) == CodecVerdict::kBadNumber);  // w = 1.0156
    CHECK(verdict_of(good, 43, 0, report) == CodecVerdict::kBadNumber);     // length 0
    CHECK(verdict_of(good, 20, 7, report) == CodecVerdict::kOk);
    CHECK(report.position[1] == 7);
    const auto order = kCommandBytesOf(command);
    CHECK(verdict_of(order, 3, 2, command) == CodecVerdict::kBadReserved);
    for (std::size_t at = 36; at < 52; ++at) {
      CHECK(verdict_of(order, at, 0x80, command) == CodecVerdict::kBadReserved);
    }
    const auto limits = kBlockBytesOf(block);
    CHECK(verdict_of(limits, 3, 2, block) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(limits, 4, 0x40, block) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(limits, 5, 0x7f, block) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(limits, 11, 1, block) == CodecVerdict::kBadReserved);
  }

  TEST_CASE(
      "decode: the block of 1.1 with names that are none, another minor version, set reserves") {
    ReferenceLongBlock block;
    block.name = device_text("Desk arm");
    block.serial = device_text("0123456789abcdef0123456");  // the longest that there is
    const auto good = kLongBlockBytesOf(block);
    const auto verdict_of = [&](std::size_t at, std::uint8_t value) {
      auto bytes = good;
      bytes[at] = value;
      seal(bytes);
      ReferenceLongBlock read, untouched;
      const CodecVerdict verdict = decode(bytes, read);
      CHECK((verdict == CodecVerdict::kOk || read == untouched));
      return verdict;
    };
    CHECK(verdict_of(60, 0) == CodecVerdict::kBadVersion);
    CHECK(verdict_of(60, 2) == CodecVerdict::kBadVersion);
    CHECK(verdict_of(61, 2) == CodecVerdict::kBadReserved);
    for (const std::size_t at : {62u, 63u, 72u, 73u, 74u, 75u})
      CHECK(verdict_of(at, 1) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(4, 0x40) == CodecVerdict::kBadReserved);
    constexpr std::uint8_t kNoLetters[] = {0x01, 0x0a, 0x1b, 0x1f, 0x7f, 0x80, 0xff};
    for (const std::uint8_t letter : kNoLetters) {
      CHECK(verdict_of(76, letter) == CodecVerdict::kBadText);
      CHECK(verdict_of(110, letter) == CodecVerdict::kBadText);
    }
    CHECK(verdict_of(99, 'x') == CodecVerdict::kBadText);   // behind the end of the name
    CHECK(verdict_of(123, 'x') == CodecVerdict::kBadText);  // a serial number without an end
    CHECK(verdict_of(76, 0) == CodecVerdict::kBadText);     // letters behind the end
    CHECK(verdict_of(76, 'd') == CodecVerdict::kOk);
  }

  TEST_CASE("decode_either: a block of 1.0 has minor version 0 and nothing of 1.1") {
    RandomNumbers random;
    for (int i = 0; i < 1000; ++i) {
      const ReferenceBlock old = random_block(random);
      ReferenceLongBlock read;
      read.latency_us = 7;
      REQUIRE(decode_either(kBlockBytesOf(old), read) == CodecVerdict::kOk);
      CHECK(read.first == old);
      CHECK(read.minor == 0);
      CHECK(read.latency_us == 0);
      const ReferenceLongBlock block = random_long_block(random);
      REQUIRE(decode_either(kLongBlockBytesOf(block), read) == CodecVerdict::kOk);
      CHECK(read == block);
    }
    const auto bytes = kLongBlockBytesOf(ReferenceLongBlock{});
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      ReferenceLongBlock read;
      CHECK(decode_either(std::span(bytes).first(length), read) != CodecVerdict::kOk);
    }
  }

  TEST_CASE("device_text: cut to its room, and nothing in it that a terminal obeys") {
    CHECK(text_of(device_text("sigma.7")) == "sigma.7");
    CHECK(text_of(device_text("")).empty());
    CHECK(text_of(device_text("a\x1b[2Jb\nc\x7f\xc3\xa4")) == "a?[2Jb?c???");
    CHECK(text_of(device_text(std::string(100, 'n'))) == std::string(23, 'n'));
    CHECK(text_of(device_text(std::string_view("ab\0cd", 5))) == "ab");
    CHECK(is_text(device_text(std::string(100, 'n'))));
    DeviceText none{};
    none.fill('n');
    CHECK_FALSE(is_text(none));
    CHECK(text_of(none).size() == none.size());
  }

  TEST_CASE("decode: an orientation of the largest numbers is refused, not summed past 64 bits") {
    ReferenceReport report;
    report.orientation = {INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN};
    const auto bytes = kReportBytesOf(report);
    CHECK(decode(bytes, report) == CodecVerdict::kBadNumber);
  }

  TEST_CASE("is_newer: counters that wrap") {
    CHECK(is_newer(1, 0));
    CHECK(is_newer(0, 0xffff'ffff));
    CHECK(is_newer(0x7fff'ffff, 0));
    CHECK_FALSE(is_newer(0x8000'0000, 0));
    CHECK_FALSE(is_newer(5, 5));
    CHECK_FALSE(is_newer(4, 5));
    CHECK_FALSE(is_newer(0xffff'ffff, 0));
  }
}
