// SPDX-License-Identifier: Apache-2.0
// Every refusal of device_fit over every carrier: a device that does not fit gets no command by any
// way that it comes in, and the person reads the same sentence.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/device_port.hpp"
#include "hal/local/local_link.hpp"
#include "hal/local/process_peer.hpp"
#include "tests/host_sim/usb_link_bench.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/run_device/device_fit.hpp"

using namespace haptic;
using namespace haptic::hal;
using namespace haptic::test;

namespace {

/// A device, the demands on it, and a part of the sentence that refuses it; empty: it fits.
struct Fitting {
  std::string name, says;
  tools::FitQuestion question;
  DeviceCapabilities device;
};

std::vector<Fitting> fittings() {
  Fitting fits;
  fits.name = "fits";
  fits.device = reference_capabilities();
  fits.device.mass_kg = 0.2_r;
  fits.device.damping_ns_per_m = 5;
  tools::FitQuestion& q = fits.question;
  q.scene = tools::default_parameters();
  q.scene.rate_hz = 1000;
  std::ranges::fill(q.scene.device.rotor_inertia_kg_m2, 2.8e-4);
  std::ranges::fill(q.scene.device.rotor_damping_nms_per_rad, 7e-3);
  q.scene.coupling.k_t_n_per_m = 800;
  q.scene.coupling.k_r_nm_per_rad = 0.5;
  q.scene.coupling.damping_ns_per_m = 1;
  q.radius_m = 0.05;
  q.report_clocked = true;
  std::vector<Fitting> all(8, fits);
  const auto is = [&all](std::size_t k, const char* name, const char* says) -> Fitting& {
    all[k].name = name;
    all[k].says = says;
    return all[k];
  };
  is(1, "reports too slow", "the loop is to tick at each report").device.report_period_ns =
      20'000'000;
  is(2, "stiffness", "N/m, more than the 10 that it states").device.max_stiffness_n_per_m = 10;
  is(3, "damping", "N s/m, more than the 0.5 that it states").device.max_damping_ns_per_m = 0.5_r;
  is(4, "no mass", "states no mass").device.mass_kg = 0;
  is(5, "budget of translation", "k_t_n_per_m is 5e+04").question.scene.coupling.k_t_n_per_m = 5e4;
  is(6, "budget of rotation", "k_r_nm_per_rad is 5000").question.scene.coupling.k_r_nm_per_rad =
      5000;
  Fitting& light = is(7, "50 Hz, 2 g, no damping", "more than the 10 that it states");
  light.question.report_clocked = false;
  light.device.report_period_ns = 20'000'000;
  light.device.mass_kg = 0.002_r;
  light.device.damping_ns_per_m = 0;
  light.device.max_stiffness_n_per_m = 10;
  return all;
}

/// A person's and the device's share of a connection.
struct Outcome {
  HalStatus status = HalStatus::kOk;
  std::string trouble;
  std::size_t commands = 0;
};

LinkSettings settings_of(tools::DeviceGate& gate) {
  LinkSettings settings;
  settings.accept = [&gate](const DeviceCapabilities& c) { return gate.admit(c); };
  return settings;
}

Outcome over_usb(const Fitting& fitting, tools::DeviceGate& gate) {
  Bench b(settings_of(gate));
  b.driver.state(fitting.device);
  Outcome found;
  found.status = b.connect();
  b.run(20);
  found.trouble = b.link->trouble();
  found.commands = b.device.forces_n.size();
  return found;
}

/// One that reports every turn and counts what it is handed.
class CountingPeer final : public LocalPeer {
 public:
  HalStatus plug(std::int64_t) noexcept override { return HalStatus::kOk; }
  HalStatus control(const ControlRequest&, std::span<std::uint8_t>,
                    std::size_t&) noexcept override {
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override { return 0; }
  std::size_t report(std::int64_t, std::span<std::uint8_t> bytes, std::int64_t&) noexcept override {
    const auto made = packed({++reports, 0, 1, 0});
    std::copy(made.begin(), made.end(), bytes.begin());
    return made.size();
  }
  void command(std::int64_t, std::span<const std::uint8_t>) noexcept override { ++commands; }
  std::uint32_t reports = 0;
  std::size_t commands = 0;
};

Outcome turned(LocalLink& link) {
  Outcome found;
  found.status = link.poll(kPeriod_ns / 4);
  for (int k = 0; k < 20; ++k) (void)link.poll(kPeriod_ns / 4);
  found.trouble = link.trouble();
  return found;
}

Outcome over_memory_of_one_process(const Fitting& fitting, tools::DeviceGate& gate) {
  CountingPeer peer;
  UsbTestDriver driver;
  driver.state(fitting.device);
  MailboxMemory mailbox;
  LocalLink link(driver, mailbox, peer, settings_of(gate));
  Outcome found = turned(link);
  found.commands = peer.commands;
  return found;
}

/// The same in what its host takes for another process.
struct CountingDevice final : PortDevice {
  void begin() override {}
  std::ptrdiff_t control(const ControlRequest&, std::span<const std::uint8_t>,
                         std::span<std::uint8_t>) override {
    return -1;
  }
  void command(std::span<const std::uint8_t>) override { ++commands; }
  void end() override {}
  std::size_t commands = 0;
};

Outcome over_a_socket(const Fitting& fitting, tools::DeviceGate& gate) {
  const std::string path = "/tmp/haptic_fit_" + std::to_string(getpid());
  DevicePort port(20 * kPeriod_ns);
  REQUIRE(port.listen(path) == 0);
  CountingDevice device;
  std::atomic<bool> stop{false};
  std::thread serves([&] {
    std::uint32_t reports = 0;
    while (!stop.load()) {
      port.serve(device);
      if (port.has_host()) port.publish(packed({++reports, 0, 1, 0}), monotonic_ns());
      usleep(200);
    }
  });
  Outcome found;
  {
    ProcessPeer peer(path);
    UsbTestDriver driver;
    driver.state(fitting.device);
    MailboxMemory mailbox;
    LocalLink link(driver, mailbox, peer, settings_of(gate));
    found = turned(link);
  }
  stop.store(true);
  serves.join();
  found.commands = device.commands;
  return found;
}

}  // namespace

TEST_SUITE("host_sim.fit_of_carriers") {
  TEST_CASE("what does not fit is refused over every carrier, with the same words and no command") {
    const struct {
      const char* name;
      Outcome (*run)(const Fitting&, tools::DeviceGate&);
    } carriers[] = {{"USB", over_usb},
                    {"a peer of this process", over_memory_of_one_process},
                    {"unix:PATH", over_a_socket}};
    for (const Fitting& fitting : fittings()) {
      for (const auto& carrier : carriers) {
        INFO(fitting.name << " over " << carrier.name);
        tools::DeviceGate gate(fitting.question, SafetyLimits{});
        const Outcome found = carrier.run(fitting, gate);
        if (fitting.says.empty()) {
          CHECK(found.status == HalStatus::kOk);
          CHECK(found.trouble == "");
          CHECK(found.commands > 0);
          continue;
        }
        CHECK(found.status == HalStatus::kNotAccepted);
        CHECK(found.trouble.find(fitting.says) != std::string::npos);
        CHECK(found.trouble == gate.refusal());
        CHECK(found.commands == 0);
      }
    }
  }
}
