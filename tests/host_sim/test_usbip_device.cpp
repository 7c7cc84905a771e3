// SPDX-License-Identifier: Apache-2.0
// The reference device behind USB/IP, and the port of the kernel that it is plugged into.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/usbip_carrier.hpp"
#include "host_sim/device/vhci_port.hpp"
#include "tests/host_sim/usbip_client.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

HandAction circling(double t_s) {
  HandAction action;
  action.target.x0_w = Vector(0.02 * std::sin(4 * t_s), 0.02 * std::cos(4 * t_s) - 0.02, 0);
  return action;
}

std::unique_ptr<BusCarrier> make_usbip(UsbFunction& function, unsigned room) {
  return std::make_unique<UsbipCarrier>(function, room);
}

/// Answers a report with a spring to the origin; false where it is none.
bool answer_with_spring(const Bytes& bytes, hal::ReferenceCommand& command) {
  hal::ReferenceReport report;
  if (hal::decode(bytes, report) != hal::CodecVerdict::kOk) return false;
  command = {};
  command.drives_on = report.accepted_sequence > 0;  // asked off once first
  command.sequence = report.accepted_sequence + 1;
  command.tick = report.sequence;
  for (std::size_t k = 0; k < 3; ++k) command.force[k] = -report.position[k] / 50;
  return true;
}

Bytes bytes_of(const hal::ReferenceCommand& command) {
  Bytes bytes(hal::kReferenceCommandBytes);
  hal::encode(command, std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
  return bytes;
}

constexpr const char* kStatus =
    "hub port sta spd dev      sockfd local_busid\n"
    "hs  0000 006 003 00010002 000004 1-1\n"
    "hs  0001 006 003 00010003 000005 1-2\n"
    "hs  0002 004 000 00000000 000000 0-0\n"
    "ss  0015 004 000 00000000 000000 0-0\n";

std::string what_of(const std::string& folder) {
  try {
    attach_to_vhci(17, 3, folder);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_SUITE("host_sim.usbip_device") {
  TEST_CASE("lock-step: the bytes are those of the model alone") {
    ReferenceModelSettings settings;
    settings.hand = *hand_named("firm");
    ReferenceModel alone(settings, circling), model(settings, circling);
    ReferenceUsb device(model, DevicePace::kLockStep, make_usbip);
    UsbipClient client(device.plug());
    hal::ReferenceCommand command;
    for (int k = 0; k < 1000; ++k) {
      alone.advance();
      const std::uint32_t in = client.submit_in(kInNumber, 96);
      const std::optional<UsbipAnswer> received = client.receive();
      REQUIRE(received);
      REQUIRE(received->end().sequence == in);
      REQUIRE(received->bytes == alone.report());
      REQUIRE(answer_with_spring(received->bytes, command));
      REQUIRE(alone.command(bytes_of(command)));
      client.submit_out(kOutNumber, bytes_of(command));
      REQUIRE(client.receive()->end().status == 0);
    }
    CHECK(model.acting().force_w.norm() > 0.5);
  }

  TEST_CASE("replug: a new connection, again and again, also from within a transfer") {
    ReferenceModel model({}, circling);
    ReferenceUsb device(model, DevicePace::kLockStep, make_usbip);
    std::atomic<int> told = -1;
    device.on_replug([&](int descriptor) { told = descriptor; });
    int descriptor = device.plug();
    for (int round = 0; round < 40; ++round) {
      UsbipClient client(descriptor);
      client.submit_in(kInNumber, 96);
      const std::optional<UsbipAnswer> received = client.receive();
      REQUIRE(received);
      const std::uint64_t now = device.periods();
      DeviceFaultEvent event;
      event.kind = DeviceFaultKind::kUnplug;
      event.report = now + 1;
      device.add(event);
      event.kind = DeviceFaultKind::kReplug;
      event.report = now + 3;
      device.add(event);
      hal::ReferenceCommand command;
      REQUIRE(answer_with_spring(received->bytes, command));
      told = -1;
      client.submit_out(kOutNumber, bytes_of(command));
      CHECK_FALSE(client.receive());
      while (told == -1) std::this_thread::yield();
      CHECK(device.periods() == now + 3);
      descriptor = told;
    }
  }

  TEST_CASE("real time: reports flow and the device ends in order while a host waits") {
    ReferenceModel model({}, circling);
    ReferenceUsb device(model, DevicePace::kRealTime, make_usbip);
    UsbipClient client(device.plug());
    device.start();
    std::uint32_t last = 0;
    for (int k = 0; k < 20; ++k) {
      client.submit_in(kInNumber, 96);
      const std::optional<UsbipAnswer> received = client.receive();
      REQUIRE(received);
      hal::ReferenceReport report;
      REQUIRE(hal::decode(received->bytes, report) == hal::CodecVerdict::kOk);
      CHECK(report.sequence > last);
      last = report.sequence;
    }
    client.submit_in(kInNumber, 96);
  }
}

TEST_SUITE("host_sim.vhci_port") {
  TEST_CASE("status: the first free high-speed port") {
    CHECK(free_vhci_port(kStatus) == 2u);
    CHECK_FALSE(free_vhci_port(""));
    CHECK_FALSE(free_vhci_port("hub port sta spd dev\nss  0008 004 000 00000000 000000 0-0\n"));
    CHECK_FALSE(free_vhci_port("hs\nhs x y\nhs 0001\n"));
  }

  TEST_CASE("attach: one line of port, descriptor, device and speed; else what to do") {
    const test::ScratchFolder folder("vhci");
    const std::string place = folder.file("");
    CHECK(what_of(place + "none").find("sudo modprobe vhci-hcd") != std::string::npos);
    std::ofstream(place + "status") << kStatus;
    CHECK(what_of(place).find("attach") != std::string::npos);
    std::ofstream(place + "attach").close();
    CHECK(attach_to_vhci(17, 3, place) == 2);
    CHECK(test::text_of_file(place + "attach") == "2 17 65538 3\n");
    std::ofstream(place + "status") << "hub\n";
    CHECK(what_of(place).find("no free high-speed port") != std::string::npos);
  }

  TEST_CASE("threads: only those of the controller are touched") {
    // No such processes: none takes a priority, and nothing else is asked for one.
    const test::ScratchFolder folder("proc");
    for (const char* name : {"999999999", "999999998", "self"}) {
      std::filesystem::create_directories(folder.file(name));
      std::ofstream(folder.file(name) + "/comm") << "vhci_rx\n";
    }
    CHECK(raise_vhci_threads(50, folder.file("")) == 0);
    CHECK(raise_vhci_threads(50, folder.file("none")) == 0);
  }
}

}  // namespace haptic::sim
