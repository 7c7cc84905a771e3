// SPDX-License-Identifier: Apache-2.0
// run_device with two reference devices, each in real time behind a socket with a hand on it; the
// hands press their parts on each other. One device is lost, either is stopped, processes are
// killed: judged by what each device was handed.
#include <doctest/doctest.h>
#include <sys/types.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/lab/processes/device_program.hpp"
#include "host_sim/lab/processes/served_device.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/signal_process.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/files.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::test::child_named;
using haptic::test::has;
using haptic::test::signal_process;

namespace {

constexpr std::uint32_t kDeadmanHeld = 1;  // deadman
constexpr double kBlocksApart_m = 0.005, kBlockPressed_m = -0.0185;
constexpr double kFelt_n = 1.5;
constexpr double kMostStep_n = 4.0;  // of the slew limit in two periods
constexpr double kHandedUnit_n = 0.01;
constexpr int kBusyTries = 6;
constexpr std::int64_t kMs = 1'000'000;

void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

bool comes_true_within(const std::function<bool()>& holds, int within_ms = 20'000) {
  const std::int64_t end_ns = hal::monotonic_ns() + within_ms * kMs;
  while (!holds()) {
    if (hal::monotonic_ns() > end_ns) return false;
    sleep_ms(1);
  }
  return true;
}

/// A block in each hand, one above the other, 10 mm apart.
constexpr const char* kBlocks =
    "format = 1\nname = \"blocks\"\n"
    "[[part]]\nname = \"upper\"\nrole = \"hand\"\nshape = \"box\"\n"
    "size_m = [0.04, 0.04, 0.02]\nposition_m = [0, 0, 0.02]\n"
    "[[part]]\nname = \"lower\"\nrole = \"hand2\"\nshape = \"box\"\n"
    "size_m = [0.06, 0.06, 0.02]\nposition_m = [0, 0, -0.01]\n"
    "[rendering]\nk_f_n_per_m = 800\n[coupling]\nk_t_n_per_m = 800\n";

ReferenceModelSettings firm_device() {
  ReferenceModelSettings settings;
  settings.hand = *hand_named("firm");
  return settings;
}

/// Two devices, and the program that holds them.
class TwoDevices {
 public:
  TwoDevices() {
    std::ofstream(file("blocks.toml")) << kBlocks;
    const std::vector<std::byte> scene =
        tools::compile_scene(tools::read_scene_file(file("blocks.toml")), {}).bytes;
    const std::string config =
        "scene = \"blocks.rtscene\"\n[device]\ndriver = \"reference\"\n"
        "address = \"unix:1.sock\"\n[device2]\ndriver = \"reference\"\n"
        "address = \"unix:2.sock\"\n";
    tools::write_files(
        {{file("blocks.rtscene"), scene}, {file("run.toml"), std::as_bytes(std::span(config))}});
    for (std::size_t k = 0; k < 2; ++k) plug(k);
    program_ = std::make_unique<DeviceProgram>(
        std::vector<std::string>{HAPTIC_RUN_DEVICE, "run", file("run.toml"), "--json",
                                 "--status-every", "0.02", "--allow-degraded",
                                 "--accept-unbudgeted"},
        file("run"), ProgramReader::kFile);
  }

  void plug(std::size_t k) {
    const std::string path = file(std::to_string(k + 1) + ".sock");
    devices_[k] = std::make_unique<ServedDevice>(path, firm_device());
  }
  void unplug(std::size_t k) {
    unplugged_[k] = devices_[k]->record();
    devices_[k].reset();
  }
  [[nodiscard]] ServedDevice& device(std::size_t k) { return *devices_[k]; }
  [[nodiscard]] DeviceProgram& program() { return *program_; }
  [[nodiscard]] WireRecord wire(std::size_t k) const {
    return devices_[k] ? devices_[k]->record() : unplugged_[k];
  }

