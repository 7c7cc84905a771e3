// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "host_sim/device/reference_model.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

// The driver of the reference device over the model of one, without a bus.

using Bytes = std::vector<std::uint8_t>;

HandAction still(double) { return {}; }

/// Control pipe of the model, for the driver's start.
class ModelPort final : public hal::UsbPort {
 public:
  explicit ModelPort(ReferenceModel& model) : model_(model) {}
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned) noexcept override {
    CHECK(request.request_type == hal::kReferenceBlockRequestType);
    REQUIRE(bytes.size() == hal::kReferenceLongBlockBytes);
    moved = model_.answer_into(bytes);
    return hal::HalStatus::kOk;
  }
  hal::HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  ReferenceModel& model_;
};

/// The driver of hal over the model: one period, in which the renderer asks for `force_n` along x.
struct DrivenModel {
  DrivenModel() : model({}, still), port(model) {
    REQUIRE(driver.start(port) == hal::HalStatus::kOk);
  }
  void turn(double force_n) {
    model.advance();
    REQUIRE(driver.read(model.report(), 0, state) == hal::ReportVerdict::kState);
    Bytes bytes(hal::kReferenceCommandBytes);
    Wrench wrench;
    wrench.force_w.x() = static_cast<Real>(force_n);
    Wrench handed;
    const std::size_t length = driver.write(wrench, ++tick, bytes, handed);
    REQUIRE(length == bytes.size());
    delivered_n = static_cast<double>(handed.force_w.x());
    if (reached) REQUIRE(model.command(bytes));
  }

  ReferenceModel model;
  ModelPort port;
  hal::ReferenceDriver driver;
  haptic::DeviceState state;
  std::uint64_t tick = 0;
  double delivered_n = 0;
  bool reached = true;
};

Bytes bytes_of(const hal::ReferenceCommand& command) {
  Bytes bytes(hal::kReferenceCommandBytes);
  hal::encode(command, std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
  return bytes;
}

/// Force in units of 10 uN along the axes.
Bytes push(std::uint32_t sequence, std::array<std::int32_t, 3> force, bool drives_on = true) {
  hal::ReferenceCommand command;
  command.drives_on = drives_on;
  command.sequence = sequence;
  command.tick = 1000 + sequence;
  command.force = force;
  return bytes_of(command);
}

/// The drives stay off until they were asked off once. Twice here, so that 1 is a newer sequence.
void wake(ReferenceModel& model) {
  REQUIRE(model.command(push(0x7fffffffu, {0, 0, 0}, false)));
  REQUIRE(model.command(push(0xfffffffeu, {0, 0, 0}, false)));
}

/// And the drives have been on for so long that they give all that is asked for.
void drive(ReferenceModel& model) {
  wake(model);
  REQUIRE(model.command(push(0xffffffffu, {0, 0, 0})));
  for (int k = 0; k < 10; ++k) model.advance();
}

hal::ReferenceReport read(const ReferenceModel& model) {
  hal::ReferenceReport report;
  REQUIRE(hal::decode(model.report(), report) == hal::CodecVerdict::kOk);
  return report;
}

/// A hand on a slow curve with a turn, so that everything in a report changes.
HandAction wandering(double t_s) {
  HandAction action;
  action.target.x0_w = Vector(0.03 * std::sin(3 * t_s), 0.02 * t_s, 0.01 * std::cos(5 * t_s));
  action.target.q_wa = rotation_of(Vector(0.5 * std::sin(2 * t_s), 0.3 * t_s, -0.2));
  action.switches = t_s > 0.1 ? 5 : 0;
  return action;
}

ReferenceModelSettings held_lightly() {
  ReferenceModelSettings settings;
  settings.hand = *hand_named("light");
  return settings;
}

}  // namespace

