// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <random>

#include "hal/drivers/reference_driver.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::uint64_t kSeed = 77'003;

/// A control pipe that answers as it is told.
class AnsweringPort : public UsbPort {
 public:
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned timeout_ms) noexcept override {
    ++asked;
    last = request;
    last_timeout_ms = timeout_ms;
    if (status != HalStatus::kOk) return status;
    std::array<std::uint8_t, kReferenceBlockBytes> answer{};
    encode(block, answer);
    if (damaged_answers > 0) {
      --damaged_answers;
      answer[20] ^= 1;
    }
    moved = std::min({answer.size(), bytes.size(), longest});
    std::copy_n(answer.begin(), moved, bytes.begin());
    return HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return stop; }

  ReferenceBlock block;
  HalStatus status = HalStatus::kOk;
  std::size_t longest = 64;
  int damaged_answers = 0;
  int asked = 0;
  bool stop = false;
  ControlRequest last;
  unsigned last_timeout_ms = 0;
};

/// A device of sections 7 to 9 of the protocol, without mechanics.
class Bench {
 public:
  Bench() { REQUIRE(driver.start(port) == HalStatus::kOk); }

  /// Next report of the device into the driver.
  ReportVerdict report() {
    ++device.sequence;
    unset(kReferenceDrivesOn);
    if (drives_on) set(kReferenceDrivesOn);
    return repeat_report();
  }
  ReportVerdict repeat_report() {
    std::array<std::uint8_t, kReferenceReportBytes> bytes{};
    encode(device, bytes);
    return driver.read(bytes, 0, state);
  }
  /// The driver's answer, taken by the device.
  std::size_t command(const Wrench& wrench) {
    std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
    const std::size_t length = driver.write(wrench, ++tick, bytes, delivered);
    if (length == 0) return 0;
    REQUIRE(decode(std::span(bytes).first(length), sent) == CodecVerdict::kOk);
    on_the_way.push_back(sent);
    if (on_the_way.size() <= latency) return length;
    accept(on_the_way.front());
    on_the_way.pop_front();
    return length;
  }
  void accept(const ReferenceCommand& taken) {
    if (!is_newer(taken.sequence, device.accepted_sequence)) {
      ++device.rejected;
      return;
    }
    device.accepted_sequence = taken.sequence;
    device.accepted_tick = taken.tick;
    if (!taken.drives_on) {
      drives_on = false;
      unset(kReferenceWatchdogCut);
      if (!pressed) unset(kReferenceEmergencyStop);
    } else if ((device.status & (kReferenceWatchdogCut | kReferenceEmergencyStop)) == 0 &&
               (device.status & kReferenceCalibrated) != 0) {
      drives_on = true;
    }
  }
  void set(ReferenceStatusBit bit) {
    device.status = static_cast<std::uint8_t>(device.status | bit);
    if (bit == kReferenceWatchdogCut || bit == kReferenceEmergencyStop) drives_on = false;
  }
  void unset(ReferenceStatusBit bit) {
    device.status = static_cast<std::uint8_t>(device.status & ~unsigned{bit});
  }
  /// Calibrated, drives confirmed, wrenches passed on.
  void bring_up() {
    set(kReferenceCalibrated);
    for (std::size_t k = 0; k < 4 + latency; ++k) {
      REQUIRE(report() == ReportVerdict::kState);
      REQUIRE(command({}) == kReferenceCommandBytes);
    }
  }

  AnsweringPort port;
  ReferenceDriver driver;
  ReferenceReport device;
  bool drives_on = false, pressed = false;
  DeviceState state;
  ReferenceCommand sent;
  Wrench delivered;
  std::uint64_t tick = 0;
  std::size_t latency = 0;  ///< commands take effect this many reports later
  std::deque<ReferenceCommand> on_the_way;
};

Wrench push(double x, double y, double z) {
  Wrench w;
  w.force_w = Vec3(static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z));
  return w;
}

bool is_zero(const Wrench& w) { return w.force_w.isZero(0) && w.torque_w.isZero(0); }

}  // namespace