  /// Releases the switches, holds them, and brings the upper part down on the lower one; both
  /// again, from where the parts start, where a tick that came too late has released one.
  bool press(std::initializer_list<std::size_t> which, double to_m = kBlockPressed_m) {
    if (press_once(which, to_m)) return true;
    for (int tried = 1; tried < kBusyTries && was_late(); ++tried)
      if (press_once({0, 1}, kBlockPressed_m)) return true;
    return false;
  }
  [[nodiscard]] bool is_held() {
    return comes_true_within([&] { return device(0).hosts() == 1 && device(1).hosts() == 1; });
  }
  [[nodiscard]] std::array<double, 2> forces_n() const {
    return {devices_[0] ? devices_[0]->handed_n() : 0.0,
            devices_[1] ? devices_[1]->handed_n() : 0.0};
  }
  [[nodiscard]] int exit_code(int within_ms = 20'000) {
    (void)comes_true_within([&] { return program_->exit_code().has_value(); }, within_ms);
    return program_->exit_code().value_or(-1);
  }
  [[nodiscard]] bool was_late() const {
    const std::string said = program_->said();
    return has(said, "came too late") || has(said, "was not renewed") || has(said, "was too old");
  }

 private:
  bool press_once(std::initializer_list<std::size_t> which, double to_m) {
    for (const std::size_t k : which) device(k).hold(kBlocksApart_m, 0);
    sleep_ms(150);
    for (const std::size_t k : which) device(k).hold(kBlocksApart_m, kDeadmanHeld);
    sleep_ms(250);
    for (const std::size_t k : which)
      if (k == 0) device(k).hold(to_m, kDeadmanHeld);
    return comes_true_within([&] { return forces_n()[0] > kFelt_n && forces_n()[1] > kFelt_n; },
                             3000);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_.file(name); }

  sim::test::ScratchFolder folder_{"two_devices"};
  std::array<std::unique_ptr<ServedDevice>, 2> devices_;
  std::array<WireRecord, 2> unplugged_;
  std::unique_ptr<DeviceProgram> program_;
};

/// The forces that a device was handed from a time on.
std::vector<double> handed_since(const WireRecord& wire, std::int64_t begin_ns) {
  std::vector<double> forces;
  for (const WireCommand& command : wire.commands)
    if (command.stamp_ns >= begin_ns)
      forces.push_back(command.drives_on ? command.wrench.force_w.norm() : 0.0);
  return forces;
}

/// It goes to zero by the slew limit, and stays there.
void check_ramp(const WireRecord& wire, std::int64_t fault_ns) {
  const std::vector<double> forces = handed_since(wire, fault_ns);
  REQUIRE(forces.size() > 3);
  double step_n = 0;
  for (std::size_t k = 1; k < forces.size(); ++k)
    step_n = std::max(step_n, std::abs(forces[k] - forces[k - 1]));
  CHECK(step_n <= kMostStep_n + kHandedUnit_n);
  CHECK(forces.back() == 0.0);
  const auto zero = std::find(forces.begin(), forces.end(), 0.0);
  CHECK(std::all_of(zero, forces.end(), [](double force_n) { return force_n == 0.0; }));
}

/// Both press, then `play` has them; again where the machine was too busy for the loop, which
/// `play` says by false.
void with_force(const std::function<bool(TwoDevices&)>& play) {
  for (int tried = 1; tried <= kBusyTries; ++tried) {
    TwoDevices both;
    if (!both.is_held()) FAIL("run_device does not take both: " << both.program().said());
    sleep_ms(50);
    const bool pressed = both.press({0, 1});
    if (pressed) sleep_ms(300);  // until the hands rest
    if ((!pressed || both.was_late()) && tried < kBusyTries) continue;
    const std::string said = both.program().said();
    INFO(
        "run_device says: " << said.substr(said.size() - std::min<std::size_t>(said.size(), 3000)));
    REQUIRE(pressed);
    if (play(both)) return;
  }
  FAIL("the machine was too busy for the loop in each try");
}

}  // namespace

