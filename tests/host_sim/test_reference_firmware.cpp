// SPDX-License-Identifier: Apache-2.0
/// The device's side of the protocol in C against ReferenceModel, which shares nothing with it: a
/// seeded script of periods, commands and faults, and the same reports byte for byte. Firmware with
/// one rule broken must differ.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "hal/firmware/reference_device.h"
#include "host_sim/device/reference_model.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::sim {
namespace {

/// Rules that a firmware may break.
enum class BrokenRule {
  kNone,
  kFedByRefused,      ///< rejected commands feed the watchdog
  kCutForgotten,      ///< a command with bit 0 set acknowledges the cut
  kStopForgotten,     ///< the emergency stop ends with its input
  kBornReady,         ///< no command with bit 0 clear is needed after power-up
  kReplay,            ///< a sequence is accepted twice
  kNotCounted,        ///< rejected commands are not counted
  kBusGoesUnnoticed,  ///< a bus reset leaves the drives on
  kPushAtOnce,        ///< drives that go on give at once what is asked for
  kVersionKept        ///< a host that comes after one of 1.1 gets its reports unasked
};

/// Both devices, moved together.
class FirmwarePair {
 public:
  FirmwarePair(BrokenRule broken, std::uint64_t seed)
      : broken_(broken), engine_(seed), model_(settings(), wandering) {
    const hal::ReferenceBlock b = model_.block();
    haptic_facts facts{};
    facts.twist_sensed = 1;
    facts.sensed_dof = b.sensed_dof;
    facts.driven_dof = b.driven_dof;
    facts.report_period_us = b.report_period_us;
    facts.watchdog_ms = b.watchdog_ms;
    facts.max_force = b.max_force;
    facts.max_torque = b.max_torque;
    facts.max_force_rate_mn_per_s = b.max_force_rate_mn_per_s;
    facts.max_torque_rate_mnm_per_s = b.max_torque_rate_mnm_per_s;
    facts.mass_mg = b.mass_mg;
    facts.damping_uns_per_m = b.damping_uns_per_m;
    facts.encoder_step_nm = b.encoder_step_nm;
    facts.encoder_step_nrad = b.encoder_step_nrad;
    facts.latency_us = 250;
    facts.largest_gap_um = 70'000;
    std::copy_n(kName, sizeof facts.name, facts.name);  // without an end
    std::copy_n(kSerial, 4, facts.serial);
    facts_ = facts;
    power_up();
  }

  [[nodiscard]] bool same_block() {
    return same_answer(hal::kReferenceBlockBytes) && same_answer(hal::kReferenceLongBlockBytes);
  }

  /// One random event; false: the two differ.
  [[nodiscard]] bool step() {
    const std::uint64_t draw = engine_() % 1000;
    if (draw < 500) return period();
    if (draw < 980) return command();
    if (draw < 984) return power_up();
    if (draw < 988) return bus_reset();
    if (draw < 991) return same_answer(engine_() % 300);
    if (draw < 994) {
      stopped_ = !stopped_;
      model_.press_emergency_stop(stopped_);
    } else {
      constexpr std::uint32_t kFaults[] = {0, 0, kDeviceOverheated, kDeviceDriveFault,
                                           kDeviceNotHomed};
      faults_ = kFaults[engine_() % 5];
      model_.set_faults(faults_);
    }
    return period();
  }
  [[nodiscard]] std::uint32_t pushes() const { return pushes_; }
  [[nodiscard]] std::uint32_t cuts() const { return model_.cuts(); }

 private:
  static constexpr const char* kName = "Desk arm of two\xc3\xa4 links and more";
  static constexpr const char* kSerial = "007";

  bool same_answer(std::size_t size) {
    std::vector<std::uint8_t> expected(size), got(size);
    const std::size_t length = model_.answer_into(expected);
    const std::int32_t answered = haptic_device_answer(&device_, 0xc1, 1, 1, got.data(), size);
    return answered == (length > 0 ? static_cast<std::int32_t>(length) : -1) && got == expected;
  }