TEST_SUITE("hal.reference_driver") {
  TEST_CASE("start: takes the limits that the device states, keeps the frames of the settings") {
    AnsweringPort port;
    port.block.max_force = 450'000;
    port.block.driven_dof = kDofTranslation;
    port.block.max_torque = 0;
    port.block.watchdog_ms = 50;
    port.damaged_answers = 2;
    ReferenceSettings settings;
    settings.capabilities.handle_offset_h = Vec3(0, 0, 0.25_r);
    ReferenceDriver driver(settings);
    CHECK(driver.start(port) == HalStatus::kOk);
    CHECK(port.asked == 3);
    CHECK(port.last.request_type == 0xc1);
    CHECK(port.last.request == 1);
    CHECK(port.last.value == 1);
    CHECK(port.last_timeout_ms <= 100);
    const DeviceCapabilities& c = driver.capabilities();
    CHECK(static_cast<double>(c.max_force_n) == doctest::Approx(4.5));
    CHECK(c.driven_dof == kDofTranslation);
    CHECK(c.watchdog_ns == 50'000'000);
    CHECK(c.handle_offset_h.z() == 0.25_r);
  }

  TEST_CASE("start: refuses damaged and implausible answers, silence and a stop") {
    const auto outcome = [](auto change) {
      AnsweringPort port;
      change(port);
      ReferenceDriver driver;
      const HalStatus status = driver.start(port);
      CHECK(port.asked <= 3);
      CHECK(static_cast<double>(driver.capabilities().max_force_n) == doctest::Approx(12.0));
      return status;
    };
    CHECK(outcome([](auto& p) { p.damaged_answers = 3; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.longest = 63; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kTransferFailed; }) ==
          HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kTimeout; }) == HalStatus::kTimeout);
    CHECK(outcome([](auto& p) { p.status = HalStatus::kDeviceGone; }) == HalStatus::kDeviceGone);
    CHECK(outcome([](auto& p) { p.stop = true; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_force = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_force = 100'100'000; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.max_torque = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.sensed_dof = kDofTranslation; }) ==
          HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.watchdog_ms = 0; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.watchdog_ms = 1; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.report_period_us = 99; }) == HalStatus::kStartFailed);
    CHECK(outcome([](auto& p) { p.block.encoder_step_nm = 1'000'000; }) == HalStatus::kStartFailed);
  }

  TEST_CASE("start: without asking, the settings' own limits are checked") {
    AnsweringPort port;
    ReferenceSettings settings;
    settings.ask_device = false;
    ReferenceDriver good(settings);
    CHECK(good.start(port) == HalStatus::kOk);
    CHECK(port.asked == 0);
    settings.capabilities.max_force_n = std::numeric_limits<Real>::quiet_NaN();
    ReferenceDriver bad(settings);
    CHECK(bad.start(port) == HalStatus::kBadCapabilities);
  }

  TEST_CASE("read: units, frames and switches") {
    Bench bench;
    bench.set(kReferenceCalibrated);
    bench.set(kReferenceTwistValid);
    bench.device.position = {12'345'678, -4'000'000, 30'000'000};
    bench.device.orientation = {0, 0, 759'250'125, 759'250'125};
    bench.device.velocity = {100'000, 0, -50'000};
    bench.device.angular_velocity = {0, 0, 1'000'000};
    bench.device.switches = 5;
    REQUIRE(bench.report() == ReportVerdict::kState);
    const Pose pose = pose_of(bench.state.pose_dh);
    const double tolerance = 16 * static_cast<double>(kRealEpsilon);
    CHECK(static_cast<double>(pose.p_wa.x()) == doctest::Approx(0.012345678).epsilon(tolerance));
    CHECK(static_cast<double>(pose.p_wa.y()) == doctest::Approx(-0.004).epsilon(tolerance));
    CHECK(static_cast<double>(pose.p_wa.z()) == doctest::Approx(0.03).epsilon(tolerance));
    // H's x axis lies along D's y axis.
    CHECK(static_cast<double>((pose.q_wa * Vec3(1, 0, 0)).y()) ==
          doctest::Approx(1.0).epsilon(tolerance));
    CHECK(bench.state.twist_valid);
    CHECK(static_cast<double>(bench.state.twist_d.linear_m_per_s[2]) == doctest::Approx(-0.05));
    CHECK(static_cast<double>(bench.state.twist_d.angular_rad_per_s[2]) == doctest::Approx(1.0));
    CHECK(bench.state.switches == 5);
    CHECK(bench.state.link == LinkState::kReady);
    CHECK(bench.state.faults == 0);
    bench.unset(kReferenceTwistValid);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK_FALSE(bench.state.twist_valid);
    CHECK(bench.state.twist_d.linear_m_per_s[0] == 0);
  }

  TEST_CASE("read: an orientation that is only nearly unit comes out unit") {
    Bench bench;
    bench.device.orientation = {0, 0, 0, (1 << 30) - (1 << 20)};
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.pose_dh.q_xyzw[3] == 1);
  }

  TEST_CASE("read: what is refused leaves the state as it was, with the reason") {
    Bench bench;
    bench.device.position = {1, 2, 3};
    REQUIRE(bench.report() == ReportVerdict::kState);
    const PoseRecord before = bench.state.pose_dh;
    bench.device.position = {9, 9, 9};
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    --bench.device.sequence;
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    bench.device.sequence += 10;
    std::array<std::uint8_t, kReferenceReportBytes> bytes{};
    encode(bench.device, bytes);
    CHECK(bench.driver.read(std::span(bytes).first(95), 0, bench.state) ==
          ReportVerdict::kBadLength);
    CHECK(bench.driver.read({}, 0, bench.state) == ReportVerdict::kBadLength);
    bytes[50] ^= 4;
    CHECK(bench.driver.read(bytes, 0, bench.state) == ReportVerdict::kBadCheck);
    bench.device.orientation = {0, 0, 0, 1 << 29};
    CHECK(bench.repeat_report() == ReportVerdict::kBadNumber);
    for (int k = 0; k < 3; ++k) CHECK(bench.state.pose_dh.p_m[k] == before.p_m[k]);
    bench.device.orientation = {0, 0, 0, 1 << 30};
    CHECK(bench.repeat_report() == ReportVerdict::kState);
  }

  TEST_CASE("read: the sequence may wrap, may skip, and is forgotten by start") {
    Bench bench;
    bench.device.sequence = 0xffff'fffd;
    for (int k = 0; k < 6; ++k) CHECK(bench.report() == ReportVerdict::kState);
    CHECK(bench.device.sequence == 3);
    bench.device.sequence += 1000;
    CHECK(bench.repeat_report() == ReportVerdict::kState);
    bench.device.sequence -= 1;
    CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    REQUIRE(bench.driver.start(bench.port) == HalStatus::kOk);
    bench.device.sequence = 1;
    CHECK(bench.repeat_report() == ReportVerdict::kState);
  }

  TEST_CASE("write: nothing before the first report, then the device's sequence goes on") {
    Bench bench;
    CHECK(bench.command({}) == 0);
    bench.device.accepted_sequence = 0xffff'fffe;
    REQUIRE(bench.report() == ReportVerdict::kState);
    for (const std::uint32_t expected : {0xffff'ffffu, 0u, 1u}) {
      REQUIRE(bench.command({}) == kReferenceCommandBytes);
      CHECK(bench.sent.sequence == expected);
    }
    CHECK(bench.device.rejected == 0);
    std::array<std::uint8_t, 55> small{};
    CHECK(bench.driver.write({}, 1, small, bench.delivered) == 0);
  }

  TEST_CASE("write: not calibrated, no wrench and no drives") {
    Bench bench;
    for (int k = 0; k < 5; ++k) {
      REQUIRE(bench.report() == ReportVerdict::kState);
      CHECK(bench.state.link == LinkState::kStarting);
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK_FALSE(bench.sent.drives_on);
      CHECK(bench.sent.force[0] == 0);
      CHECK(is_zero(bench.delivered));
    }
  }

  TEST_CASE("write: a wrench passes only after confirmed drives and a zero of the renderer's") {
    Bench bench;
    bench.set(kReferenceCalibrated);
    for (int k = 0; k < 10; ++k) {
      REQUIRE(bench.report() == ReportVerdict::kState);
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK(bench.sent.drives_on);
      CHECK(is_zero(bench.delivered));
      CHECK(bench.sent.force[0] == 0);
    }
    REQUIRE(bench.command({}) == kReferenceCommandBytes);
    REQUIRE(bench.command(push(1, -2, 0.5)) == kReferenceCommandBytes);
    CHECK(bench.sent.force == std::array<std::int32_t, 3>{100'000, -200'000, 50'000});
    CHECK(static_cast<double>(bench.delivered.force_w.y()) == doctest::Approx(-2.0));
    CHECK(bench.sent.tick == static_cast<std::uint32_t>(bench.tick));
  }

  TEST_CASE("write: drives that the device never confirms get no wrench") {
    Bench bench;
    bench.set(kReferenceCalibrated);
    for (int k = 0; k < 10; ++k) {
      bench.drives_on = false;
      REQUIRE(bench.report() == ReportVerdict::kState);
      REQUIRE(bench.command(k < 5 ? Wrench{} : push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK(is_zero(bench.delivered));
    }
  }

  TEST_CASE(
      "watchdog cut, e-stop, lost calibration, dropped drives: force returns by a zero only") {
    struct Cause {
      std::uint32_t fault;
      void (*come)(Bench&);
      void (*go)(Bench&);
    };
    const Cause causes[] = {
        {kDeviceWatchdogCut, [](Bench& b) { b.set(kReferenceWatchdogCut); }, [](Bench&) {}},
        {kDeviceEmergencyStop,
         [](Bench& b) {
           b.pressed = true;
           b.set(kReferenceEmergencyStop);
         },
         [](Bench& b) { b.pressed = false; }},
        {kDeviceNotHomed,
         [](Bench& b) {
           b.unset(kReferenceCalibrated);
           b.drives_on = false;
         },
         [](Bench& b) { b.set(kReferenceCalibrated); }},
        {kDeviceDriveFault, [](Bench& b) { b.drives_on = false; }, [](Bench&) {}}};
    for (const Cause& cause : causes) {
      CAPTURE(cause.fault);
      Bench bench;
      bench.bring_up();
      REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
      REQUIRE_FALSE(is_zero(bench.delivered));
      cause.come(bench);
      for (int k = 0; k < 12; ++k) {
        if (k == 3) cause.go(bench);
        REQUIRE(bench.report() == ReportVerdict::kState);
        CHECK(bench.state.faults == cause.fault);
        REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
        CHECK(is_zero(bench.delivered));
        CHECK(bench.sent.force[0] == 0);
      }
      CHECK(bench.drives_on);  // the device is back, the driver waits for the renderer
      REQUIRE(bench.command({}) == kReferenceCommandBytes);
      REQUIRE(bench.report() == ReportVerdict::kState);
      CHECK(bench.state.faults == 0);
      REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
      CHECK(bench.sent.force[0] == 200'000);
    }
  }

  TEST_CASE("watchdog cut: commands that act late are not taken for dropped drives") {
    for (std::size_t latency = 0; latency < 6; ++latency) {
      CAPTURE(latency);
      Bench bench;
      bench.latency = latency;
      bench.bring_up();
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      REQUIRE_FALSE(is_zero(bench.delivered));
      bench.set(kReferenceWatchdogCut);
      std::uint32_t seen = 0;
      for (std::size_t k = 0; k < 20; ++k) {
        REQUIRE(bench.report() == ReportVerdict::kState);
        seen |= bench.state.faults;
        REQUIRE(bench.command({}) == kReferenceCommandBytes);
      }
      CHECK(seen == kDeviceWatchdogCut);
      CHECK(bench.state.faults == 0);
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK(bench.sent.force[0] == 100'000);
    }
  }

  TEST_CASE("drives: what a report says of an older command confirms nothing") {
    for (std::size_t latency = 1; latency < 6; ++latency) {
      CAPTURE(latency);
      Bench bench;
      bench.latency = latency;
      bench.bring_up();
      // One report without calibration: its answer, drives off, is on the way for some time.
      bench.unset(kReferenceCalibrated);
      std::uint32_t seen = 0;
      for (std::size_t k = 0; k < 20; ++k) {
        REQUIRE(bench.report() == ReportVerdict::kState);
        bench.set(kReferenceCalibrated);
        seen |= bench.state.faults;
        REQUIRE(bench.command({}) == kReferenceCommandBytes);
      }
      CHECK(seen == kDeviceNotHomed);
      CHECK(bench.state.faults == 0);
    }
  }

  TEST_CASE("read: fault bits of the device pass, a fault bit alone stops as its status bit does") {
    Bench bench;
    bench.bring_up();
    bench.device.faults = kDeviceOverheated;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceOverheated);
    REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
    CHECK_FALSE(is_zero(bench.delivered));
    bench.device.faults = kDeviceEmergencyStop;
    REQUIRE(bench.report() == ReportVerdict::kState);
    REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
    CHECK_FALSE(bench.sent.drives_on);
    CHECK(is_zero(bench.delivered));
    bench.device.faults = kDeviceNotHomed;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.link == LinkState::kStarting);
  }

  TEST_CASE("read: a refused command is a fault until a newer one was accepted") {
    Bench bench;
    bench.device.rejected = 17;  // of an earlier program
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0);
    ++bench.device.rejected;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceRefused);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == kDeviceRefused);
    REQUIRE(bench.command({}) == kReferenceCommandBytes);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0);
  }

  TEST_CASE("write: random wrenches keep limits, direction and the error of rounding") {
    INFO("seed " << kSeed);
    std::mt19937_64 engine(kSeed);
    const auto number = [&] { return static_cast<double>(engine() >> 11) * 0x1.0p-52 - 1.0; };
    Bench bench;
    bench.bring_up();
    const double rounding = static_cast<double>(kRealEpsilon) * 24;
    double worst_force = 0, worst_turn = 0, worst_norm = 0;
    for (int i = 0; i < 50'000; ++i) {
      Wrench w = push(number(), number(), number());
      const double reach = std::pow(10.0, 4 * number());
      w.force_w *= static_cast<Real>(reach);
      w.torque_w = Vec3(static_cast<Real>(number()), static_cast<Real>(number()),
                        static_cast<Real>(number())) *
                   static_cast<Real>(0.02 * reach);
      std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
      REQUIRE(bench.driver.write(w, 1, bytes, bench.delivered) == bytes.size());
      const auto judge = [&](const Vec3& asked_real, const Vec3& got_real, double limit,
                             double unit) {
        const Eigen::Vector3d asked = asked_real.cast<double>(), got = got_real.cast<double>();
        worst_norm = std::max(worst_norm, got.norm() / limit - rounding);
        if (asked.norm() <= limit - unit) {
          const double error = (got - asked).cwiseAbs().maxCoeff() - rounding * asked.norm();
          worst_force = std::max(worst_force, error / unit);
        } else {
          // Rounding moves the tip by half a unit per axis at most.
          const double off_line = (got - asked * (asked.dot(got) / asked.squaredNorm())).norm();
          worst_turn = std::max(worst_turn, (off_line - rounding * got.norm()) / unit);
          CHECK(got.norm() >= limit - 2 * unit - rounding * limit);
        }
      };
      judge(w.force_w, bench.delivered.force_w, 12.0, kReferenceForceUnit_n);
      judge(w.torque_w, bench.delivered.torque_w, 0.3, kReferenceTorqueUnit_nm);
    }
    CHECK(worst_norm <= 1.0);
    CHECK(worst_force <= 0.5);
    CHECK(worst_force > 0.49);
    CHECK(worst_turn <= 0.87);
  }

  TEST_CASE("write: limits of single axes shorten the whole vector") {
    AnsweringPort port;
    ReferenceSettings settings;
    settings.ask_device = false;
    settings.capabilities.max_axis_force_n = Vec3(0, 0, 2);
    settings.capabilities.driven_dof = kDofTranslation | kDofRotX;
    Bench bench;
    bench.driver = ReferenceDriver(settings);
    REQUIRE(bench.driver.start(port) == HalStatus::kOk);
    bench.bring_up();
    Wrench w = push(3, 0, -4);
    w.torque_w = Vec3(0.1_r, 0.2_r, 0.3_r);
    REQUIRE(bench.command(w) == kReferenceCommandBytes);
    CHECK(bench.sent.force[2] >= -200'000);
    CHECK(bench.sent.force[2] <= -199'998);
    CHECK(std::abs(bench.sent.force[0] - 150'000) <= 1);
    CHECK(bench.sent.torque == std::array<std::int32_t, 3>{1'000'000, 0, 0});
  }

  TEST_CASE("write: wrenches that are no numbers or beyond all range") {
    Bench bench;
    bench.bring_up();
    constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
    constexpr Real kMost = std::numeric_limits<Real>::max();
    Wrench w;
    w.force_w = Vec3(1, 1, 1);
    w.torque_w = Vec3(0, kNan, 0);
    REQUIRE(bench.command(w) == kReferenceCommandBytes);
    CHECK(is_zero(bench.delivered));
    w.torque_w = Vec3::Zero();
    w.force_w = Vec3(kMost, -kMost, 0);
    REQUIRE(bench.command(w) == kReferenceCommandBytes);
    CHECK(static_cast<double>(bench.delivered.force_w.norm()) == doctest::Approx(12.0));
    CHECK(bench.sent.force[0] == -bench.sent.force[1]);
    w.force_w = Vec3(std::numeric_limits<Real>::denorm_min(), 0, 0);
    REQUIRE(bench.command(w) == kReferenceCommandBytes);
    CHECK(is_zero(bench.delivered));
  }
}
