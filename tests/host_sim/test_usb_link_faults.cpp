// SPDX-License-Identifier: Apache-2.0
// The link through the real libusb to a device in this process: what fails, and what the servo
// thread and the device get of it.
#include <doctest/doctest.h>

#include <array>
#include <cerrno>
#include <limits>
#include <random>

#include "hal/usb/usb_connection.hpp"
#include "rt_core/safety/wrench_ramp.hpp"
#include "tests/host_sim/usb_link_bench.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;

TEST_SUITE("host_sim.usb_link_faults") {
  TEST_CASE("a device that comes back as another one: said with its numbers, and bounded by them") {
    Bench b;
    b.work();
    CHECK(b.link->trouble() == "");
    const auto replug = [&b] {
      b.carrier->unplug();
      b.run(3);
      b.plug();
      b.link->set_wrapped_fd(b.carrier->descriptor());
      for (int k = 0; k < 3; ++k) b.step();
      b.device.forces_n.clear();
    };
    replug();
    CHECK(b.link->trouble() == "");  // the same
    CHECK((b.state().faults & kLinkOtherDevice) == 0u);
    DeviceCapabilities weak = b.driver.capabilities();
    weak.max_force_n = 0.3_r;
    weak.max_force_rate_n_per_s = 60;
    b.driver.state(weak);
    replug();
    CHECK(b.link->trouble().find("another device than before") != std::string::npos);
    CHECK(b.link->trouble().find("0.3 N, ") != std::string::npos);
    CHECK(b.link->trouble().find("60 N/s") != std::string::npos);
    CHECK(b.state().limits.connection == 3u);
    CHECK(b.state().limits.max_force_n == 0.3_r);
    b.run(5);
    CHECK(b.force() == 0.0);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(0.3));
    CHECK(b.largest_step() <= 0.06 + 2 * kUnit_n);
    CHECK((b.state().faults & kLinkOtherDevice) == 0u);  // answered
  }

  TEST_CASE(
      "a device that is not accepted gets no command, and is asked again when it comes back") {
    LinkSettings settings;
    int asked = 0;
    bool fits = false;
    settings.accept = [&](const DeviceCapabilities& stated) {
      ++asked;
      CHECK(stated.bus_interval_ns == 125'000);  // high speed, bInterval 1
      return fits && stated.max_force_n > 0 ? "" : std::string("too stiff by 3 N/m");
    };
    Bench b(settings);
    CHECK(b.connect() == HalStatus::kNotAccepted);
    b.run(10);
    CHECK(b.link->trouble() == "too stiff by 3 N/m");
    CHECK(b.link->state() == LinkState::kAbsent);
    CHECK(b.link->counters().connects == 0u);
    CHECK(b.device.forces_n.empty());
    CHECK(asked == 1);  // not before its time
    fits = true;
    b.clock.now_ns += settings.retry_ns;
    CHECK(b.connect() == HalStatus::kOk);
    CHECK(asked == 2);
    b.run(3);
    CHECK(b.link->state() == LinkState::kReady);
    CHECK(b.link->trouble() == "");
  }

  TEST_CASE(
      "how often the bus asks for a report: frames at full speed, microframes at high speed") {
    CHECK(interrupt_interval_ns(false, 1) == 1'000'000);
    CHECK(interrupt_interval_ns(false, 8) == 8'000'000);
    CHECK(interrupt_interval_ns(true, 1) == 125'000);
    CHECK(interrupt_interval_ns(true, 4) == 1'000'000);
    CHECK(interrupt_interval_ns(true, 16) == 4'096'000'000);
    CHECK(interrupt_interval_ns(true, 17) == 0);
    CHECK(interrupt_interval_ns(true, 0) == 0);
    CHECK(interrupt_interval_ns(false, 0) == 0);
  }

  TEST_CASE("IN errors: a stall is cleared, others are tried again, and force goes on") {
    for (const int error : {-EPIPE, -EOVERFLOW, -EPROTO, -EILSEQ, -ETIME}) {
      INFO("errno ", -error);
      Bench b;
      b.work();
      b.carrier->fail_next(kInEndpoint, error, 2);
      CHECK(b.run(10) == HalStatus::kOk);
      CHECK(b.link->counters().in_failed == 2u);
      CHECK(b.device.halts_cleared == (error == -EPIPE ? 2u : 0u));
      CHECK(b.carrier->waiting(kInEndpoint) == 3u);
      CHECK(b.state().stamp_ns == b.clock.now_ns);
      CHECK(b.state().faults == 0u);
      CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    }
  }

  TEST_CASE("IN errors without end: the link is given up, said so, and opened again") {
    Bench b;
    b.work();
    b.carrier->fail_next(kInEndpoint, -EPROTO, 11);
    CHECK(b.run(12) == HalStatus::kTransferFailed);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK((b.state().faults & kLinkLost) != 0u);
    CHECK(b.link->trouble().find("test device (1209:000f)") != std::string::npos);
    CHECK(b.carrier->waiting(kInEndpoint) == 0u);
    b.clock.now_ns += 200'000'000;
    CHECK(b.connect() == HalStatus::kOk);
    CHECK(b.link->trouble().empty());
    b.run(10);
    CHECK(b.state().link == LinkState::kReady);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == 0.0);
    CHECK(b.link->counters().connects == 2u);
  }

  TEST_CASE("OUT errors: the next output starts from what the device has") {
    for (const int error : {-EPIPE, -EPROTO}) {
      INFO("errno ", -error);
      Bench b;
      b.work();
      b.carrier->fail_next(kOutEndpoint, error, 2);
      b.force_n = 0.0_r;
      const std::size_t before = b.device.forces_n.size();
      CHECK(b.run(10) == HalStatus::kOk);
      CHECK(b.link->counters().send_failed == 2u);
      CHECK(b.device.halts_cleared == (error == -EPIPE ? 2u : 0u));
      // With any fate of the transfers, the first that arrives is one allowed step away, by the
      // time since the last that did.
      REQUIRE(b.device.forces_n.size() > before);
      CHECK(b.device.forces_n[before - 1] - b.device.forces_n[before] <= 3 * kStep_n + kUnit_n);
      CHECK(b.force() == 0.0);
      CHECK(b.state().faults == 0u);
    }
  }

  TEST_CASE("OUT errors for long: what the device gets next is one bounded step from what it has") {
    LinkSettings settings;
    settings.limits.slew_n_per_s = 100.0_r;
    Bench b(settings);
    b.work();
    b.carrier->fail_next(kOutEndpoint, -EPROTO, 9);
    b.force_n = 0.0_r;
    const std::size_t before = b.device.forces_n.size();
    b.run(9);
    CHECK((b.state().faults & kLinkSendFailed) != 0u);
    REQUIRE(b.device.forces_n.size() == before);
    b.run(1);
    REQUIRE(b.device.forces_n.size() > before);
    // Ten periods have passed; no more than kMostStepPeriods of them count.
    CHECK(b.device.forces_n[before - 1] - b.device.forces_n[before] <= 0.2 + kUnit_n);
    b.run(30);
    CHECK(b.force() == 0.0);
    CHECK(b.state().faults == 0u);
  }

  TEST_CASE("submit refused for want of memory: counted, tried again, one send more or less") {
    Bench b;
    b.work();
    b.carrier->refuse_submit(kInEndpoint, -ENOMEM, 4);
    b.carrier->refuse_submit(kOutEndpoint, -ENOMEM, 2);
    CHECK(b.run(10) == HalStatus::kOk);
    CHECK(b.link->counters().in_failed == 4u);
    CHECK(b.link->counters().send_failed == 2u);
    CHECK(b.carrier->waiting(kInEndpoint) == 3u);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    b.carrier->refuse_submit(kOutEndpoint, -ENOMEM, 5);
    b.run(5);
    CHECK((b.state().faults & kLinkSendFailed) != 0u);
    b.run(20);
    CHECK(b.force() == 0.0);  // until armed again
    CHECK(b.largest_step() <= 5 * kStep_n);
  }

  TEST_CASE("submit refused for long: the link stays for as long as a ramp to zero takes") {
    Bench b;
    b.work();
    const unsigned sent = b.log.sends;
    b.carrier->refuse_submit(kInEndpoint, -ENOMEM, 1000);
    b.run(14);
    CHECK(b.state().link == LinkState::kReady);
    CHECK(b.log.sends - sent >= 10u);  // no report clocks them any more: by time
    b.run(16);
    CHECK(b.state().link == LinkState::kAbsent);
  }

  TEST_CASE("unplug in flight, and re-plug: zero until armed again") {
    LinkSettings settings;
    settings.limits.slew_n_per_s = 100.0_r;  // a ramp from where it was would show
    Bench b(settings);
    b.work();
    b.carrier->unplug();
    CHECK(b.link->poll(0) == HalStatus::kDeviceGone);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK(b.state().faults == kLinkLost);
    CHECK(b.state().pose_dh.p_m[0] > 0.0_r);  // the last one
    CHECK(b.link->trouble().find("LIBUSB_ERROR_NO_DEVICE") != std::string::npos);
    const int starts = b.driver.starts;
    b.clock.now_ns += 1'000'000'000;
    for (int k = 0; k < 3; ++k) CHECK(b.link->poll(0) == HalStatus::kDeviceGone);
    CHECK(b.driver.starts == starts);  // that descriptor is used up

    const std::uint64_t sequence = b.state().sequence;
    const std::size_t before = b.device.forces_n.size();
    b.plug();
    b.reported = 0;
    b.link->set_wrapped_fd(b.carrier->descriptor());
    b.clock.now_ns += kPeriod_ns;  // a new descriptor is not kept waiting
    CHECK(b.connect() == HalStatus::kOk);
    b.run(50);
    CHECK(b.state().link == LinkState::kReady);
    CHECK(b.state().faults == 0u);  // the servo has answered a state that carried it
    CHECK(b.state().sequence == sequence + 50);
    for (std::size_t k = before; k < b.device.forces_n.size(); ++k)
      CHECK(b.device.forces_n[k] == 0);
    b.arming += 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    CHECK(b.link->counters().connects == 2u);
    CHECK(b.link->counters().disconnects == 1u);
    REQUIRE(b.log.states == 5);
    CHECK(b.log.last[2] == std::pair(LinkState::kAbsent, HalStatus::kDeviceGone));
  }

  TEST_CASE("unplug between a completion and its resubmit: only the submit's code says so") {
    LinkSettings settings;
    settings.in_transfers = 2;
    Bench b(settings);
    b.work();
    b.report();  // with the one of the step: both transfers have ended, none is left to fail
    b.carrier->unplug_at_next_resubmit();
    CHECK(b.step() == HalStatus::kDeviceGone);
    CHECK(b.link->counters().in_failed == 1u);
    CHECK(b.state().link == LinkState::kAbsent);
    CHECK(b.state().faults == kLinkLost);
  }

  TEST_CASE("unplug while sending") {
    Bench b;
    b.work();
    b.device.on_command = [&] { b.carrier->unplug(); };
    CHECK(b.step() == HalStatus::kDeviceGone);
    CHECK(b.state().link == LinkState::kAbsent);
  }

  TEST_CASE("reports stop: commands still go out each period, and silence is said") {
    Bench b;
    b.work();
    const std::size_t before = b.device.forces_n.size();
    b.run(15, false);
    CHECK(b.device.forces_n.size() >= before + 14);
    CHECK(b.state().faults == 0u);
    b.run(15, false);
    CHECK(b.state().faults == kLinkSilent);
    CHECK(b.force() == 0.0);
    CHECK(b.largest_step() <= kStep_n + 2 * kUnit_n);
    b.run(5);
    CHECK(b.state().faults == 0u);
    CHECK(b.force() == 0.0);
  }

  TEST_CASE("commands stop: hold, decay, zero, latched, whether reports come or not") {
    for (const bool reports : {true, false}) {
      INFO("reports come: ", reports);
      Bench b;
      b.work();
      b.run(15, reports, false);
      CHECK(b.force() == 0.0);
      // Without reports the first output comes by time, two of this test's periods after the last.
      CHECK(b.largest_step() <= (reports ? 1 : 2) * kStep_n + 2 * kUnit_n);
      CHECK((b.state().faults & kLinkStaleCommand) != 0u);
      CHECK(b.link->counters().guard_held >= 3u);
      b.run(10);
      CHECK(b.state().faults == 0u);
      CHECK(b.force() == 0.0);
      b.arming += 1;
      b.run(300);
      CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
    }
  }

  TEST_CASE("servo process ended: ramped out and said, until another answers") {
    Bench b;
    b.work();
    b.link->servo_lost();
    b.run(2, true, false);
    CHECK((b.state().faults & kLinkServoLost) != 0u);
    b.run(10, true, false);
    CHECK(b.force() == 0.0);
    b.tick = 0;  // the new one counts from zero again
    b.arming = 0;
    b.run(10);
    CHECK(b.force() == 0.0);
    CHECK(b.state().faults == 0u);
    b.arming = 1;
    b.run(300);
    CHECK(b.force() == doctest::Approx(static_cast<double>(kForce_n)));
  }

  TEST_CASE("reports that are damaged or do not advance: said after so many in a row") {
    Bench b;
    b.work();
    const auto bad = [&](int times, std::uint32_t damage) {
      for (int k = 0; k < times; ++k) {
        b.clock.now_ns += kPeriod_ns;
        b.command();
        b.reported -= damage == 0 ? 1 : 0;
        b.report(damage);
        b.link->poll(0);
      }
    };
    const std::uint64_t sequence = b.state().sequence;
    bad(4, 0x100);
    CHECK(b.state().faults == 0u);
    bad(1, 0x100);
    CHECK(b.state().faults == kLinkCorrupt);
    CHECK(b.state().sequence == sequence);
    CHECK(b.link->counters().bad_check == 5u);
    b.run(5);
    CHECK(b.state().faults == 0u);
    bad(9, 0);
    CHECK(b.state().faults == 0u);
    bad(1, 0);
    CHECK(b.state().faults == kLinkFrozen);
    CHECK(b.link->counters().not_advancing == 10u);
    b.carrier->push(kInEndpoint, std::array<std::uint8_t, 7>{});
    b.link->poll(0);
    CHECK(b.link->counters().bad_length == 1u);
    b.run(10);
    CHECK(b.force() == 0.0);  // until armed again
  }

  TEST_CASE("not calibrated any more: no force until it is, and armed again") {
    Bench b;
    b.work();
    b.ready = false;
    b.run(20);
    CHECK(b.link->state() == LinkState::kStarting);
    CHECK(b.force() == 0.0);
    CHECK(b.largest_step() <= kStep_n + 2 * kUnit_n);
    b.ready = true;
    b.arming += 1;
    b.run(1);
    b.run(50);
    CHECK(b.force() > 0.0);
  }

  TEST_CASE("faults at random: what the device gets never jumps") {
    const std::uint64_t seed = 20240612;
    INFO("seed ", seed);
    std::mt19937_64 random(seed);
    const auto one_in = [&](std::uint64_t n) { return random() % n == 0; };
    Bench b;
    REQUIRE(b.connect() == HalStatus::kOk);
    const SafetyLimits limits;
    std::int64_t last_ns = b.clock.now_ns;
    double last_n = 0.0;
    int wrong = 0, strong = 0;
    std::uint64_t connects = 1;
    b.device.on_command = [&] {
      if (b.link->counters().connects != connects) last_n = 0.0;  // it was away, its drives are off
      connects = b.link->counters().connects;
      const double elapsed_s = std::min(1e-9 * static_cast<double>(b.clock.now_ns - last_ns),
                                        static_cast<double>(longest_step_s(limits.period_ns)));
      const double change_n = std::abs(b.force() - last_n);
      const bool in_bounds =
          change_n <= static_cast<double>(limits.slew_n_per_s) * elapsed_s + 2 * kUnit_n &&
          std::abs(b.force()) <= static_cast<double>(limits.max_force_n) + kUnit_n;
      wrong += in_bounds ? 0 : 1;
      strong += std::abs(b.force()) > 1.0 ? 1 : 0;
      last_ns = b.clock.now_ns;
      last_n = b.force();
    };
    const std::array<int, 4> errors = {-EPIPE, -EPROTO, -EOVERFLOW, -EILSEQ};
    for (int k = 0; k < 30'000; ++k) {
      if (one_in(100)) b.arming += 1;
      if (one_in(40)) b.force_n = static_cast<Real>(static_cast<int>(random() % 9) - 4);
      if (one_in(5000)) b.force_n = std::numeric_limits<Real>::quiet_NaN();
      if (one_in(500))
        b.carrier->fail_next(one_in(2) ? kInEndpoint : kOutEndpoint, errors[random() % 4],
                             static_cast<unsigned>(1 + random() % 6));
      if (one_in(500)) b.carrier->refuse_submit(one_in(2) ? kInEndpoint : kOutEndpoint, -ENOMEM);
      if (one_in(4000)) b.carrier->fail_next(kInEndpoint, -EPROTO, 40);
      if (one_in(3000)) b.link->servo_lost();
      if (one_in(300)) b.clock.now_ns += static_cast<std::int64_t>(random() % 30'000'000);
      b.ready = !one_in(1000);
      b.step(!one_in(20), !one_in(30));
    }
    CHECK(wrong == 0);
    CHECK(strong > 3000);
    CHECK(connects > 2u);
    CHECK(b.link->counters().in_failed > 50u);
    CHECK(b.link->counters().send_failed > 50u);
  }
}
