// SPDX-License-Identifier: Apache-2.0
/// The whole way of a force: host, shared memory, bridge, serial bus, servo, and back.
#include <doctest/doctest.h>

#include "hal/bridge/bridge_service.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/process_peer.hpp"
#include "tests/bridges/arms/arm_bench.hpp"
#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/support/program_run.hpp"
#include "tools/bridges/dynamixel/dynamixel_device.hpp"

using namespace haptic;
using haptic::test::DynamixelEmulator;

namespace {

/// Driver and peer as a link has them.
class ArmHost final : public hal::UsbPort {
 public:
  explicit ArmHost(const std::string& path) : peer_(path) {}
  [[nodiscard]] bool connect() {
    return peer_.plug(hal::monotonic_ns()) == hal::HalStatus::kOk &&
           driver.start(*this) == hal::HalStatus::kOk;
  }
  /// A report, and a command for it.
  void turn(const Vec3& force) {
    peer_.wait(hal::monotonic_ns() + 2'000'000);
    std::uint8_t bytes[hal::kMaxReportBytes];
    std::int64_t sampled_ns = 0;
    // The driver passes nothing on until it has had a zero with the drives on.
    const bool was_on = driver.receipt().drives_on;
    const std::size_t size = peer_.report(hal::monotonic_ns(), bytes, sampled_ns);
    if (size == 0 ||
        driver.read(std::span(bytes).first(size), sampled_ns, state) != hal::ReportVerdict::kState)
      return;
    ++reports;
    Wrench wrench;
    if (was_on) wrench.force_w = force;
    Wrench delivered;
    const std::size_t sent = driver.write(wrench, ++tick_, bytes, delivered);
    if (sent > 0) peer_.command(hal::monotonic_ns(), std::span(bytes).first(sent));
  }
  void go() { peer_.unplug(); }

  hal::ReferenceDriver driver;
  DeviceState state;
  int reports = 0;

 private:
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned) noexcept override {
    return peer_.control(request, bytes, moved);
  }
  hal::HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  bool cancelled() const noexcept override { return false; }

  hal::ProcessPeer peer_;
  std::uint64_t tick_ = 0;
};

template <typename Condition>
bool arm_comes(int limit_ms, const Condition& condition) {
  for (const std::int64_t end = test::steady_ns() + std::int64_t{limit_ms} * 1'000'000;
       test::steady_ns() < end;) {
    if (condition()) return true;
    ::usleep(500);
  }
  return false;
}

}  // namespace

TEST_SUITE("bridges.arm_service") {
  TEST_CASE(
      "an arm behind a bridge: felt by a host, and let go when the host goes and at the end") {
    DynamixelEmulator bus(6, 1220);
    tools::DynamixelSettings arm;
    arm.arm = test::leader_settings(bus.path());
    arm.torque_limits_nm = {0.9, 0.9, 0.9, 0.5, 0.5, 0.5};
    arm.gravity_share = 0;
    tools::DynamixelDevice device(arm);
    const sim::test::ScratchFolder folder("arm_service");
    hal::BridgeSettings settings;
    settings.path = folder.file("socket");
    settings.watchdog_ns = 100'000'000;  // of the bridge: this machine may be late
    std::atomic<bool> stop{false};
    std::thread service([&] { CHECK(hal::serve_bridge(device, settings, stop) == 0); });
    {
      ArmHost host(settings.path);
      const bool is_connected = arm_comes(5000, [&] { return host.connect(); });
      CHECK(is_connected);
      // Up, at the end of the outstretched arm: joint 2 by its lever of 0.37 m, its servo reversed.
      const double right = -0.25 * -0.37 / 1.15 / 0.001;
      CHECK(arm_comes(5000, [&] {
        host.turn({0, 0, 0.25_r});
        return std::abs(bus.with([](auto& b) { return b.current(2); }) - right) < 1;
      }));
      CHECK(host.state.link == LinkState::kReady);
      CHECK(host.state.pose_dh.p_m[0] == doctest::Approx(0.37).epsilon(1e-6));
      const int before = host.reports;
      const std::int64_t begun = test::steady_ns();
      while (test::steady_ns() - begun < 300'000'000) host.turn({0, 0, 0.25_r});
      // At least half of the reports that its period promises.
      const auto due = 300'000'000 / device.facts().capabilities.report_period_ns;
      CHECK(host.reports - before > due / 2);
      host.go();
      CHECK(arm_comes(1000, [&] { return bus.with([](auto& b) { return b.current(2); }) == 0; }));
    }
    stop.store(true);
    service.join();
    bus.with([](auto& b) {
      CHECK(b.servo(2).table[64] == 0);
      CHECK(b.servo(2).table[11] == 3);
    });
  }
}
