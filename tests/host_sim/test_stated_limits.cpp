// SPDX-License-Identifier: Apache-2.0
// What reaches the wire is bounded by what the connected device states, without a configuration.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "hal/realtime/flight_report.hpp"
#include "host_sim/lab/faults/fault_run.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr std::uint32_t kHeld = 1;  // the deadman switch
constexpr double kPressed_m = -0.0185, kLifted_m = 0.005;
constexpr double kForceUnits_n = 2 * hal::kReferenceForceUnit_n;

hal::ReferenceBlock block_of(double force_n, double rate_n_per_s) {
  hal::ReferenceBlock block;
  block.max_force = static_cast<std::uint32_t>(force_n / hal::kReferenceForceUnit_n);
  block.max_force_rate_mn_per_s = static_cast<std::uint32_t>(1e3 * rate_n_per_s);
  return block;
}

/// A cube pressed on a wall with some 18 N, over the real libusb; every command that went out.
class Wire {
 public:
  explicit Wire(const StackSettings& stack) : scene_(fault_scene()), stage_(scene_, stack) {}
  Wire(const hal::ReferenceBlock& block, bool report_clocked)
      : Wire(fault_stack({StackCarrier::kUsb, report_clocked, 1, 1}, fault_place())) {
    state(block);
    pass(60);
  }

  void state(const hal::ReferenceBlock& block) {
    stage_.bus().with_model([&](auto& model) { model.state_block(block); });
  }
  void hand(double height_m, std::uint32_t switches, std::size_t periods) {
    HandPlan& plan = stage_.hand();
    plan.from = plan.at(stage_.time_s());
    plan.to = {Vector(0, 0, kTouchHeight_m + height_m), Rotation::Identity()};
    plan.begin_s = stage_.time_s();
    plan.end_s = plan.begin_s + 0.1;
    plan.switches = switches;
    pass(periods);
  }
  /// Off the wall, released, pressed, and onto the wall.
  void arm_and_press() {
    hand(kLifted_m, 0, 150);
    hand(kLifted_m, kHeld, 150);
    hand(kPressed_m, kHeld, 400);
  }
  void replug(const hal::ReferenceBlock& block) {
    stage_.unplug();
    pass(30);
    state(block);
    stage_.plug(true);
    pass(60);
  }
  void pass(std::size_t periods) {
    for (std::size_t k = 0; k < periods; ++k) {
      newest = stage_.step();
      seen |= newest.device;
      sent.insert(sent.end(), newest.sent.begin(), newest.sent.end());
    }
  }
  void forget() { sent.clear(), seen = 0; }
  [[nodiscard]] double largest_n() const {
    double largest = 0;
    for (const StackSend& send : sent) largest = std::max(largest, send.wrench.force_w.norm());
    return largest;
  }
  /// Largest change between two commands that follow each other [N/s].
  [[nodiscard]] double fastest_n_per_s() const {
    double fastest = 0;
    for (std::size_t k = 1; k < sent.size(); ++k) {
      const double elapsed_s = 1e-9 * static_cast<double>(sent[k].stamp_ns - sent[k - 1].stamp_ns);
      const double change_n =
          (sent[k].wrench.force_w - sent[k - 1].wrench.force_w).norm() - kForceUnits_n;
      if (change_n > 0 && elapsed_s > 0) fastest = std::max(fastest, change_n / elapsed_s);
      if (change_n > 0 && elapsed_s <= 0) fastest = 1e9;
    }
    return fastest;
  }

  FaultSample newest;
  std::vector<StackSend> sent;
  std::uint32_t seen = 0;  ///< DeviceFault that the servo thread got

 private:
  std::vector<std::byte> scene_;
  StackStage stage_;
};

}  // namespace