  static ReferenceModelSettings settings() {
    ReferenceModelSettings s;
    s.speaks_1_1 = true;
    s.latency_s = 250e-6;
    s.largest_gap_m = 0.07;
    s.name = kName;
    s.serial = kSerial;
    s.hand = *hand_named("light");
    return s;
  }
  static HandAction wandering(double t_s) {
    HandAction action;
    action.target.x0_w = Vector(0.03 * std::sin(3 * t_s), 0.02 * std::sin(t_s), 0.01);
    action.target.q_wa = rotation_of(Vector(2 * std::sin(2 * t_s), std::sin(t_s), -0.2));
    action.switches = std::sin(t_s) > 0 ? 5 : 0;
    action.gap_m = 0.04 + 0.04 * std::sin(4 * t_s);  // beyond its largest at times
    return action;
  }

  bool power_up() {
    model_.power_up();
    faults_ = 0;
    haptic_device_begin(&device_, &facts_);
    if (broken_ == BrokenRule::kBornReady) device_.is_fresh = 0;
    return same_report();
  }
  bool bus_reset() {
    model_.bus_event();
    const std::uint8_t minor = device_.minor;
    if (broken_ != BrokenRule::kBusGoesUnnoticed) haptic_device_bus_event(&device_);
    if (broken_ == BrokenRule::kVersionKept) device_.minor = minor;
    return same_drive();
  }
  bool period() {
    model_.advance();
    return same_report();
  }

  /// The sample comes from the report of the model; the firmware has to know all else.
  bool same_report() {
    const std::vector<std::uint8_t> expected = model_.report();
    hal::ReferenceReport r;
    if (hal::decode(expected, r) != hal::CodecVerdict::kOk) return false;
    haptic_sample sample{};
    sample.time_us = now_us_ = r.time_us;
    for (std::size_t k = 0; k < 3; ++k) {
      sample.position_nm[k] = r.position[k];
      sample.velocity_um_per_s[k] = r.velocity[k];
      sample.angular_velocity_urad_per_s[k] = r.angular_velocity[k];
    }
    for (std::size_t k = 0; k < 4; ++k) sample.orientation[k] = r.orientation[k];
    sample.switches = r.switches;
    sample.gap_is_measured = 1;
    sample.gap_um = r.gripper > 0 ? r.gripper - 1 : 12'345;
    sample.faults = faults_ & (kDeviceOverheated | kDeviceDriveFault);
    sample.is_calibrated = (faults_ & kDeviceNotHomed) == 0;
    sample.is_fatal = (faults_ & kDeviceDriveFault) != 0;
    sample.stop_is_pressed = stopped_;
    if (broken_ == BrokenRule::kStopForgotten && !stopped_) device_.is_stopped = 0;
    std::vector<std::uint8_t> got(HAPTIC_REPORT_BYTES);
    return haptic_device_period(&device_, &sample, got.data(), got.size()) == got.size() &&
           got == expected && same_drive();
  }