TEST_SUITE("host_sim.two_devices") {
  TEST_CASE("each is handed what the other one is; one that is lost leaves the other its force") {
    with_force([](TwoDevices& both) -> bool {
      const std::array<double, 2> before_n = both.forces_n();
      CHECK(std::abs(before_n[0] - before_n[1]) < 0.1);
      const std::int64_t fault_ns = hal::monotonic_ns();
      both.unplug(0);
      sleep_ms(600);
      CHECK(has(both.program().said(), "device 1: the device is away"));
      CHECK_FALSE(has(both.program().said(), "device 2: the device is away"));
      if (both.was_late()) return false;
      // A tick that is late for a period or two lets the force decay for as long.
      const std::vector<double> forces = handed_since(both.wire(1), fault_ns);
      REQUIRE(forces.size() > 100);
      const auto is_off = [&](double force_n) {
        return force_n < 0.7 * before_n[1] || force_n > 1.3 * before_n[1];
      };
      if (std::ranges::count_if(forces, is_off) > std::ssize(forces) / 20) return false;
      CHECK(std::ranges::find(forces, 0.0) == forces.end());
      CHECK_FALSE(has(both.program().said(), "device 2: disarm"));
      // Plugged in again it is armed again, from where its part is.
      both.plug(0);
      CHECK(comes_true_within([&] { return both.device(0).hosts() == 1; }));
      CHECK(both.press({0}));
      REQUIRE(both.program().signal(ProgramPart::kGuardian, SIGTERM));
      CHECK(both.exit_code() == 0);
      return true;
    });
  }

  TEST_CASE("the emergency stop of either releases both, until both are pressed again") {
    for (const std::size_t stopped : {0u, 1u}) {
      CAPTURE(stopped);
      with_force([stopped](TwoDevices& both) -> bool {
        const std::int64_t fault_ns = hal::monotonic_ns();
        both.device(stopped).press_emergency_stop(true);
        sleep_ms(600);
        for (const std::size_t k : {0u, 1u}) {
          CAPTURE(k);
          check_ramp(both.wire(k), fault_ns);
        }
        CHECK(has(both.program().said(), "device 1: faulted"));
        CHECK(has(both.program().said(), "device 2: faulted"));
        both.device(stopped).press_emergency_stop(false);
        CHECK(both.press({0, 1}));
        return true;
      });
    }
  }

  TEST_CASE("both lost: the run waits for them, and ends in order when asked") {
    with_force([](TwoDevices& both) -> bool {
      both.unplug(0);
      both.unplug(1);
      sleep_ms(400);
      CHECK(has(both.program().said(), "device 1: the device is away"));
      CHECK(has(both.program().said(), "device 2: the device is away"));
      CHECK_FALSE(both.program().exit_code().has_value());
      REQUIRE(both.program().signal(ProgramPart::kGuardian, SIGTERM));
      CHECK(both.exit_code() == 0);
      return true;
    });
  }

  TEST_CASE("a killed servo process: both ramp to zero, and the spare serves both") {
    with_force([](TwoDevices& both) -> bool {
      const std::int64_t fault_ns = hal::monotonic_ns();
      REQUIRE(both.program().signal(ProgramPart::kServo, SIGKILL));
      sleep_ms(600);
      for (const std::size_t k : {0u, 1u}) {
        CAPTURE(k);
        check_ramp(both.wire(k), fault_ns);
      }
      // The parts begin where they start once more, while the handle is down.
      const bool pressed = both.press({0, 1}, kBlockPressed_m + kBlockPressed_m - kBlocksApart_m);
      if (!pressed && both.was_late()) return false;
      CHECK(pressed);
      REQUIRE(both.program().signal(ProgramPart::kGuardian, SIGTERM));
      CHECK(both.exit_code() == 1);
      return true;
    });
  }

  TEST_CASE("a killed guardian: the zero-keeper of each takes its force away") {
    with_force([](TwoDevices& both) -> bool {
      REQUIRE(both.program().signal(ProgramPart::kGuardian, SIGKILL));
      sleep_ms(200);
      for (const std::size_t k : {0u, 1u}) {
        CAPTURE(k);
        const WireRecord wire = both.wire(k);
        REQUIRE_FALSE(wire.commands.empty());
        CHECK_FALSE(wire.commands.back().drives_on);
      }
      return true;
    });
  }

  TEST_CASE("a killed zero-keeper is said with its device, and the run goes on") {
    with_force([](TwoDevices& both) -> bool {
      const pid_t guardian = both.program().pid(ProgramPart::kGuardian);
      signal_process(child_named(guardian, "haptic-zero-2"), SIGKILL);
      CHECK(comes_true_within([&] {
        return has(both.program().said(), "device 2: the zero-keeper: killed by signal 9");
      }));
      sleep_ms(100);
      if (both.was_late()) return false;
      CHECK(both.forces_n()[0] > kFelt_n);
      CHECK(both.forces_n()[1] > kFelt_n);
      return true;
    });
  }
}
