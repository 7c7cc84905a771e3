// SPDX-License-Identifier: Apache-2.0
// The process that takes the force away when all others are gone: real processes, and a socket in
// place of the device, whose end here says what was sent.
#include <doctest/doctest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/polhem_driver.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/spacemouse_driver.hpp"
#include "hal/realtime/stop_signals.hpp"
#include "hal/realtime/zero_keeper.hpp"
#include "hal/socket_message.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr int kKeeperPatience_ms = 20'000;
constexpr std::size_t kHead = 1 + kZeroStampBytes;

struct Wire {
  Wire() { REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) == 0); }
  ~Wire() {
    for (const int end : ends) {
      if (end >= 0) close(end);
    }
  }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  /// What comes within the time; empty: nothing, or the end.
  std::vector<std::uint8_t> next(int within_ms) {
    pollfd watched{ends[1], POLLIN, 0};
    if (::poll(&watched, 1, within_ms) != 1) return {};
    std::vector<std::uint8_t> bytes(256);
    const ssize_t size = recv(ends[1], bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes;
  }
  std::array<int, 2> ends{-1, -1};
};

ZeroCommand zero_of(const Driver& driver, int descriptor) {
  ZeroCommand command;
  command.descriptor = descriptor;
  command.size = static_cast<std::uint32_t>(driver.zero_report(command.bytes));
  command.watchdog_ns = driver.capabilities().watchdog_ns;
  return command;
}

/// A guardian in a process of its own, which holds the device; then `does` something.
void guard(ServoProcess& guardian, Wire& wire, const ZeroCommand& command,
           const std::function<void(ZeroKeeper&)>& does) {
  REQUIRE(guardian.start([&] {
    close(wire.ends[1]);
    ZeroKeeper keeper;
    if (keeper.start() != 0) return 1;
    keeper.hold(command);
    close(wire.ends[0]);  // the keeper has its own
    does(keeper);
    for (;;) pause();
  }) == 0);
  close(wire.ends[0]);
  wire.ends[0] = -1;
}

void turn(ZeroKeeper& keeper) {
  for (std::uint32_t n = 0;; ++n) {
    keeper.turns()->store(n);
    usleep(2000);
  }
}

}  // namespace

TEST_SUITE("hal.zero_keeper") {
  TEST_CASE("every driver with motors has a zero report, by its own protocol") {
    std::array<std::uint8_t, ZeroCommand::kMostBytes> bytes{};
    CHECK(FalconDriver(FalconSettings{}).zero_report(bytes) == kFalconPacketBytes);
    PolhemDriver polhem;
    REQUIRE(polhem.zero_report(bytes) == kPolhemReportBytes);
    for (std::size_t k = 0; k < kPolhemReportBytes; ++k) CHECK(bytes[k] == 0);
    CHECK(SpaceMouseDriver().zero_report(bytes) == 0);
    // Not before the device has said where its sequence is.
    CHECK(ReferenceDriver().zero_report(bytes) == 0);

    ReferenceDriver reference;
    ReferenceReport report;
    report.sequence = 1;
    report.accepted_sequence = 41;
    std::array<std::uint8_t, kReferenceReportBytes> in{};
    encode(report, in);
    DeviceState state;
    REQUIRE(reference.read(in, 1, state) == ReportVerdict::kState);
    REQUIRE(reference.zero_report(bytes) == kReferenceCommandBytes);
    ReferenceCommand command;
    REQUIRE(decode(std::span(bytes).first(kReferenceCommandBytes), command) == CodecVerdict::kOk);
    CHECK_FALSE(command.drives_on);
    CHECK(is_newer(command.sequence, 41 + 1'000'000'000));
    for (std::size_t k = 0; k < 3; ++k) CHECK(command.force[k] == 0);
  }

  TEST_CASE("SIGKILL of the guardian: the zero command comes, then the end") {
    Wire wire;
    ServoProcess guardian;
    const ZeroCommand command = zero_of(FalconDriver(FalconSettings{}), wire.ends[0]);
    guard(guardian, wire, command, turn);
    CHECK(wire.next(300).empty());  // nothing while it lives
    const std::int64_t killed_ns = monotonic_ns();
    guardian.signal(SIGKILL);
    const std::vector<std::uint8_t> sent = wire.next(kKeeperPatience_ms);
    REQUIRE(sent.size() == command.size + kHead);
    CHECK(sent[0] == static_cast<std::uint8_t>(SocketMessage::kZero));
    std::int64_t stamp_ns = 0;
    for (std::size_t k = kZeroStampBytes; k > 0; --k) stamp_ns = stamp_ns << 8 | sent[k];
    CHECK(stamp_ns >= killed_ns);  // what was commanded before is void
    CHECK(stamp_ns <= monotonic_ns());
    for (std::size_t k = 0; k < command.size; ++k) CHECK(sent[k + kHead] == command.bytes[k]);
    MESSAGE("zero ", 1e-6 * static_cast<double>(monotonic_ns() - killed_ns), " ms after SIGKILL");
    while (!wire.next(kKeeperPatience_ms).empty()) {
    }
  }

  TEST_CASE("a guardian that dies of a fault sends it on its way, also without a keeper") {
    Wire wire;
    ServoProcess guardian;
    REQUIRE(guardian.start([&] {
      const ZeroCommand command = zero_of(FalconDriver(FalconSettings{}), wire.ends[0]);
      send_zero_on_fatal(0, &command);
      return raise(SIGSEGV);
    }) == 0);
    CHECK(guardian.finish(kKeeperPatience_ms).signal == SIGSEGV);
    CHECK(wire.next(kKeeperPatience_ms).size() == kFalconPacketBytes + kHead);
  }

  TEST_CASE(
      "a frozen guardian: zero for a device without a watchdog, none for one that has its own") {
    for (const bool watched : {false, true}) {
      CAPTURE(watched);
      Wire wire;
      ServoProcess guardian;
      ZeroCommand command = zero_of(FalconDriver(FalconSettings{}), wire.ends[0]);
      if (watched) command.watchdog_ns = 20'000'000;
      guard(guardian, wire, command, turn);
      CHECK(wire.next(150).empty());
      guardian.signal(SIGSTOP);
      CHECK(wire.next(watched ? 500 : kKeeperPatience_ms).empty() == watched);
      guardian.signal(SIGKILL);
    }
  }

  TEST_CASE("an orderly end: nothing is sent, and the device is let go") {
    Wire wire;
    ServoProcess guardian;
    guard(guardian, wire, zero_of(FalconDriver(FalconSettings{}), wire.ends[0]),
          [](ZeroKeeper& keeper) {
            keeper.release();
            keeper.stop();
            _exit(0);
          });
    CHECK(wire.next(kKeeperPatience_ms).empty());  // the end
    CHECK(guardian.finish(kKeeperPatience_ms).exit_code == 0);
  }

  TEST_CASE("a keeper that is killed or frozen is noticed") {
    for (const int number : {SIGKILL, SIGSTOP}) {
      CAPTURE(number);
      ZeroKeeper keeper;
      REQUIRE(keeper.start() == 0);
      REQUIRE(kill(keeper.pid(), number) == 0);
      const std::int64_t end_ns = monotonic_ns() + std::int64_t{kKeeperPatience_ms} * 1'000'000;
      while (!keeper.look().ended && monotonic_ns() < end_ns) usleep(10'000);
      CHECK(keeper.look().signal == SIGKILL);
    }
  }
}
