// SPDX-License-Identifier: Apache-2.0
// A device whose silence is a hand at rest, through driver, report flow, servo tick and core.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "hal/drivers/spacemouse_driver.hpp"
#include "hal/usb/report_flow.hpp"
#include "hal/usb/usb_link.hpp"
#include "host_sim/lab/faults/fault_run.hpp"
#include "host_sim/lab/faults/fault_script.hpp"
#include "rt_core/servo_tick.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr double kAbove_m = 0.010;  // of the part over the wall at the start
constexpr std::int16_t kFull = 350;

/// Reports go in only.
struct NoOutput final : hal::ReportTransfers {
  std::span<std::uint8_t> out_bytes() noexcept override { return {}; }
  bool busy() const noexcept override { return false; }
  hal::SendOutcome send(std::size_t) noexcept override { return hal::SendOutcome::kFailed; }
  void cancel_out() noexcept override {}
  bool lost() const noexcept override { return false; }
  hal::ZeroCommand zero_target() const noexcept override { return {}; }
};

/// The cap over the wall of the fault matrix, in the test's own time.
struct RestingHand {
  RestingHand() {
    hal::LinkSettings settings;
    settings.clock = [](void* self) { return static_cast<RestingHand*>(self)->now_ns; };
    settings.clock_context = this;
    flow = std::make_unique<hal::ReportFlow>(driver, mailbox, link = settings);
    flow->attach(transfers);
    ServoParameters parameters;
    parameters.map.offset_w.z() = static_cast<Real>(sim::kTouchHeight_m + kAbove_m);
    servo = std::make_unique<ServoTick>(session.core(), parameters,
                                        session.view().header().capacity, nullptr);
    REQUIRE(driver.start(device) == hal::HalStatus::kOk);
    flow->begin_start();
    flow->begin_reports();
  }

  /// Milliseconds pass; the cap is held at `axes` and says so every 8 ms, or rests in silence.
  void pass(int ms, const std::array<std::int16_t, 6>* axes) {
    for (int k = 0; k < ms; ++k) {
      now_ns += kPeriod_ns;
      if (axes != nullptr && k % 8 == 0) device.push(*axes);
      std::array<std::uint8_t, 64> bytes{};
      for (std::size_t n = device.on_in(bytes); n > 0; n = device.on_in(bytes)) {
        flow->on_report(std::span(bytes).first(n));
        flow->on_report_done();
      }
      flow->turn();
      ServoInput input;
      input.state = servo_side.state();
      input.now_ns = now_ns + kPeriod_ns / 10;
      result = servo->step(input);
      lowest_m = std::min(lowest_m, static_cast<double>(height()));
      faults |= result.faults;
      newest = input.state;
    }
  }
  [[nodiscard]] Real height() const { return result.rendered.proxy_pose_wa.p_wa.z(); }
  [[nodiscard]] Real sideways() const { return result.rendered.proxy_pose_wa.p_wa.x(); }

  std::int64_t now_ns = 1'000'000'000;
  const std::vector<std::byte> scene = sim::fault_scene();
  sim::CoreSession session{scene, "resting hand"};
  SpaceMouseCounterpart device{true};
  hal::SpaceMouseDriver driver;
  hal::MailboxMemory mailbox;
  hal::ServoSide servo_side{mailbox};
  hal::LinkSettings link;
  NoOutput transfers;
  std::unique_ptr<hal::ReportFlow> flow;
  std::unique_ptr<ServoTick> servo;
  ServoResult result;
  haptic::DeviceState newest;
  double lowest_m = 1;
  std::uint32_t faults = 0;
};

}  // namespace

TEST_SUITE("host_sim.resting_hand") {
  TEST_CASE(
      "a cap at rest is a hand at rest: what is pressed on a wall stays outside, and goes on") {
    RestingHand h;
    constexpr std::array<std::int16_t, 6> kDown = {0, 0, kFull, 0, 0, 0}, kRest{},
                                          kRight = {kFull, 0, 0, 0, 0, 0};
    h.pass(20, nullptr);
    CHECK(h.newest.link == LinkState::kReady);
    h.pass(200, &kDown);  // 20 mm: twice as far as the wall is away
    h.pass(1, &kRest);
    const double goal_m = static_cast<double>(h.result.rendered.goal_pose_wa.p_wa.z());
    CHECK(goal_m == doctest::Approx(sim::kTouchHeight_m - kAbove_m).epsilon(0.05));
    CHECK(static_cast<double>(h.height()) == doctest::Approx(sim::kTouchHeight_m).epsilon(1e-3));
    const std::uint64_t sequence = h.newest.sequence;
    const Real before = h.sideways();
    h.pass(1000, nullptr);
    CHECK(static_cast<double>(h.height()) == doctest::Approx(sim::kTouchHeight_m).epsilon(1e-3));
    CHECK(h.lowest_m > sim::kTouchHeight_m - 1e-4);
    CHECK(static_cast<double>(h.sideways()) == doctest::Approx(static_cast<double>(before)));
    CHECK(static_cast<double>(h.result.rendered.goal_pose_wa.p_wa.z()) == doctest::Approx(goal_m));
    CHECK(h.newest.sequence - sequence >=
          790u);  // a state each period, a quarter later after a report
    CHECK(h.newest.twist_d.linear_m_per_s[2] == 0.0_r);
    CHECK(h.faults == 0u);
    h.pass(100, &kRight);
    h.pass(1, &kRest);
    h.pass(100, nullptr);
    CHECK(h.lowest_m > sim::kTouchHeight_m - 1e-4);
    CHECK(static_cast<double>(h.sideways() - before) == doctest::Approx(0.01).epsilon(0.1));
    CHECK(h.faults == 0u);
  }
}
