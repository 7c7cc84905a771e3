// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/hal/reference_bench.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::hal::test;

namespace {

constexpr std::uint64_t kReferenceCommandSeed = 77'003;

}  // namespace

TEST_SUITE("hal.reference_commands") {
  TEST_CASE("write: nothing before the first report, then the device's sequence goes on") {
    ReferenceBench bench;
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
    ReferenceBench bench;
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
    ReferenceBench bench;
    bench.set(kReferenceCalibrated);
    for (int k = 0; k < 10; ++k) {
      REQUIRE(bench.report() == ReportVerdict::kState);
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK(bench.sent.drives_on == (k > 0));  // first one without, which a fresh device waits for
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
    ReferenceBench bench;
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
      void (*come)(ReferenceBench&);
      void (*go)(ReferenceBench&);
    };
    const Cause causes[] = {
        {kDeviceWatchdogCut, [](ReferenceBench& b) { b.set(kReferenceWatchdogCut); },
         [](ReferenceBench&) {}},
        {kDeviceEmergencyStop,
         [](ReferenceBench& b) {
           b.pressed = true;
           b.set(kReferenceEmergencyStop);
         },
         [](ReferenceBench& b) { b.pressed = false; }},
        {kDeviceNotHomed,
         [](ReferenceBench& b) {
           b.unset(kReferenceCalibrated);
           b.drives_on = false;
         },
         [](ReferenceBench& b) { b.set(kReferenceCalibrated); }},
        {kDeviceDriveFault, [](ReferenceBench& b) { b.drives_on = false; },
         [](ReferenceBench&) {}}};
    for (const Cause& cause : causes) {
      CAPTURE(cause.fault);
      ReferenceBench bench;
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

  TEST_CASE("release: drives off in the last command, which are no fault for it") {
    ReferenceBench bench;
    std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
    CHECK(bench.driver.release(1, bytes) == 0u);  // nothing before the first report
    bench.bring_up();
    REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
    REQUIRE(bench.command({}) == kReferenceCommandBytes);
    CHECK(bench.driver.release(7, std::span(bytes).first(kReferenceCommandBytes - 1)) == 0u);
    REQUIRE(bench.driver.release(7, bytes) == kReferenceCommandBytes);
    ReferenceCommand off;
    REQUIRE(decode(bytes, off) == CodecVerdict::kOk);
    CHECK_FALSE(off.drives_on);
    CHECK(off.force == std::array<std::int32_t, 3>{});
    CHECK(is_newer(off.sequence, bench.sent.sequence));
    bench.accept(off);
    CHECK_FALSE(bench.drives_on);
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0u);
  }

  TEST_CASE("restart: counters that start again are taken up, with a fault, without a wrench") {
    for (std::size_t latency = 0; latency < 4; ++latency) {
      for (const std::uint32_t calibrated : {1u, 0u}) {
        CAPTURE(latency);
        CAPTURE(calibrated);
        ReferenceBench bench;
        bench.latency = latency;
        bench.bring_up();
        for (int k = 0; k < 50; ++k) {
          REQUIRE(bench.report() == ReportVerdict::kState);
          REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
        }
        REQUIRE(bench.drives_on);
        bench.restart();
        if (calibrated == 0) bench.unset(kReferenceCalibrated);
        std::uint32_t seen = 0;
        for (unsigned k = 1; k <= 40; ++k) {
          CAPTURE(k);
          const bool taken = k >= kReferenceRestartReports;
          REQUIRE(bench.report() == (taken ? ReportVerdict::kState : ReportVerdict::kNotAdvancing));
          if (taken) seen |= bench.state.faults;
          REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
          // What the host has not noticed yet must not act either: the device waits.
          if (k < kReferenceRestartReports) CHECK_FALSE(bench.drives_on);
          if (taken) CHECK(bench.sent.force[0] == 0);
        }
        CHECK(seen == kDeviceDriveFault);
        CHECK(bench.drives_on == (calibrated == 1));
        bench.set(kReferenceCalibrated);
        bench.idle(5 + 2 * latency);
        CHECK(bench.state.faults == 0u);
        REQUIRE(bench.command(push(2, 0, 0)) == kReferenceCommandBytes);
        CHECK(bench.sent.force[0] == 200'000);
      }
    }
  }

  TEST_CASE("restart: neither one that stands still nor old reports among new ones are one") {
    ReferenceBench bench;
    bench.bring_up();
    for (int k = 0; k < 100; ++k) CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    const std::uint32_t newest = bench.device.sequence;
    for (std::uint32_t k = 0; k < 40; ++k) {
      // Four old ones in their order, then one that goes back again.
      bench.device.sequence = newest - 5 + k % 4;
      CHECK(bench.repeat_report() == ReportVerdict::kNotAdvancing);
    }
    bench.device.sequence = newest;
    REQUIRE(bench.report() == ReportVerdict::kState);
    CHECK(bench.state.faults == 0u);
    CHECK(bench.drives_on);
  }

  TEST_CASE("watchdog cut: commands that act late are not taken for dropped drives") {
    for (std::size_t latency = 0; latency < 6; ++latency) {
      CAPTURE(latency);
      ReferenceBench bench;
      bench.latency = latency;
      bench.bring_up();
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      REQUIRE_FALSE(is_zero(bench.delivered));
      bench.set(kReferenceWatchdogCut);
      CHECK(bench.idle(20) == kDeviceWatchdogCut);
      CHECK(bench.state.faults == 0);
      REQUIRE(bench.command(push(1, 0, 0)) == kReferenceCommandBytes);
      CHECK(bench.sent.force[0] == 100'000);
    }
  }

  TEST_CASE("drives: what a report says of an older command confirms nothing") {
    for (std::size_t latency = 1; latency < 6; ++latency) {
      CAPTURE(latency);
      ReferenceBench bench;
      bench.latency = latency;
      bench.bring_up();
      // One report without calibration: its answer, drives off, is on the way for some time.
      bench.unset(kReferenceCalibrated);
      const std::uint32_t first = bench.idle(1);
      bench.set(kReferenceCalibrated);
      CHECK((first | bench.idle(19)) == kDeviceNotHomed);
      CHECK(bench.state.faults == 0);
    }
  }

  TEST_CASE("write: random wrenches keep limits, direction and the error of rounding") {
    INFO("seed " << kReferenceCommandSeed);
    std::mt19937_64 engine(kReferenceCommandSeed);
    const auto number = [&] { return static_cast<double>(engine() >> 11) * 0x1.0p-52 - 1.0; };
    ReferenceBench bench;
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
    ReferenceBench bench;
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
    ReferenceBench bench;
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
