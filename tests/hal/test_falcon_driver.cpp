// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/falcon_firmware.hpp"
#include "tests/hal/falcon_counterpart.hpp"
#include "tests/support/rt_guard.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::FalconCounterpart;

namespace {

constexpr std::uint64_t kFalconDriverSeed = 9105;
constexpr std::size_t kImageBytes = 5003;  // not a multiple of a block

/// A file of seeded bytes; removed at the end.
class TestImage {
 public:
  explicit TestImage(std::size_t size) {
    char name[] = "/tmp/falcon_image_XXXXXX";
    const int file = ::mkstemp(name);
    REQUIRE(file >= 0);
    ::close(file);
    path = name;
    std::mt19937_64 random(kFalconDriverSeed);
    for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(random()));
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  ~TestImage() { std::remove(path.c_str()); }
  TestImage(const TestImage&) = delete;
  TestImage& operator=(const TestImage&) = delete;

  std::string path;
  std::vector<std::uint8_t> bytes;
};

FalconSettings settings_with(const std::string& path) {
  FalconSettings settings;
  settings.firmware_path = path;
  settings.accept_unknown_firmware = true;
  return settings;
}

/// One exchange in lock-step: the driver's report out, then packets in until a state or `packets`.
ReportVerdict exchange(FalconDriver& driver, FalconCounterpart& device, const Vec3& force,
                       DeviceState& state, Wrench& delivered, int packets = 20) {
  std::array<std::uint8_t, 64> bytes{};
  Wrench wrench;
  wrench.force_w = force;
  REQUIRE(driver.write(wrench, 1, bytes, delivered) == kFalconPacketBytes);
  device.on_out(std::span(bytes).first(kFalconPacketBytes));
  ReportVerdict verdict = ReportVerdict::kNothing;
  for (int i = 0; i < packets && verdict == ReportVerdict::kNothing; ++i) {
    const std::size_t count = device.on_in(bytes);
    verdict = driver.read(std::span(bytes).first(count), 0, state);
  }
  return verdict;
}

}  // namespace

