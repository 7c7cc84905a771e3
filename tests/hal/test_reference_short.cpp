// SPDX-License-Identifier: Apache-2.0
/// The short report: the host's codec, the firmware in C, and the driver, against one another.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "hal/drivers/reference_short.hpp"
#include "hal/firmware/reference_device.h"
#include "tests/hal/protocol_text.hpp"
#include "tests/hal/reference_bench.hpp"

using namespace haptic::hal;
using haptic::Real;
using haptic::hal::test::AnsweringPort;

namespace {

constexpr std::uint64_t kShortReportSeed = 60'060;
using ShortBytes = std::array<std::uint8_t, kReferenceShortReportBytes>;

ShortBytes short_bytes_of(const ReferenceShortReport& report) {
  ShortBytes bytes{};
  encode(report, bytes);
  return bytes;
}

void seal_short(ShortBytes& bytes) {
  const std::uint32_t check = crc32(std::span(bytes).first(56));
  for (unsigned k = 0; k < 4; ++k) bytes[56 + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

/// A unit quaternion whose length is off by up to 1e-3; in units of 2^-30.
std::array<std::int32_t, 4> random_orientation(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  std::array<double, 4> q{normal(engine), normal(engine), normal(engine), normal(engine)};
  if (engine() % 8 == 0) q[3] *= 1e-6;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double length = 1 + 0.999e-3 * std::uniform_real_distribution<double>(-1, 1)(engine);
  std::array<std::int32_t, 4> units{};
  for (std::size_t k = 0; k < 4; ++k)
    units[k] = static_cast<std::int32_t>(std::lround(q[k] / norm * length * (1 << 30)));
  return units;
}

ReferenceShortReport random_short_report(std::mt19937_64& engine) {
  ReferenceShortReport r;
  r.status = static_cast<std::uint8_t>(engine() & kReferenceStatusBits);
  r.sequence = static_cast<std::uint32_t>(engine());
  r.time_us = static_cast<std::uint32_t>(engine());
  const std::array<std::int32_t, 4> q = random_orientation(engine);
  for (std::size_t k = 0; k < 3; ++k) {
    r.position[k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(engine()));
    r.orientation[k] = q[k];
    r.velocity[k] = static_cast<std::int16_t>(static_cast<std::uint16_t>(engine()));
    r.angular_velocity[k] = static_cast<std::int16_t>(static_cast<std::uint16_t>(engine()));
  }
  r.switches = static_cast<std::uint16_t>(engine());
  r.faults = static_cast<std::uint8_t>(engine() & kReferenceFaultBits);
  r.rejected = static_cast<std::uint8_t>(engine());
  r.accepted_sequence = static_cast<std::uint32_t>(engine());
  return r;
}

/// Angle between two orientations that are nearly unit quaternions [rad].
double angle_between(const std::array<std::int32_t, 4>& a, const std::array<std::int32_t, 4>& b) {
  double aa = 0, bb = 0, minus = 0, plus = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    aa += double{1} * a[k] * a[k];
    bb += double{1} * b[k] * b[k];
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const double x = a[k] / std::sqrt(aa), y = b[k] / std::sqrt(bb);
    minus += (x - y) * (x - y);
    plus += (x + y) * (x + y);
  }
  return 4 * std::asin(std::min(1.0, 0.5 * std::sqrt(std::min(minus, plus))));
}

/// Firmware of a full-speed board.
struct ShortFirmware {
  ShortFirmware() {
    haptic_facts facts{};
    facts.twist_sensed = facts.is_short = 1;
    facts.sensed_dof = facts.driven_dof = 0x3f;
    facts.report_period_us = 1000;
    facts.watchdog_ms = 20;
    facts.max_force = 1'200'000;
    facts.max_torque = 3'000'000;
    haptic_device_begin(&device, &facts);
    sample.orientation[3] = 1 << 30;
    sample.is_calibrated = 1;
  }
  ShortBytes period() {
    ShortBytes bytes{};
    REQUIRE(haptic_device_period(&device, &sample, bytes.data(), bytes.size()) == bytes.size());
    return bytes;
  }
  bool command(const ReferenceCommand& command) {
    std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
    encode(command, bytes);
    return haptic_device_command(&device, bytes.data(), bytes.size(), sample.time_us) == 1;
  }
  haptic_device device{};
  haptic_sample sample{};
};

}  // namespace

TEST_SUITE("hal.reference_short") {
  TEST_CASE("encode, decode: random records come back as they were") {
    CAPTURE(kShortReportSeed);
    std::mt19937_64 engine(kShortReportSeed);
    int broken = 0;
    for (int i = 0; i < 50'000; ++i) {
      const ReferenceShortReport sent = random_short_report(engine);
      ReferenceShortReport read;
      if (decode(short_bytes_of(sent), read) != CodecVerdict::kOk || !(read == sent)) ++broken;
    }
    CHECK(broken == 0);
  }

  TEST_CASE("decode: every flip of one bit and every wrong length is refused") {
    std::mt19937_64 engine(kShortReportSeed);
    const ShortBytes bytes = short_bytes_of(random_short_report(engine));
    int accepted = 0;
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      ShortBytes damaged = bytes;
      damaged[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      ReferenceReport read;
      if (decode_either(damaged, read) == CodecVerdict::kOk || !(read == ReferenceReport{}))
        ++accepted;
    }
    for (std::size_t length = 0; length <= 128; ++length) {
      std::vector<std::uint8_t> cut(bytes.begin(), bytes.end());
      cut.resize(length);
      ReferenceReport read;
      if ((decode_either(cut, read) == CodecVerdict::kOk) != (length == 60)) ++accepted;
    }
    CHECK(accepted == 0);
  }

  TEST_CASE("gripper: 62 bytes come back as they were, damaged ones do not") {
    CAPTURE(kShortReportSeed);
    std::mt19937_64 engine(kShortReportSeed);
    int broken = 0, accepted = 0;
    for (int i = 0; i < 2000; ++i) {
      ReferenceShortReport sent = random_short_report(engine);
      sent.gripper = static_cast<std::uint16_t>(engine());
      std::array<std::uint8_t, kReferenceShortGripperBytes> bytes{};
      encode(sent, bytes);
      ReferenceShortReport read;
      if (decode(bytes, read) != CodecVerdict::kOk || !(read == sent)) ++broken;
      const std::uint32_t gap = sent.gripper == 0 ? 0 : 1 + 10 * (sent.gripper - 1u);
      if (in_full(read).gripper != gap) ++broken;
      bytes[engine() % bytes.size()] ^= static_cast<std::uint8_t>(1u << engine() % 8);
      if (decode(bytes, read) == CodecVerdict::kOk) ++accepted;
      if (decode(std::span(bytes).first(61), read) != CodecVerdict::kBadLength) ++accepted;
    }
    CHECK(broken == 0);
    CHECK(accepted == 0);
  }

  TEST_CASE("decode: bytes under a right check sum are refused for what is wrong in them") {
    const ShortBytes good = short_bytes_of({});
    const auto verdict_of = [&](std::size_t at, std::uint8_t value) {
      ShortBytes bytes = good;
      bytes[at] = value;
      seal_short(bytes);
      ReferenceShortReport report;
      return decode(bytes, report);
    };
    CHECK(verdict_of(0, 0x52) == CodecVerdict::kBadMagic);
    CHECK(verdict_of(2, 2) == CodecVerdict::kBadVersion);
    CHECK(verdict_of(3, 0x40) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(50, 0x40) == CodecVerdict::kBadReserved);
    CHECK(verdict_of(27, 0x41) == CodecVerdict::kBadNumber);  // x = 1.0156
    CHECK(verdict_of(27, 0x40) == CodecVerdict::kOk);
    CHECK(verdict_of(27, 0x80) == CodecVerdict::kBadNumber);  // -2
  }

  TEST_CASE("firmware: the example of PROTOCOL.md byte for byte") {
    ShortFirmware board;
    for (int k = 0; k < 1000; ++k) board.period();
    REQUIRE(board.command({false, 40, 0, {}, {}}));
    REQUIRE(board.command({true, 41, 0, {}, {}}));
    haptic_sample& s = board.sample;
    s.time_us = 1'000'000;
    board.device.fed_us = s.time_us;
    const std::int32_t position[] = {12'345'678, -4'000'000, 30'000'000};
    const std::int32_t velocity[] = {100'000, 0, -50'000}, turn[] = {0, 0, 1'000'000};
    for (int k = 0; k < 3; ++k) {
      s.position_nm[k] = position[k];
      s.velocity_um_per_s[k] = velocity[k];
      s.angular_velocity_urad_per_s[k] = turn[k];
    }
    s.orientation[2] = s.orientation[3] = 759'250'125;
    s.switches = 1;
    const ShortBytes bytes = board.period();
    const std::vector<std::uint8_t> expected = haptic::hal::test::bytes_in("hex short-report");
    CHECK(std::vector<std::uint8_t>(bytes.begin(), bytes.end()) == expected);
  }

  TEST_CASE("firmware: in full, a short report is the sample to its own steps") {
    CAPTURE(kShortReportSeed);
    std::mt19937_64 engine(kShortReportSeed);
    ShortFirmware board;
    int wrong = 0;
    double largest_angle_rad = 0, largest_near_half_rad = 0;
    const auto near_step = [](std::int32_t got, std::int32_t sent, std::int32_t step) {
      const double most = 32767.0 * step;
      const double exact = std::clamp(static_cast<double>(sent), -most, most);
      return std::abs(got - exact) <= 0.5 * step;
    };
    for (int i = 0; i < 50'000; ++i) {
      const std::array<std::int32_t, 4> q = random_orientation(engine);
      const auto shift = static_cast<unsigned>(engine() % 24);
      for (std::size_t k = 0; k < 4; ++k) board.sample.orientation[k] = q[k];
      for (int k = 0; k < 3; ++k) {
        const auto draw = [&] {
          return static_cast<std::int32_t>(engine() & 0xffff'ffffu) >> shift;
        };
        board.sample.position_nm[k] = draw();
        board.sample.velocity_um_per_s[k] = draw();
        board.sample.angular_velocity_urad_per_s[k] = draw();
      }
      board.sample.switches = static_cast<std::uint32_t>(engine());
      ReferenceReport read;
      if (decode_either(board.period(), read) != CodecVerdict::kOk) {
        ++wrong;
        continue;
      }
      const bool near_half = std::abs(q[3]) < (1 << 17);
      double& largest = near_half ? largest_near_half_rad : largest_angle_rad;
      largest = std::max(largest, angle_between(read.orientation, q));
      for (std::size_t k = 0; k < 3; ++k) {
        if (read.position[k] != board.sample.position_nm[k] ||
            !near_step(read.velocity[k], board.sample.velocity_um_per_s[k], 100) ||
            !near_step(read.angular_velocity[k], board.sample.angular_velocity_urad_per_s[k],
                       1000)) {
          ++wrong;
        }
      }
      if (read.switches != (board.sample.switches & 0xffffu) || read.orientation[3] < 0) ++wrong;
    }
    CHECK(wrong == 0);
    CHECK(largest_angle_rad < 3e-5);
    CHECK(largest_near_half_rad < 1.2e-4);
    CHECK(largest_near_half_rad > 0);
  }

  TEST_CASE("firmware: no orientation is sent as one that the host refuses") {
    ShortFirmware board;
    const std::int32_t wrong[][4] = {{0, 0, 0, 0},
                                     {0, 0, 0, (1 << 30) + (1 << 21)},
                                     {0, 0, 0, (1 << 30) - (1 << 21)},
                                     {INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN}};
    for (const auto& q : wrong) {
      for (int k = 0; k < 4; ++k) board.sample.orientation[k] = q[k];
      ReferenceReport read;
      CHECK(decode_either(board.period(), read) == CodecVerdict::kBadNumber);
    }
  }

  TEST_CASE("driver: a short report gives the state of the long one, and force passes") {
    ShortFirmware board;
    AnsweringPort port;
    ReferenceDriver driver;
    REQUIRE(driver.start(port) == HalStatus::kOk);
    haptic::Wrench asked, delivered;
    haptic::DeviceState state;
    for (int k = 0; k < 10; ++k) {
      board.sample.time_us += 1000;
      board.sample.position_nm[1] = 5'000'000;
      board.sample.velocity_um_per_s[0] = 12'340;
      REQUIRE(driver.read(board.period(), 0, state) == ReportVerdict::kState);
      asked.force_w.x() = k < 6 ? Real{0} : Real{2};
      std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
      REQUIRE(driver.write(asked, 1, bytes, delivered) == bytes.size());
      REQUIRE(haptic_device_command(&board.device, bytes.data(), bytes.size(),
                                    board.sample.time_us) == 1);
    }
    CHECK(state.link == haptic::LinkState::kReady);
    CHECK(static_cast<double>(state.pose_dh.p_m[1]) == doctest::Approx(0.005));
    CHECK(static_cast<double>(state.twist_d.linear_m_per_s[0]) == doctest::Approx(0.0123));
    CHECK(static_cast<double>(delivered.force_w.x()) == doctest::Approx(2));
    CHECK(haptic_device_drive(&board.device)->force[0] == 200'000);
    // 256 refusals look like none in eight bits; one does not.
    const ReferenceCommand old{true, 1, 0, {}, {}};
    CHECK_FALSE(board.command(old));
    board.sample.time_us += 1000;
    REQUIRE(driver.read(board.period(), 0, state) == ReportVerdict::kState);
    CHECK((state.faults & haptic::kDeviceRefused) != 0);
  }
}
