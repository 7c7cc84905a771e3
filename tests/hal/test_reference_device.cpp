// SPDX-License-Identifier: Apache-2.0
/// The device's side of the protocol in C: every rule of hal/drivers/PROTOCOL.md that needs no
/// mechanics, by the host's codec and by the bytes of the document.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "hal/drivers/reference_short.hpp"
#include "hal/firmware/reference_device.h"
#include "tests/hal/protocol_text.hpp"

using namespace haptic::hal;
using haptic::hal::test::bytes_in;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// Those of the example block of the document.
haptic_facts example_facts() {
  haptic_facts facts{};
  facts.twist_sensed = 1;
  facts.sensed_dof = facts.driven_dof = 0x3f;
  facts.report_period_us = 1000;
  facts.watchdog_ms = 20;
  facts.max_force = 1'200'000;
  facts.max_torque = 3'000'000;
  facts.max_force_rate_mn_per_s = 2'000'000;
  facts.max_torque_rate_mnm_per_s = 40'000;
  facts.mass_mg = 100'000;
  facts.damping_uns_per_m = 1'000'000;
  facts.encoder_step_nm = 1000;
  facts.encoder_step_nrad = 10'000;
  return facts;
}

Bytes command_bytes(std::uint32_t sequence, bool drives_on, std::array<std::int32_t, 3> force = {},
                    std::array<std::int32_t, 3> torque = {}) {
  Bytes bytes(kReferenceCommandBytes);
  encode(ReferenceCommand{drives_on, sequence, sequence + 1000, force, torque},
         std::span<std::uint8_t, kReferenceCommandBytes>(bytes));
  return bytes;
}