TEST_SUITE("host_sim.stated_limits") {
  TEST_CASE(
      "a device that states 1 N and 50 N/s is sent no more, and half where its ramp asks it") {
    for (const bool report_clocked : {false, true}) {
      CAPTURE(report_clocked);
      hal::ReferenceBlock block = block_of(1.0, 50.0);
      {
        Wire wire(block, report_clocked);
        wire.arm_and_press();
        CHECK(wire.newest.arming == ArmingState::kArmed);
        // 20 ms of watchdog: what cannot fall to zero within half of that is not given.
        CHECK(wire.largest_n() <= 0.5 + kForceUnits_n);
        CHECK(wire.largest_n() >= 0.49);
        CHECK(wire.fastest_n_per_s() <= 50.0 * (1 + 1e-9));
      }
      block.watchdog_ms = 100;
      Wire wire(block, report_clocked);
      wire.arm_and_press();
      CHECK(wire.newest.arming == ArmingState::kArmed);
      CHECK(wire.largest_n() <= 1.0 + kForceUnits_n);
      CHECK(wire.largest_n() >= 0.99);
      CHECK(wire.fastest_n_per_s() <= 50.0 * (1 + 1e-9));
    }
  }

  TEST_CASE("a re-plug of 0.2 N for 12 N disarms, says so, and is bounded by 0.2 N") {
    for (const bool report_clocked : {false, true}) {
      CAPTURE(report_clocked);
      Wire wire(block_of(12.0, 2000.0), report_clocked);
      wire.arm_and_press();
      CHECK(wire.largest_n() >= 9.0);
      CHECK((wire.seen & kLinkOtherDevice) == 0u);

      wire.forget();
      wire.replug(block_of(0.2, 2000.0));
      CHECK(wire.newest.arming == ArmingState::kFaulted);
      CHECK((wire.seen & kLinkOtherDevice) != 0u);
      CHECK((wire.newest.device & kLinkOtherDevice) == 0u);  // answered, and latched until armed
      CHECK((wire.newest.safety & kFaultDevice) != 0u);
      // Held on the wall all the while: nothing but zeros until released and pressed again.
      wire.forget();
      wire.pass(200);
      CHECK(wire.sent.size() >= 200);
      CHECK(wire.largest_n() == 0.0);

      wire.forget();
      wire.arm_and_press();
      CHECK(wire.newest.arming == ArmingState::kArmed);
      CHECK(wire.newest.safety == 0u);
      CHECK(wire.largest_n() <= 0.2 + kForceUnits_n);
      CHECK(wire.largest_n() >= 0.19);

      // The first one again: its own limits, and again disarmed.
      wire.forget();
      wire.replug(block_of(12.0, 2000.0));
      CHECK((wire.seen & kLinkOtherDevice) != 0u);
      CHECK(wire.newest.arming == ArmingState::kFaulted);
      wire.arm_and_press();
      CHECK(wire.largest_n() >= 9.0);
    }
  }

  TEST_CASE("a re-plug of an equal device is no other device") {
    Wire wire(block_of(12.0, 2000.0), false);
    wire.arm_and_press();
    wire.replug(block_of(12.0, 2000.0));
    CHECK((wire.seen & kLinkLost) != 0u);
    CHECK((wire.seen & kLinkOtherDevice) == 0u);
  }

  TEST_CASE("a loop of several ticks per report: no sawtooth on the wire") {
    for (const unsigned ticks : {1u, 4u, 6u, 8u}) {
      CAPTURE(ticks);
      StackSettings stack = fault_stack({}, fault_place());
      stack.model.report_rate_hz = 250;
      stack.model.watchdog_ns = 40'000'000;
      stack.ticks_per_report = ticks;
      Wire wire(stack);
      wire.arm_and_press();
      CHECK(wire.newest.arming == ArmingState::kArmed);
      wire.forget();
      wire.pass(100);
      REQUIRE(wire.sent.size() >= 100);
      double least_n = 1e9;
      for (const StackSend& send : wire.sent)
        least_n = std::min(least_n, send.wrench.force_w.norm());
      CHECK(wire.largest_n() > 5.0);
      CHECK(wire.largest_n() - least_n < 0.05);
    }
  }
}