  /// Mostly as a host sends them, also replayed, damaged, of another length, from far away.
  bool command() {
    hal::ReferenceCommand c;
    c.drives_on = engine_() % 4 != 0;
    c.sequence = model_.accepted() + 1;
    const std::uint64_t kind = engine_() % 20;
    if (kind == 0) c.sequence = model_.accepted();
    if (kind == 1) c.sequence = static_cast<std::uint32_t>(engine_());
    c.tick = static_cast<std::uint32_t>(engine_());
    for (std::size_t k = 0; k < 3; ++k) {
      c.force[k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(engine_())) >> shift();
      c.torque[k] = static_cast<std::int32_t>(static_cast<std::uint32_t>(engine_())) >> shift();
    }
    std::vector<std::uint8_t> bytes(hal::kReferenceCommandBytes);
    hal::encode(c, std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
    if (kind == 2) bytes[engine_() % 56] ^= static_cast<std::uint8_t>(1u << engine_() % 8);
    if (kind == 3) bytes.resize(engine_() % 112);
    // A host that falls silent now and then, so that the watchdog has its turn.
    if (silent_ > 0 && --silent_ > 0 && kind > 3) return true;
    if (engine_() % 200 == 0) silent_ = 60;

    const bool expected = model_.command(bytes);
    pushes_ += expected && model_.drives_on() ? 1u : 0u;
    const haptic_device before = device_;
    if (broken_ == BrokenRule::kCutForgotten && c.drives_on) device_.is_cut = 0;
    if (broken_ == BrokenRule::kReplay && c.sequence == device_.accepted) --device_.accepted;
    const bool got = haptic_device_command(&device_, bytes.data(), bytes.size(), now_us_) == 1;
    if (broken_ == BrokenRule::kPushAtOnce && got) device_.slewed_us = 1'000'000;
    if (broken_ == BrokenRule::kFedByRefused && !got) device_.fed_us = now_us_;
    if (broken_ == BrokenRule::kNotCounted && !got) device_.rejected = before.rejected;
    return got == expected && same_drive();
  }
  unsigned shift() { return static_cast<unsigned>(engine_() % 24); }

  /// The model keeps the wrench as asked for; the firmware shortens it at once, to 2 units.
  bool same_drive() {
    const haptic_drive& drive = *haptic_device_drive(&device_);
    return (drive.is_on != 0) == model_.drives_on() &&
           is_near(drive.force, model_.handed().force_w / hal::kReferenceForceUnit_n,
                   facts_.max_force) &&
           is_near(drive.torque, model_.handed().torque_w / hal::kReferenceTorqueUnit_nm,
                   facts_.max_torque);
  }
  static bool is_near(const std::int32_t (&got)[3], const Vector& asked, double limit) {
    const double norm = asked.norm();
    const Vector exact = norm > limit ? Vector(asked * (limit / norm)) : asked;
    const Vector found(got[0], got[1], got[2]);
    return (found - exact).cwiseAbs().maxCoeff() <= 2.01 && found.norm() <= limit * (1 + 1e-12);
  }

  BrokenRule broken_;
  std::mt19937_64 engine_;
  ReferenceModel model_;
  haptic_facts facts_{};
  haptic_device device_{};
  std::uint64_t now_us_ = 0;
  std::uint32_t faults_ = 0, pushes_ = 0;
  bool stopped_ = false;
  int silent_ = 0;
};

constexpr std::uint64_t kFirmwareSeed = 60'119;

/// The step at which the two differ; `steps`: at none.
int first_difference(FirmwarePair& pair, int steps) {
  for (int k = 0; k < steps; ++k) {
    if (!pair.step()) return k;
  }
  return steps;
}

}  // namespace

TEST_SUITE("host_sim.reference_firmware") {
  TEST_CASE("firmware in C and the model: same reports, byte for byte, over 100 000 events") {
    constexpr int kSteps = 100'000;
    FirmwarePair pair(BrokenRule::kNone, kFirmwareSeed);
    CHECK(pair.same_block());
    CAPTURE(kFirmwareSeed);
    CHECK(first_difference(pair, kSteps) == kSteps);
    CHECK(pair.pushes() > 1000);
    CHECK(pair.cuts() > 20);
  }

  TEST_CASE("firmware with one rule broken differs") {
    for (const BrokenRule rule :
         {BrokenRule::kFedByRefused, BrokenRule::kCutForgotten, BrokenRule::kStopForgotten,
          BrokenRule::kBornReady, BrokenRule::kReplay, BrokenRule::kNotCounted,
          BrokenRule::kBusGoesUnnoticed, BrokenRule::kPushAtOnce, BrokenRule::kVersionKept}) {
      CAPTURE(static_cast<int>(rule));
      constexpr int kSteps = 20'000;
      FirmwarePair pair(rule, kFirmwareSeed);
      CHECK(first_difference(pair, kSteps) < kSteps);
    }
  }
}

}  // namespace haptic::sim