/// A board: a clock of 1 kHz, inputs that a test sets.
struct FirmwareBench {
  explicit FirmwareBench(const haptic_facts& facts = example_facts()) {
    haptic_device_begin(&device, &facts);
    sample.orientation[3] = 1 << 30;
    sample.is_calibrated = 1;
  }
  /// One period passes; its report.
  ReferenceReport period() {
    sample.time_us += 1000;
    std::array<std::uint8_t, HAPTIC_REPORT_BYTES> bytes{};
    REQUIRE(haptic_device_period(&device, &sample, bytes.data(), bytes.size()) == bytes.size());
    ReferenceReport report;
    REQUIRE(decode(bytes, report) == CodecVerdict::kOk);
    return report;
  }
  bool packet(const Bytes& bytes) {
    return haptic_device_command(&device, bytes.data(), bytes.size(), sample.time_us) == 1;
  }
  bool command(bool drives_on, std::array<std::int32_t, 3> force = {}) {
    return packet(command_bytes(++sequence, drives_on, force));
  }
  /// Drives on with a push.
  void push() {
    REQUIRE(command(false));
    REQUIRE(command(true, {100'000, -200'000, 50'000}));
    REQUIRE(drive().is_on == 1);
  }
  [[nodiscard]] const haptic_drive& drive() const { return *haptic_device_drive(&device); }
  [[nodiscard]] bool is_off() const {
    const haptic_drive& d = drive();
    for (int k = 0; k < 3; ++k) {
      if (d.force[k] != 0 || d.torque[k] != 0) return false;
    }
    return d.is_on == 0;
  }

  haptic_device device{};
  haptic_sample sample{};
  std::uint32_t sequence = 0;
};

void seal(Bytes& bytes) {
  const std::uint32_t check = crc32(std::span(bytes).first(bytes.size() - 4));
  for (unsigned k = 0; k < 4; ++k)
    bytes[bytes.size() - 4 + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

/// `bytes` are refused, counted, and nothing else changes.
bool is_refused(FirmwareBench& bench, const Bytes& bytes) {
  const haptic_device before = bench.device;
  if (bench.packet(bytes)) return false;
  const haptic_device& after = bench.device;
  bool same = after.rejected == before.rejected + 1 && after.accepted == before.accepted &&
              after.tick == before.tick && after.fed_us == before.fed_us &&
              after.drive.is_on == before.drive.is_on;
  for (int k = 0; k < 3; ++k)
    same = same && after.drive.force[k] == before.drive.force[k] &&
           after.drive.torque[k] == before.drive.torque[k];
  return same;
}

/// Judged in long double, which holds every such square without rounding that counts.
bool is_shortened(const std::array<std::int32_t, 3>& asked, const std::int32_t (&got)[3],
                  unsigned driven, std::uint32_t limit) {
  long double norm = 0, got_norm = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const long double x = (driven >> k & 1u) != 0 ? asked[k] : 0;
    norm += x * x;
    got_norm += static_cast<long double>(got[k]) * got[k];
  }
  norm = std::sqrt(norm);
  if (got_norm > static_cast<long double>(limit) * limit) return false;
  const long double factor = norm > limit ? limit / norm : 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const long double exact = (driven >> k & 1u) != 0 ? asked[k] * factor : 0;
    if (std::abs(exact - got[k]) > (norm > limit ? 2 : 0)) return false;
  }
  return true;
}

}  // namespace

TEST_SUITE("hal.reference_device") {
  TEST_CASE("examples of PROTOCOL.md: block, report and command byte for byte") {
    FirmwareBench bench;
    Bytes block(HAPTIC_BLOCK_BYTES);
    REQUIRE(haptic_device_answer(&bench.device, 0xc1, 1, 1, block.data(), block.size()) == 64);
    CHECK(block == bytes_in("hex block"));

    bench.sample = {};
    bench.sample.orientation[2] = bench.sample.orientation[3] = 759250125;
    bench.sample.is_calibrated = 1;
    for (std::uint32_t k = 0; k < 1000; ++k) bench.period();
    bench.sequence = 39;
    REQUIRE(bench.command(false));
    ReferenceCommand last{true, 41, 41, {}, {}};
    Bytes packet(kReferenceCommandBytes);
    encode(last, std::span<std::uint8_t, kReferenceCommandBytes>(packet));
    REQUIRE(bench.packet(packet));
    haptic_sample& s = bench.sample;
    s.time_us = 1'000'000;
    const std::int32_t position[] = {12'345'678, -4'000'000, 30'000'000};
    const std::int32_t velocity[] = {100'000, 0, -50'000}, turn[] = {0, 0, 1'000'000};
    for (int k = 0; k < 3; ++k) {
      s.position_nm[k] = position[k];
      s.velocity_um_per_s[k] = velocity[k];
      s.angular_velocity_urad_per_s[k] = turn[k];
    }
    s.switches = 1;
    Bytes report(HAPTIC_REPORT_BYTES);
    REQUIRE(haptic_device_period(&bench.device, &s, report.data(), report.size()) == 96);
    CHECK(report == bytes_in("hex report"));

    REQUIRE(bench.packet(bytes_in("hex command")));
    s.time_us += 1000;  // the drives have been on for two periods
    REQUIRE(haptic_device_period(&bench.device, &s, report.data(), report.size()) == 96);
    const std::int32_t force[] = {150'000, -25'000, 300'000}, torque[] = {100'000, 0, -200'000};
    for (int k = 0; k < 3; ++k) {
      CHECK(bench.drive().force[k] == force[k]);
      CHECK(bench.drive().torque[k] == torque[k]);
    }
  }

  TEST_CASE("report: too little room writes nothing, the sample is taken all the same") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    bench.sample.stop_is_pressed = 1;
    std::array<std::uint8_t, 95> small{};
    CHECK(haptic_device_period(&bench.device, &bench.sample, small.data(), small.size()) == 0);
    CHECK(small == std::array<std::uint8_t, 95>{});
    CHECK(bench.is_off());
  }

  TEST_CASE("report: a device that senses no velocity sends zeros and says so") {
    haptic_facts facts = example_facts();
    facts.twist_sensed = 0;
    FirmwareBench bench(facts);
    bench.sample.velocity_um_per_s[1] = bench.sample.angular_velocity_urad_per_s[2] = 77;
    const ReferenceReport report = bench.period();
    CHECK((report.status & kReferenceTwistValid) == 0);
    CHECK(report.velocity == std::array<std::int32_t, 3>{});
    CHECK(report.angular_velocity == std::array<std::int32_t, 3>{});
  }

  TEST_CASE("block: any other request and too little room stall") {
    FirmwareBench bench;
    std::array<std::uint8_t, 64> room{};
    const auto asked = [&](unsigned type, unsigned request, unsigned value, std::size_t size) {
      return haptic_device_answer(&bench.device, static_cast<std::uint8_t>(type),
                                  static_cast<std::uint8_t>(request),
                                  static_cast<std::uint16_t>(value), room.data(), size);
    };
    CHECK(asked(0xc1, 1, 1, 64) == 64);
    CHECK(asked(0xc1, 1, 1, 63) < 0);
    CHECK(asked(0xc1, 2, 1, 64) < 0);
    CHECK(asked(0xc1, 1, 0, 64) < 0);
    CHECK(asked(0xc1, 1, 2, 64) < 0);
    CHECK(asked(0x41, 1, 1, 64) < 0);
    CHECK(asked(0xc0, 1, 1, 64) < 0);
  }

  TEST_CASE("command: each of its 448 bits flipped is refused and counted, nothing else changes") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    const Bytes good = command_bytes(bench.sequence + 1, true, {1, 2, 3}, {4, 5, 6});
    int refused = 0;
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Bytes damaged = good;
      damaged[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      refused += is_refused(bench, damaged) ? 1 : 0;
    }
    CHECK(refused == 448);
    const ReferenceReport report = bench.period();
    CHECK(report.rejected == 448);
    CHECK(report.accepted_sequence == 2);
    CHECK(report.accepted_tick == 1002);
    CHECK(bench.packet(good));
  }

  TEST_CASE("command: with a right check sum, wrong magic, version, reserved bits and bytes") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    const Bytes good = command_bytes(bench.sequence + 1, true);
    std::vector<std::size_t> meaningless = {0, 1, 2};
    for (std::size_t k = 36; k < 52; ++k) meaningless.push_back(k);
    for (const std::size_t at : meaningless) {
      for (unsigned bit = 0; bit < 8; ++bit) {
        Bytes wrong = good;
        wrong[at] ^= static_cast<std::uint8_t>(1u << bit);
        seal(wrong);
        CHECK(is_refused(bench, wrong));
      }
    }
    for (unsigned bit = 1; bit < 8; ++bit) {
      Bytes wrong = good;
      wrong[3] ^= static_cast<std::uint8_t>(1u << bit);
      seal(wrong);
      CHECK(is_refused(bench, wrong));
    }
    for (std::size_t length = 0; length <= 112; ++length) {
      Bytes wrong = good;
      wrong.resize(length);
      if (length != 56) CHECK(is_refused(bench, wrong));
      if (length < 4 || length == 56) continue;
      seal(wrong);
      CHECK(is_refused(bench, wrong));
    }
  }