TEST_SUITE("hal.falcon_driver") {
  TEST_CASE("capabilities: usable; up is z of the scene, towards the operator is -y") {
    const DeviceCapabilities c = falcon_capabilities();
    CHECK(check_capabilities(c) == HalStatus::kOk);
    CHECK(c.watchdog_ns == 0);
    CHECK((c.q_wd * Vec3(1, 0, 0) - Vec3(1, 0, 0)).norm() < 1e-6);
    CHECK((c.q_wd * Vec3(0, 1, 0) - Vec3(0, 0, 1)).norm() < 1e-6);
    CHECK((c.q_wd * Vec3(0, 0, 1) - Vec3(0, -1, 0)).norm() < 1e-6);
  }

  TEST_CASE("start: loads the named image byte for byte, then the firmware runs") {
    const TestImage image(kImageBytes);
    for (const bool zero : {false, true}) {
      for (const std::size_t payload : {std::size_t{62}, std::size_t{5}, std::size_t{1}}) {
        FalconCounterpart device(kImageBytes);
        device.faults.leading_zero = zero;
        device.faults.deaf_greetings = 7;
        device.in_payload = payload;
        FalconDriver driver(settings_with(image.path));
        CHECK(driver.start(device) == HalStatus::kOk);
        CHECK(device.runs());
        CHECK(device.image() == image.bytes);
      }
    }
  }

  TEST_CASE("start: a device whose firmware runs already needs no file") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    FalconDriver driver(settings_with(""));
    CHECK(driver.start(device) == HalStatus::kOk);
    CHECK(device.loads() == 0);
    CHECK(device.last_command().motors == std::array<std::int16_t, 3>{});
    CHECK(device.last_command().homing);
  }

  TEST_CASE("start: a file that is no image is reported, and nothing is loaded") {
    const TestImage small(kFalconLeastImageBytes - 1), large(kFalconMostImageBytes + 1);
    for (const std::string& path :
         {std::string(), std::string("/nonexistent/image.bin"), std::string("/tmp"),
          std::string("/dev/zero"), small.path, large.path}) {
      FalconCounterpart device(kImageBytes);
      FalconDriver driver(settings_with(path));
      CAPTURE(path);
      CHECK(driver.start(device) == HalStatus::kBadFirmwareFile);
      CHECK(device.loads() == 0);
    }
  }

  TEST_CASE("start: an image is loaded only if its hash is known, or any is accepted") {
    const TestImage image(kImageBytes);
    Sha256 hash;
    hash.add(image.bytes);
    const Sha256Digest right = hash.finish();
    Sha256Digest wrong = right;
    wrong[31] ^= 1;
    struct Case {
      std::vector<Sha256Digest> known;
      bool accept_unknown;
      HalStatus status;
    };
    for (const Case& c : {Case{{}, false, HalStatus::kUnknownFirmwareFile},
                          {{wrong}, false, HalStatus::kUnknownFirmwareFile},
                          {{wrong, right}, false, HalStatus::kOk},
                          {{}, true, HalStatus::kOk}}) {
      FalconSettings settings;
      settings.firmware_path = image.path;
      settings.known_firmware = c.known;
      settings.accept_unknown_firmware = c.accept_unknown;
      FalconDriver driver(settings);
      FalconCounterpart device(kImageBytes);
      CHECK(driver.start(device) == c.status);
      CHECK(device.loads() == (c.status == HalStatus::kOk ? 1 : 0));
    }
  }

  TEST_CASE("start: a wrong, missing or cut echo fails after the stated number of loads") {
    const TestImage image(kImageBytes);
    FalconSettings settings = settings_with(image.path);
    settings.load_attempts = 3;
    for (const long at : {0L, 61L, 62L, 2500L, long{kImageBytes} - 1}) {
      for (const bool silent : {false, true}) {
        FalconCounterpart device(kImageBytes);
        (silent ? device.faults.silent_echo_at : device.faults.wrong_echo_at) = at;
        FalconDriver driver(settings);
        CAPTURE(at);
        CAPTURE(silent);
        CHECK(driver.start(device) == HalStatus::kStartFailed);
        // A device that had the last byte all the same runs already and is no loader any more.
        CHECK(device.loads() == (at == long{kImageBytes} - 1 && !silent ? 1 : 3));
      }
    }
    FalconCounterpart repaired(kImageBytes);
    repaired.faults.wrong_echo_at = 100;
    repaired.faults.bad_loads = 2;
    FalconDriver driver(settings);
    CHECK(driver.start(repaired) == HalStatus::kOk);
    CHECK(repaired.loads() == 3);
    CHECK(repaired.image() == image.bytes);
  }

  TEST_CASE(
      "start: loaders that do not answer, and firmware that does not run, end in kStartFailed") {
    const TestImage image(kImageBytes);
    const auto status_with = [&image](const haptic::test::FalconFaults& faults) {
      FalconCounterpart device(kImageBytes);
      device.faults = faults;
      FalconDriver driver(settings_with(image.path));
      return driver.start(device);
    };
    haptic::test::FalconFaults faults;
    faults.silent = true;
    CHECK(status_with(faults) == HalStatus::kStartFailed);
    faults = {};
    faults.wrong_greeting = true;
    CHECK(status_with(faults) == HalStatus::kStartFailed);
    faults = {};
    faults.deaf_greetings = 1000;
    CHECK(status_with(faults) == HalStatus::kStartFailed);
    faults = {};
    faults.firmware_dead = true;
    CHECK(status_with(faults) == HalStatus::kStartFailed);
  }

  TEST_CASE("start: unplugged or cancelled at any call, it says so and returns") {
    const TestImage image(kImageBytes);
    for (int calls = 0; calls < 230; ++calls) {
      FalconCounterpart unplugged(kImageBytes), stopped(kImageBytes);
      unplugged.faults.gone_after_calls = calls;
      stopped.faults.cancelled_after_calls = calls;
      FalconDriver driver(settings_with(image.path));
      CAPTURE(calls);
      REQUIRE(driver.start(unplugged) == HalStatus::kDeviceGone);
      REQUIRE(driver.start(stopped) == HalStatus::kTimeout);
    }
  }

  TEST_CASE("read: not ready and no force until all three encoders are homed") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    device.home_after = 60;
    REQUIRE(device.move_to({0.01, -0.02, 0.16}));
    FalconDriver driver(settings_with(""));
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    Wrench delivered;
    int exchanges = 0;
    while (state.link != LinkState::kReady && exchanges < 100) {
      REQUIRE(exchange(driver, device, Vec3(0, 0, 3), state, delivered) == ReportVerdict::kState);
      ++exchanges;
      CHECK(delivered.force_w.isZero());
      CHECK(device.last_command().motors == std::array<std::int16_t, 3>{});
      CHECK(device.last_command().homing);
      CHECK(state.faults == 0);
    }
    CHECK(exchanges == 59);  // the probe in start() was the first
    CHECK(state.pose_dh.p_m[0] == doctest::Approx(0.01).epsilon(0.01));
    CHECK(state.pose_dh.p_m[1] == doctest::Approx(-0.02).epsilon(0.01));
    CHECK(state.pose_dh.p_m[2] == doctest::Approx(0.01).epsilon(0.01));
    REQUIRE(exchange(driver, device, Vec3(0, 0, 3), state, delivered) == ReportVerdict::kState);
    CHECK(!device.last_command().homing);
    CHECK(delivered.force_w.z() == doctest::Approx(3).epsilon(0.01));

    device.lose_homing();  // a brown-out: the force ends with the report that says so
    REQUIRE(exchange(driver, device, Vec3(0, 0, 3), state, delivered) == ReportVerdict::kState);
    CHECK(state.link == LinkState::kStarting);
    CHECK(state.faults == kDeviceNotHomed);
    REQUIRE(exchange(driver, device, Vec3(0, 0, 3), state, delivered) == ReportVerdict::kState);
    CHECK(delivered.force_w.isZero());
    CHECK(device.last_command().motors == std::array<std::int16_t, 3>{});
  }

  TEST_CASE("read: follows the handle over its workspace, however packets are cut") {
    std::mt19937_64 random(kFalconDriverSeed);
    CAPTURE(kFalconDriverSeed);
    for (const std::size_t payload : {std::size_t{62}, std::size_t{16}, std::size_t{7}}) {
      FalconCounterpart device(kImageBytes);
      device.power_up_loaded();
      device.in_payload = payload;
      FalconDriver driver(settings_with(""));
      REQUIRE(driver.start(device) == HalStatus::kOk);
      DeviceState state;
      Wrench delivered;
      for (int i = 0; i < 2000; ++i) {
        const double angle = 0.01 * i;
        const Column3 p(0.025 * std::cos(3 * angle), 0.025 * std::sin(2 * angle),
                        kFalconCentre_m + 0.02 * std::sin(angle));
        REQUIRE(device.move_to(p));
        device.buttons = static_cast<std::uint8_t>(i & 0xf);
        REQUIRE(exchange(driver, device, Vec3::Zero(), state, delivered) == ReportVerdict::kState);
        REQUIRE(state.link == LinkState::kReady);
        REQUIRE(state.switches == static_cast<std::uint32_t>(i & 0xf));
        const Vec3 expected(static_cast<Real>(p.x()), static_cast<Real>(p.y()),
                            static_cast<Real>(p.z() - kFalconCentre_m));
        REQUIRE((vec3_of(state.pose_dh.p_m) - expected).norm() < 60e-6);  // half a count per leg
      }
    }
  }

  TEST_CASE("read: lengths, status-only packets, broken packets and impossible counts") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    FalconDriver driver(settings_with(""));
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    const std::vector<std::uint8_t> status{0x01, 0x60};
    CHECK(driver.read({}, 0, state) == ReportVerdict::kBadLength);
    CHECK(driver.read(std::span(status).first(1), 0, state) == ReportVerdict::kBadLength);
    CHECK(driver.read(std::vector<std::uint8_t>(129), 0, state) == ReportVerdict::kBadLength);
    CHECK(driver.read(status, 0, state) == ReportVerdict::kNothing);

    const auto packet_with = [&status](const FalconReport& report) {
      std::vector<std::uint8_t> bytes = status;
      const FalconPacket packet = encode(report);
      bytes.insert(bytes.end(), packet.begin(), packet.end());
      return bytes;
    };
    FalconReport report;
    report.homed = 7;
    report.counts = {300, 300, 300};
    std::vector<std::uint8_t> wrong = packet_with(report);
    wrong[5] = 0x60;  // no nibble
    CHECK(driver.read(wrong, 0, state) == ReportVerdict::kBadCheck);
    CHECK(state.link == LinkState::kAbsent);
    REQUIRE(driver.read(packet_with(report), 0, state) == ReportVerdict::kState);
    const DeviceState good = state;
    FalconReport impossible = report;
    impossible.counts = {-30000, 30000, 300};
    std::array<std::uint8_t, 16> out{};
    Wrench wrench, delivered;
    wrench.force_w = Vec3(1, 0, 0);
    for (int i = 0; i < 3; ++i) {
      CHECK(driver.read(packet_with(impossible), 0, state) == ReportVerdict::kBadNumber);
      CHECK(state.pose_dh.p_m[2] == good.pose_dh.p_m[2]);
    }
    REQUIRE(driver.write(wrench, 1, out, delivered) == 16);
    CHECK(delivered.force_w.isZero());  // where it is is not known any more
    CHECK(driver.read(packet_with(report), 0, state) == ReportVerdict::kState);
    CHECK(state.pose_dh.p_m[2] == doctest::Approx(good.pose_dh.p_m[2]).epsilon(1e-6));
    // Two packets in one transfer: the later one counts.
    std::vector<std::uint8_t> two = packet_with(impossible);
    const std::vector<std::uint8_t> second = packet_with(report);
    two.insert(two.end(), second.begin() + 2, second.end());
    CHECK(driver.read(two, 0, state) == ReportVerdict::kState);
  }

  TEST_CASE("write: delivers the force to its resolution, and cuts it with its direction kept") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    FalconDriver driver(settings_with(""));
    REQUIRE(driver.start(device) == HalStatus::kOk);
    std::mt19937_64 random(kFalconDriverSeed);
    CAPTURE(kFalconDriverSeed);
    const auto uniform = [&random](double lo, double hi) {
      return static_cast<Real>(lo + (hi - lo) * static_cast<double>(random() >> 11) * 0x1.0p-53);
    };
    DeviceState state;
    Wrench delivered;
    int cut = 0;
    for (int i = 0; i < 2000; ++i) {
      REQUIRE(device.move_to({static_cast<double>(uniform(-0.025, 0.025)),
                              static_cast<double>(uniform(-0.025, 0.025)),
                              static_cast<double>(uniform(0.135, 0.165))}));
      REQUIRE(exchange(driver, device, Vec3::Zero(), state, delivered) == ReportVerdict::kState);
      const Real size = i % 3 == 0 ? 40.0_r : 2.0_r;
      const Vec3 force(uniform(-1, 1) * size, uniform(-1, 1) * size, uniform(-1, 1) * size);
      REQUIRE(exchange(driver, device, force, state, delivered) == ReportVerdict::kState);
      int largest = 0;
      for (const std::int16_t motor : device.last_command().motors) {
        largest = std::max(largest, std::abs(int{motor}));
      }
      REQUIRE(largest <= kFalconMaxMotor);
      if (largest < kFalconMaxMotor) {
        // Half a unit of each motor is 0.05 mN m at a thigh.
        REQUIRE((delivered.force_w - force).norm() < 0.005_r);
      } else {
        ++cut;
        REQUIRE(delivered.force_w.norm() <= force.norm() + 0.005_r);
        REQUIRE(delivered.force_w.normalized().dot(force.normalized()) > 1 - 1e-5_r);
      }
    }
    CHECK(cut > 100);
  }

  TEST_CASE("write: what is not a number is no force; a buffer too small gets nothing") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    FalconDriver driver(settings_with(""));
    REQUIRE(driver.start(device) == HalStatus::kOk);
    DeviceState state;
    Wrench delivered;
    REQUIRE(exchange(driver, device, Vec3::Zero(), state, delivered) == ReportVerdict::kState);
    const Real nan = std::numeric_limits<Real>::quiet_NaN();
    const Real inf = std::numeric_limits<Real>::infinity();
    for (const Vec3& force : {Vec3(nan, 0, 0), Vec3(0, inf, 1), Vec3(0, 0, -inf)}) {
      REQUIRE(exchange(driver, device, force, state, delivered) == ReportVerdict::kState);
      CHECK(delivered.force_w.isZero());
      CHECK(device.last_command().motors == std::array<std::int16_t, 3>{});
    }
    std::array<std::uint8_t, 15> small{};
    CHECK(driver.write(Wrench{}, 1, small, delivered) == 0);
  }

  TEST_CASE("read and write: no heap calls") {
    FalconCounterpart device(kImageBytes);
    device.power_up_loaded();
    FalconDriver driver(settings_with(""));
    REQUIRE(driver.start(device) == HalStatus::kOk);
    std::vector<std::uint8_t> bytes{0x01, 0x60};
    FalconReport report;
    report.homed = 7;
    const FalconPacket packet = encode(report);
    bytes.insert(bytes.end(), packet.begin(), packet.end());
    std::array<std::uint8_t, 16> out{};
    Wrench wrench, delivered;
    wrench.force_w = Vec3(1, 2, 3);
    DeviceState state;
    ReportVerdict verdict;
    std::size_t written;
    std::uint64_t calls;
    {
      const haptic::test::RtGuard guard;
      verdict = driver.read(bytes, 0, state);
      written = driver.write(wrench, 1, out, delivered);
      calls = guard.heap_calls();
    }
    CHECK(verdict == ReportVerdict::kState);
    CHECK(written == 16);
    CHECK(calls == 0);
  }
}