TEST_SUITE("host_sim.reference_model") {
  TEST_CASE("report: power-up, sequence, time, and what really is") {
    ReferenceModel model(held_lightly(), wandering);
    CHECK(read(model).sequence == 0);
    CHECK(read(model).status == (hal::kReferenceCalibrated | hal::kReferenceTwistValid));
    for (std::uint32_t k = 1; k <= 300; ++k) {
      model.advance();
      const hal::ReferenceReport r = read(model);
      REQUIRE(r.sequence == k);
      CHECK(r.time_us == 1000 * std::uint64_t{k});
      CHECK(r.switches == (k > 100 ? 5u : 0u));
      const DeviceState& real = model.state();
      for (std::size_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<Eigen::Index>(i);
        // Half an encoder step and half a unit.
        CHECK(std::abs(r.position[i] * 1e-9 - real.x0_w[axis]) <= 0.5e-6 + 0.6e-9);
        CHECK(std::abs(r.velocity[i] * 1e-6 - real.velocity_w[axis]) <= 0.51e-6);
        CHECK(std::abs(r.angular_velocity[i] * 1e-6 - real.angular_velocity_w[axis]) <= 0.51e-6);
      }
      const double unit = hal::kReferenceOrientationUnit;
      const Rotation seen(r.orientation[3] * unit, r.orientation[0] * unit, r.orientation[1] * unit,
                          r.orientation[2] * unit);
      CHECK(seen.norm() == doctest::Approx(1).epsilon(1e-8));
      CHECK(seen.w() >= 0);
      // Half a step on each of three axes.
      CHECK(seen.normalized().angularDistance(real.q_wa) <= 0.5e-5 * std::sqrt(3.0) + 1e-7);
    }
    CHECK(model.state().velocity_w.norm() > 0.01);
    CHECK(model.time_s() == doctest::Approx(0.3));
  }

  TEST_CASE("report: positions are whole encoder steps from where it was placed") {
    ReferenceModelSettings settings = held_lightly();
    settings.encoder_step_m = 2.5e-5;
    ReferenceModel model(settings, wandering);
    DeviceState begin;
    begin.x0_w = Vector(0.001234567, 0, 0);
    model.place(begin);
    for (int k = 0; k < 200; ++k) {
      model.advance();
      for (std::size_t i = 0; i < 3; ++i) {
        const double home = i == 0 ? 1234567 : 0;
        const double steps = (read(model).position[i] - home) / 25000.0;
        CHECK(std::abs(steps - std::nearbyint(steps)) < 1e-4);
      }
    }
  }

  TEST_CASE("command: acts in the next period, to the unit, and is confirmed") {
    ReferenceModel model({}, still);
    drive(model);
    model.advance();
    CHECK(model.command(push(1, {123456, -7, 40000})));
    model.advance();
    CHECK((model.acting().force_w - Vector(1.23456, -0.00007, 0.4)).norm() < 1e-12);
    // From rest: x = F/m t^2 / 2 except for the damping.
    CHECK(model.state().x0_w.x() == doctest::Approx(1.23456 / 0.1 * 0.5e-6).epsilon(0.01));
    const hal::ReferenceReport r = read(model);
    CHECK((r.status & hal::kReferenceDrivesOn) != 0);
    CHECK(r.accepted_sequence == 1);
    CHECK(r.accepted_tick == 1001);
    CHECK(r.rejected == 0);
    // Bit clear: off, with any wrench.
    CHECK(model.command(push(2, {123456, 0, 0}, false)));
    model.advance();
    CHECK(model.acting().force_w.norm() == 0);
    CHECK_FALSE(model.drives_on());
  }

  TEST_CASE("command: beyond the limits it is shortened and not turned") {
    ReferenceModel model({}, still);
    drive(model);
    hal::ReferenceCommand command;
    command.drives_on = true;
    command.sequence = 1;
    command.force = {3'000'000, 0, -4'000'000};
    command.torque = {0, 2'147'483'647, 0};
    CHECK(model.command(bytes_of(command)));
    model.advance();
    CHECK((model.acting().force_w - Vector(7.2, 0, -9.6)).norm() < 1e-9);
    CHECK((model.acting().torque_w - Vector(0, 0.3, 0)).norm() < 1e-9);
  }

  TEST_CASE("command: every flipped bit, wrong lengths and replays are rejected and counted") {
    ReferenceModel model({}, still);
    drive(model);
    model.advance();
    REQUIRE(model.command(push(10, {100, 0, 0})));
    std::uint32_t rejected = 0;
    const Bytes good = push(11, {500000, 0, 0});
    for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
      CHECK_FALSE(model.command(bad));
      CHECK(model.rejected() == ++rejected);
    }
    for (const std::size_t length : {0u, 1u, 55u, 57u, 96u}) {
      Bytes bad = good;
      bad.resize(length);
      CHECK_FALSE(model.command(bad));
      ++rejected;
    }
    for (const std::uint32_t sequence : {10u, 9u, 0u, 0x8000000au}) {
      CHECK_FALSE(model.command(push(sequence, {500000, 0, 0})));
      ++rejected;
    }
    model.advance();
    const hal::ReferenceReport r = read(model);
    CHECK(r.rejected == rejected);
    CHECK(r.accepted_sequence == 10);
    CHECK(r.accepted_tick == 1010);
    CHECK(model.acting().force_w.x() == doctest::Approx(1e-3));
    // Wraps.
    CHECK(model.command(push(0x7ffffff0u, {0, 0, 0})));
    CHECK(model.command(push(0xd0000000u, {0, 0, 0})));
    CHECK(model.command(push(0xffffffffu, {0, 0, 0})));
    CHECK(model.command(push(0, {0, 0, 0})));
    CHECK_FALSE(model.command(push(0xffffffffu, {0, 0, 0})));
  }

  TEST_CASE("watchdog: after 20 ms without an accepted command, and the way back") {
    ReferenceModelSettings settings;
    settings.device.delay_samples = 3;
    ReferenceModel model(settings, still);
    drive(model);
    REQUIRE(model.command(push(1, {100000, 0, 0})));
    for (int k = 1; k <= 19; ++k) {
      static_cast<void>(model.command(push(1, {900000, 0, 0})));  // rejected: does not feed it
      model.advance();
      REQUIRE(model.drives_on());
      CHECK(model.acting().force_w.x() == doctest::Approx(k > 3 ? 1.0 : 0.0));
    }
    model.advance();
    CHECK_FALSE(model.drives_on());
    CHECK(model.cuts() == 1);
    hal::ReferenceReport r = read(model);
    CHECK((r.status & hal::kReferenceWatchdogCut) != 0);
    CHECK((r.status & hal::kReferenceDrivesOn) == 0);
    CHECK((r.faults & kDeviceWatchdogCut) != 0);
    // What was under way never acts, and asking again does not help.
    for (std::uint32_t k = 2; k < 30; ++k) {
      CHECK(model.command(push(k, {100000, 0, 0})));
      model.advance();
      CHECK(model.acting().force_w.norm() == 0);
    }
    CHECK(model.command(push(30, {0, 0, 0}, false)));
    CHECK(model.command(push(31, {100000, 0, 0})));
    for (int k = 0; k < 5; ++k) model.advance();
    CHECK(model.acting().force_w.x() == doctest::Approx(1.0));
    r = read(model);
    CHECK((r.status & hal::kReferenceWatchdogCut) == 0);
    CHECK(r.faults == 0);
    // With the drives off it does not run.
    CHECK(model.command(push(32, {0, 0, 0}, false)));
    for (int k = 0; k < 100; ++k) model.advance();
    CHECK(model.cuts() == 1);
  }

  TEST_CASE("emergency stop and faults: off at once, latched until acknowledged") {
    ReferenceModel model({}, still);
    wake(model);
    REQUIRE(model.command(push(1, {100000, 0, 0})));
    model.advance();
    model.press_emergency_stop(true);
    model.advance();
    CHECK(model.acting().force_w.norm() == 0);
    CHECK((read(model).status & hal::kReferenceEmergencyStop) != 0);
    CHECK((read(model).faults & kDeviceEmergencyStop) != 0);
    CHECK(model.command(push(2, {0, 0, 0}, false)));  // still pressed
    CHECK((read(model).status & hal::kReferenceEmergencyStop) != 0);
    model.press_emergency_stop(false);
    CHECK(model.command(push(3, {100000, 0, 0})));
    CHECK_FALSE(model.drives_on());
    CHECK(model.command(push(4, {0, 0, 0}, false)));
    CHECK(model.command(push(5, {100000, 0, 0})));
    CHECK(model.drives_on());
    CHECK(read(model).faults == 0);

    model.set_faults(kDeviceNotHomed);
    CHECK_FALSE(model.drives_on());
    CHECK((read(model).status & hal::kReferenceCalibrated) == 0);
    CHECK(model.command(push(6, {100000, 0, 0})));
    CHECK_FALSE(model.drives_on());
    model.set_faults(kDeviceOverheated);
    CHECK(model.command(push(7, {100000, 0, 0})));
    CHECK(model.drives_on());
    CHECK(read(model).faults == kDeviceOverheated);
    model.set_faults(kDeviceDriveFault);
    CHECK_FALSE(model.drives_on());
  }

  TEST_CASE("drives on: what is asked for first begins at zero and grows at the stated rate") {
    for (const double rate_n_per_s : {2000.0, 0.0}) {  // 0: not stated, all 12 N in 10 ms
      ReferenceModelSettings settings;
      settings.max_force_rate_n_per_s = rate_n_per_s;
      ReferenceModel model(settings, still);
      wake(model);
      const double step_n = rate_n_per_s > 0 ? 2.0 : 1.2;
      for (std::uint32_t k = 0; k < 12; ++k) {
        REQUIRE(model.command(push(k + 1, {0, 1'000'000, 0})));
        CHECK(model.handed().force_w.y() == doctest::Approx(std::min(10.0, k * step_n)));
        model.advance();
      }
      REQUIRE(model.command(push(20, {0, 500'000, 0})));
      CHECK(model.handed().force_w.y() == doctest::Approx(5.0));
      model.drives_off();  // a bus reset, which needs no word of the host
      REQUIRE(model.command(push(21, {0, 500'000, 0})));
      CHECK(model.drives_on());
      CHECK(model.handed().force_w.norm() == 0);
    }
  }

  TEST_CASE("power-up: counters from 0; a jump of the encoders lasts until then") {
    ReferenceModel model({}, still);
    REQUIRE(model.command(push(77, {1000, 0, 0})));
    CHECK_FALSE(model.command(push(77, {1000, 0, 0})));
    for (int k = 0; k < 5; ++k) model.advance();
    const std::int32_t before = read(model).position[1];
    model.jump_encoders(Vector(0, 0.004, 0));
    CHECK(read(model).position[1] - before == 4'000'000);
    model.power_up();
    const hal::ReferenceReport r = read(model);
    CHECK(r.sequence == 0);
    CHECK(r.rejected == 0);
    CHECK(r.accepted_sequence == 0);
    CHECK(r.position[1] == before);
    CHECK_FALSE(model.drives_on());
    CHECK(model.command(push(1, {0, 0, 0})));
  }

  TEST_CASE("delay: a wrench acts so many periods later") {
    for (const unsigned delay : {0u, 1u, 5u}) {
      ReferenceModelSettings settings;
      settings.device.delay_samples = delay;
      ReferenceModel model(settings, still);
      drive(model);
      for (std::uint32_t k = 1; k <= 12; ++k) {
        REQUIRE(model.command(push(k, {static_cast<std::int32_t>(k) * 1000, 0, 0})));
        model.advance();
        const double expected = k > delay ? 0.01 * (k - delay) : 0;
        CHECK(model.acting().force_w.x() == doctest::Approx(expected));
      }
    }
  }

  TEST_CASE("equal calls give equal bytes, regardless of the commands") {
    constexpr unsigned kSeed = 20240611;
    CAPTURE(kSeed);
    std::vector<Bytes> runs[2];
    for (std::vector<Bytes>& run : runs) {
      std::mt19937 random(kSeed);
      ReferenceModel model(held_lightly(), wandering);
      for (std::uint32_t k = 1; k <= 2000; ++k) {
        const auto number = [&random] {
          return static_cast<std::int32_t>(random() % 2'000'000) - 1'000'000;
        };
        Bytes bytes = push(k, {number(), number(), number()}, random() % 50 != 0);
        if (random() % 20 == 0) bytes[random() % bytes.size()] ^= 0x10;
        if (random() % 100 != 0) static_cast<void>(model.command(bytes));
        model.advance();
        run.push_back(model.report());
      }
      CHECK(model.rejected() > 50);
    }
    CHECK(runs[0] == runs[1]);
  }

  TEST_CASE("driver: its wrench acts as it says, and comes back only through zero after a cut") {
    DrivenModel d;
    CHECK(static_cast<double>(d.driver.capabilities().max_force_n) == doctest::Approx(12));
    for (int k = 0; k < 10; ++k) {
      d.turn(0);
      CHECK(d.state.link == LinkState::kReady);
    }
    CHECK(d.model.drives_on());
    for (int k = 1; k <= 20; ++k) {
      d.turn(0.01 * k);
      CHECK(d.delivered_n == doctest::Approx(0.01 * k));
      d.model.advance();
      CHECK(d.model.acting().force_w.x() == doctest::Approx(d.delivered_n));
    }
    d.reached = false;
    for (int k = 0; k < 25; ++k) d.turn(0.2);
    CHECK((d.state.faults & kDeviceWatchdogCut) != 0);
    CHECK(d.model.cuts() == 1);
    d.reached = true;
    for (int k = 0; k < 10; ++k) {
      d.turn(0.2);  // still pushing: nothing
      CHECK(d.delivered_n == 0);
      CHECK(d.model.acting().force_w.norm() == 0);
    }
    for (int k = 0; k < 5; ++k) d.turn(0);
    d.turn(0.2);
    CHECK(d.delivered_n == doctest::Approx(0.2));
    CHECK(d.model.rejected() == 0);
  }

  TEST_CASE("block: says what the device does; settings out of range are refused") {
    ReferenceModelSettings settings;
    settings.device.max_force_n = 5;
    settings.device.mass_kg = 0.25;
    settings.report_rate_hz = 2000;
    settings.device.encoder_step_rad = 0.001;
    const hal::ReferenceBlock block = ReferenceModel(settings, still).block();
    CHECK(block.max_force == 500'000);
    CHECK(block.max_torque == 3'000'000);
    CHECK(block.mass_mg == 250'000);
    CHECK(block.report_period_us == 500);
    CHECK(block.watchdog_ms == 20);
    CHECK(block.encoder_step_nm == 1000);
    CHECK(block.encoder_step_nrad == 1'000'000);
    const auto refused = [](auto change) {
      ReferenceModelSettings bad;
      change(bad);
      CHECK_THROWS_AS(ReferenceModel(bad, still), tools::InputError);
    };
    refused([](auto& s) { s.report_rate_hz = 0; });
    refused([](auto& s) { s.report_rate_hz = std::nan(""); });
    refused([](auto& s) { s.watchdog_ns = 0; });
    refused([](auto& s) { s.max_force_n = -1; });
    refused([](auto& s) { s.device.mass_kg = 0; });
  }
}

}  // namespace haptic::sim