  TEST_CASE("sequence: twice is refused, the wrap is not, nor what lies half the range ahead") {
    FirmwareBench bench;
    bench.period();
    for (const std::uint32_t next : {0x7fff'ffffu, 0xffff'fffeu, 0xffff'ffffu, 0u})
      CHECK(bench.packet(command_bytes(next, false)));
    for (const std::uint32_t old : {0xffff'ffffu, 0u, 0x8000'0000u, 0x8000'0001u})
      CHECK(is_refused(bench, command_bytes(old, false)));
    CHECK(bench.packet(command_bytes(0x7fff'ffffu, false)));
    const ReferenceReport report = bench.period();
    CHECK(report.rejected == 4);
    CHECK(report.accepted_sequence == 0x7fff'ffffu);
    FirmwareBench fresh;
    CHECK(is_refused(fresh, command_bytes(0, false)));  // 0 is the last one accepted at power-up
  }

  TEST_CASE("power-up: no drives before a sample that is calibrated and a command without them") {
    FirmwareBench bench;
    CHECK(bench.command(false));
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.is_off());  // no sample yet
    bench.sample.is_calibrated = 0;
    CHECK(bench.period().status == kReferenceTwistValid);
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.is_off());

    FirmwareBench again;
    CHECK(again.period().sequence == 0);
    for (int k = 0; k < 3; ++k) CHECK(again.command(true, {1, 0, 0}));
    CHECK(again.is_off());
    CHECK(again.command(false));
    CHECK(again.command(true, {1, 0, 0}));
    CHECK((again.period().status & kReferenceDrivesOn) != 0);
    CHECK(again.drive().force[0] == 1);
  }

  TEST_CASE(
      "watchdog: cuts after its time, rejected commands do not feed it, bit 0 clear ends it") {
    for (const bool noise : {false, true}) {
      CAPTURE(noise);
      FirmwareBench bench;
      bench.period();
      bench.push();
      const Bytes replayed = command_bytes(bench.sequence, true, {1, 0, 0});
      for (int k = 1; k < 20; ++k) {
        if (noise) CHECK(is_refused(bench, replayed));
        CHECK(bench.period().status ==
              (kReferenceCalibrated | kReferenceDrivesOn | kReferenceTwistValid));
      }
      ReferenceReport report = bench.period();
      CHECK(bench.is_off());
      CHECK(report.status == (kReferenceCalibrated | kReferenceTwistValid | kReferenceWatchdogCut));
      CHECK(report.faults == HAPTIC_FAULT_CUT);
      CHECK(bench.command(true, {1, 0, 0}));
      CHECK(bench.is_off());
      CHECK((bench.period().status & kReferenceWatchdogCut) != 0);
      CHECK(bench.command(false));
      report = bench.period();
      CHECK(report.status == (kReferenceCalibrated | kReferenceTwistValid));
      CHECK(report.faults == 0);
      CHECK(bench.command(true, {1, 0, 0}));
      bench.period();
      CHECK(bench.drive().force[0] == 1);
    }
  }

  TEST_CASE("watchdog: a command stamped after the sample is no cut, a clock that jumps is one") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    const Bytes later = command_bytes(++bench.sequence, true, {1, 0, 0});
    REQUIRE(haptic_device_command(&bench.device, later.data(), later.size(),
                                  bench.sample.time_us + 1400) == 1);
    CHECK((bench.period().status & kReferenceDrivesOn) != 0);
    bench.sample.time_us -= 500'000;
    CHECK((bench.period().status & kReferenceWatchdogCut) != 0);
    CHECK(bench.is_off());
  }

  TEST_CASE("watchdog: does not run with the drives off") {
    FirmwareBench bench;
    bench.period();
    REQUIRE(bench.command(false));
    for (int k = 0; k < 100; ++k) CHECK(bench.period().faults == 0);
  }

  TEST_CASE("emergency stop: off while pressed, and until a command with bit 0 clear") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    bench.sample.stop_is_pressed = 1;
    ReferenceReport report = bench.period();
    CHECK(bench.is_off());
    CHECK((report.status & kReferenceEmergencyStop) != 0);
    CHECK(report.faults == HAPTIC_FAULT_STOP);
    CHECK(bench.command(false));  // acknowledges nothing while it is pressed
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.is_off());
    bench.sample.stop_is_pressed = 0;
    report = bench.period();
    CHECK((report.status & kReferenceEmergencyStop) != 0);
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.is_off());
    CHECK(bench.command(false));
    CHECK((bench.period().status & kReferenceEmergencyStop) == 0);
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.drive().is_on == 1);
  }

  TEST_CASE("calibration lost, a fatal fault: off with a reason, on again by the next command") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    bench.sample.is_calibrated = 0;
    ReferenceReport report = bench.period();
    CHECK(bench.is_off());
    CHECK((report.status & (kReferenceCalibrated | kReferenceDrivesOn)) == 0);
    CHECK(report.faults == HAPTIC_FAULT_NOT_HOMED);
    bench.sample.is_calibrated = 1;
    CHECK(bench.period().faults == 0);
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.drive().is_on == 1);
    bench.sample.is_fatal = 1;
    report = bench.period();
    CHECK(bench.is_off());
    CHECK(report.faults == HAPTIC_FAULT_DRIVE);
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.is_off());
    bench.sample.is_fatal = 0;
    bench.sample.faults = 0xffff'ffff;  // a board states heat and drives, the rest is not its own
    report = bench.period();
    CHECK(report.faults == (HAPTIC_FAULT_HOT | HAPTIC_FAULT_DRIVE));
    CHECK(bench.command(true, {1, 0, 0}));
    CHECK(bench.drive().is_on == 1);
  }

  TEST_CASE("bus event: off, and it acknowledges nothing") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    haptic_device_bus_event(&bench.device);
    CHECK(bench.is_off());
    CHECK((bench.period().status & kReferenceDrivesOn) == 0);
    bench.push();
    for (int k = 0; k < 20; ++k) bench.period();
    haptic_device_bus_event(&bench.device);
    CHECK((bench.period().status & kReferenceWatchdogCut) != 0);
  }

  TEST_CASE("limits: force and torque shortened as a whole, axes that are not driven left out") {
    constexpr std::uint64_t kSeed = 31'007;
    std::mt19937_64 engine(kSeed);
    const auto number = [&] {
      const std::uint64_t draw = engine();
      constexpr std::int32_t kEnds[] = {0, 1, -1, std::numeric_limits<std::int32_t>::max(),
                                        std::numeric_limits<std::int32_t>::min()};
      if (draw >> 61 == 0) return kEnds[draw % 5];
      return static_cast<std::int32_t>(static_cast<std::uint32_t>(draw)) >> (draw >> 32 & 31u);
    };
    int wrong = 0, cut = 0;
    for (int i = 0; i < 20'000; ++i) {
      haptic_facts facts = example_facts();
      facts.driven_dof = static_cast<std::uint8_t>(engine() & 0x3f);
      facts.max_force = static_cast<std::uint32_t>(engine() >> (32 + engine() % 32));
      facts.max_torque = static_cast<std::uint32_t>(engine() >> (32 + engine() % 32));
      facts.max_force_rate_mn_per_s = facts.max_torque_rate_mnm_per_s = 0;
      FirmwareBench bench(facts);
      bench.period();
      const std::array<std::int32_t, 3> force = {number(), number(), number()};
      const std::array<std::int32_t, 3> torque = {number(), number(), number()};
      bench.packet(command_bytes(1, false));
      bench.packet(command_bytes(2, true, force, torque));
      // Half of the watchdog's time, after which they give all of it; no report is asked for.
      for (int k = 0; k < 10; ++k)
        CHECK(haptic_device_period(&bench.device, &bench.sample, nullptr, 0) == 0);
      const haptic_drive& drive = bench.drive();
      cut += drive.force[0] != force[0] ? 1 : 0;
      if (drive.is_on != 1 ||
          !is_shortened(force, drive.force, facts.driven_dof, facts.max_force) ||
          !is_shortened(torque, drive.torque, facts.driven_dof >> 3u, facts.max_torque)) {
        ++wrong;
      }
    }
    CAPTURE(kSeed);
    CHECK(wrong == 0);
    CHECK(cut > 5000);
    const std::int32_t turned[3] = {707, 704, 0}, longer[3] = {601, 601, 601};
    CHECK_FALSE(is_shortened({100'000, 100'000, 0}, turned, 7, 1000));
    CHECK_FALSE(is_shortened({1000, 1000, 1000}, longer, 7, 1040));
  }

  TEST_CASE("drives on: after each way back a push begins at zero and grows at the stated rate") {
    // 12 N, 0.3 N m; where no rate is stated all of it in 10 ms.
    constexpr std::int32_t kForceStep = 200'000, kTorqueStep = 400'000;
    constexpr std::int32_t kForceShare = 120'000, kTorqueShare = 300'000;
    const auto goes_off = [](FirmwareBench& bench, int way) {
      haptic_sample& s = bench.sample;
      if (way == 1) haptic_device_bus_event(&bench.device);
      s.stop_is_pressed = way == 2;
      s.is_fatal = way == 3;
      s.is_calibrated = way != 4;
      for (int k = 0; k < (way == 5 ? 25 : 1); ++k) bench.period();
      s.stop_is_pressed = s.is_fatal = 0;
      s.is_calibrated = 1;
      bench.period();
    };
    for (const bool is_stated : {true, false}) {
      for (int way = 0; way <= 6; ++way) {  // 0: power-up, 6: by the host
        CAPTURE(is_stated);
        CAPTURE(way);
        haptic_facts facts = example_facts();
        if (!is_stated) facts.max_force_rate_mn_per_s = facts.max_torque_rate_mnm_per_s = 0;
        FirmwareBench bench(facts);
        bench.period();
        if (way > 0) {
          bench.push();
          for (int k = 0; k < 15; ++k) {
            CHECK(bench.command(true, {1'000'000, 0, 0}));
            bench.period();
          }
          CHECK(bench.drive().force[0] == 1'000'000);
          goes_off(bench, way);
          if (way != 6) CHECK(bench.is_off());
        }
        // A bus event, a fault and lost calibration need no word of the host.
        const bool comes_back = way == 1 || way == 3 || way == 4;
        if (!comes_back) CHECK(bench.command(false));
        CHECK(bench.is_off());
        const std::int32_t force = is_stated ? kForceStep : kForceShare;
        const std::int32_t torque = is_stated ? kTorqueStep : kTorqueShare;
        for (std::int32_t k = 0; k < 14; ++k) {
          const Bytes pushes =
              command_bytes(++bench.sequence, true, {0, -1'000'000, 0}, {0, 0, 2'500'000});
          CHECK(bench.packet(pushes));
          const std::int32_t most = std::min(k * force, 1'000'000);
          CHECK(bench.drive().force[1] >= -most);
          CHECK(bench.drive().force[1] <= -most + 2);
          CHECK(bench.drive().torque[2] <= std::min(k * torque, 2'500'000));
          CHECK(bench.drive().torque[2] >= std::min(k * torque, 2'500'000) - 2);
          bench.period();
        }
        CHECK(bench.drive().force[1] == -1'000'000);
        CHECK(bench.drive().torque[2] == 2'500'000);
      }
    }
  }

  TEST_CASE("drives on: a push that ends while the drives begin ends at once") {
    FirmwareBench bench;
    bench.period();
    bench.push();
    for (int k = 0; k < 2; ++k) bench.period();
    CHECK(bench.drive().force[1] == -200'000);
    CHECK(bench.command(true));
    CHECK(bench.drive().is_on == 1);
    CHECK(bench.drive().force[1] == 0);
    bench.period();
    CHECK(bench.drive().force[1] == 0);
  }

  TEST_CASE(
      "version 1.1: who asks for 128 bytes gets name, latency, gap and bit 5, no other does") {
    haptic_facts facts = example_facts();
    facts.latency_us = 400;
    facts.largest_gap_um = 70'000;
    std::copy_n("Desk arm\n", 10, facts.name);
    std::copy_n("0123456789abcdef0123456789", 24, facts.serial);  // without an end
    FirmwareBench bench(facts);
    bench.sample.gap_um = 25'000;
    bench.sample.gap_is_measured = 1;
    const auto ask = [&](std::size_t size) {
      Bytes room(size);
      const std::int32_t length =
          haptic_device_answer(&bench.device, 0xc1, 1, 1, room.data(), size);
      room.resize(static_cast<std::size_t>(std::max(length, 0)));
      return room;
    };
    const auto begins = [&] {
      CHECK(bench.command(false));
      CHECK(bench.command(true));
      return bench.period();
    };
    CHECK(bench.period().gripper == 0);  // nobody has asked
    CHECK((begins().status & kReferenceSlewing) == 0);

    ReferenceLongBlock block;
    REQUIRE(decode_either(ask(128), block) == CodecVerdict::kOk);
    CHECK(block.minor == 1);
    CHECK(block.latency_us == 400);
    CHECK(block.largest_gap_um == 70'000);
    CHECK(text_of(block.name) == "Desk arm?");
    CHECK(text_of(block.serial) == "0123456789abcdef0123456");
    CHECK(ask(255) == ask(128));
    CHECK(bench.period().gripper == 25'001);
    CHECK((begins().status & kReferenceSlewing) != 0);
    for (int k = 0; k < 7; ++k) bench.period();  // 0.3 N m at 40 N m/s take 7.5 ms
    CHECK((bench.period().status & kReferenceSlewing) == 0);
    bench.sample.gap_um = 1'000'000;
    CHECK(bench.period().gripper == 70'001);
    bench.sample.gap_is_measured = 0;
    CHECK(bench.period().gripper == 0);
    bench.sample.gap_is_measured = 1;

    for (const std::size_t size : {64u, 65u, 127u}) {
      ReferenceLongBlock old;
      REQUIRE(decode_either(ask(size), old) == CodecVerdict::kOk);
      CHECK(old.minor == 0);
      CHECK(old.first == block.first);
      CHECK(bench.period().gripper == 0);
      CHECK((begins().status & kReferenceSlewing) == 0);
    }
    (void)ask(128);
    CHECK(bench.period().gripper != 0);
    haptic_device_bus_event(&bench.device);  // another host comes
    CHECK(bench.period().gripper == 0);
    CHECK((begins().status & kReferenceSlewing) == 0);
  }

  TEST_CASE(
      "version 1.1: a full-speed board with a gripper, for either host; nothing stated is none") {
    haptic_facts facts = example_facts();
    facts.is_short = 1;
    facts.largest_gap_um = 700'000;
    FirmwareBench bench(facts);
    Bytes room(128);
    REQUIRE(haptic_device_answer(&bench.device, 0xc1, 1, 1, room.data(), 128) == 128);
    ReferenceLongBlock block;
    REQUIRE(decode(room, block) == CodecVerdict::kOk);
    CHECK(text_of(block.name).empty());
    CHECK(text_of(block.serial).empty());
    bench.sample.gap_is_measured = 1;
    const auto report_of = [&](std::uint32_t gap_um, std::size_t expected) {
      bench.sample.gap_um = gap_um;
      bench.sample.time_us += 1000;
      Bytes bytes(HAPTIC_REPORT_BYTES);
      const std::size_t size =
          haptic_device_period(&bench.device, &bench.sample, bytes.data(), bytes.size());
      CHECK(size == expected);
      bytes.resize(size);
      ReferenceReport report;
      REQUIRE(decode_either(bytes, report) == CodecVerdict::kOk);
      return report;
    };
    CHECK(report_of(0, 62).gripper == 1);
    CHECK(report_of(25'009, 62).gripper == 25'001);
    CHECK(report_of(700'000, 62).gripper == 655'341);  // the end of 16 bits
    REQUIRE(haptic_device_answer(&bench.device, 0xc1, 1, 1, room.data(), 64) == 64);
    CHECK(report_of(25'000, 60).gripper == 0);
    Bytes small(61);
    REQUIRE(haptic_device_answer(&bench.device, 0xc1, 1, 1, room.data(), 128) == 128);
    CHECK(haptic_device_period(&bench.device, &bench.sample, small.data(), small.size()) == 0);
  }
}
