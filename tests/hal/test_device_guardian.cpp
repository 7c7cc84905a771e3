// SPDX-License-Identifier: Apache-2.0
// What a servo process can do to its guardian, and what it cannot.
#include <doctest/doctest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <functional>
#include <string>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/device_guardian.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "tests/support/signal_process.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kGuardianPatience_ns = 20'000'000'000;

GuardianSettings settings_of(unsigned spares) {
  GuardianSettings settings;
  settings.spares = spares;
  settings.recorded_ticks = 64;
  settings.report_bytes = 4096;
  settings.hung_ms = 100;
  return settings;
}

/// Ticks until it is asked to stop.
int tick_on(const ServoSeat& seat) {
  ServoSide side(seat.mailboxes[0]);
  DeviceCommand command;
  while (!seat.stop.load()) {
    ++command.tick;
    side.publish(command);
    usleep(1000);
  }
  return 0;
}

GuardianNews news_of(DeviceGuardian& guardian) {
  const std::int64_t end_ns = monotonic_ns() + kGuardianPatience_ns;
  GuardianNews news = GuardianNews::kNone;
  while (news == GuardianNews::kNone && monotonic_ns() < end_ns) news = guardian.wait(100);
  return news;
}

}  // namespace

TEST_SUITE("hal.device_guardian") {
  TEST_CASE("what the guardian writes is read-only to its servo: a write is its own end") {
    DeviceGuardian guardian(settings_of(0));
    REQUIRE(guardian.start([](const ServoSeat& seat) {
      std::memset(static_cast<void*>(seat.mailboxes[0].states), 0x41, sizeof(StateHalf));
      return 0;
    }) == 0);
    CHECK(news_of(guardian) == GuardianNews::kServoEnded);
    CHECK(guardian.servo_end().end.signal == SIGSEGV);
    const auto* bytes = reinterpret_cast<const unsigned char*>(guardian.mailbox().states);
    CHECK(bytes[0] == 0);
  }

  TEST_CASE("a seat is not to be seen by the others, and its report is its own") {
    DeviceGuardian guardian(settings_of(1));
    REQUIRE(guardian.start([](const ServoSeat& seat) {
      std::memset(seat.report.data(), static_cast<int>(seat.number) + 1, seat.report.size());
      return seat.number == 0 ? raise(SIGKILL) : tick_on(seat);
    }) == 0);
    REQUIRE(news_of(guardian) == GuardianNews::kServoEnded);
    REQUIRE(guardian.take_over());
    const std::int64_t end_ns = monotonic_ns() + kGuardianPatience_ns;
    while (guardian.report(1)[0] == std::byte{0} && monotonic_ns() < end_ns) usleep(1000);
    for (const std::byte b : guardian.report(0)) REQUIRE(b == std::byte{1});
    for (const std::byte b : guardian.report(1)) REQUIRE(b == std::byte{2});
    CHECK(guardian.stop());
  }

  TEST_CASE(
      "a watcher reads the recorders in idle time; a write is its own end, and nobody's else") {
    struct Seen {
      std::atomic<int> policy{-1};
      std::atomic<std::uint64_t> tick{0};
    };
    SharedMemory memory(sizeof(Seen));
    Seen& seen = *new (memory.bytes().data()) Seen;
    GuardianSettings settings = settings_of(1);
    settings.watcher = [&seen](std::span<const std::span<const std::byte>> flights) {
      if (flights.size() != 2) return 1;
      StepTrace newest;
      while (newest.tick < 5)
        static_cast<void>(FlightRecorder::copy_newest(flights[0], std::span(&newest, 1)));
      seen.policy = sched_getscheduler(0);
      seen.tick = newest.tick;
      const_cast<std::byte&>(flights[0].front()) = std::byte{0x41};
      seen.tick = 0;
      return 0;
    };
    DeviceGuardian guardian(settings);
    REQUIRE(guardian.start([](const ServoSeat& seat) {
      FlightRecorder recorder(seat.flights[0]);
      ServoSide side(seat.mailboxes[0]);
      DeviceCommand command;
      StepTrace trace;
      while (!seat.stop.load()) {
        trace.tick = ++command.tick;
        recorder.write(trace);
        side.publish(command);
        usleep(1000);
      }
      return 0;
    }) == 0);
    const pid_t watcher = guardian.watcher_pid();
    REQUIRE(watcher > 0);
    const std::int64_t end_ns = monotonic_ns() + kGuardianPatience_ns;
    while (seen.tick == 0 && monotonic_ns() < end_ns)
      REQUIRE(guardian.wait(10) == GuardianNews::kNone);
    CHECK(seen.policy == SCHED_IDLE);
    CHECK(seen.tick >= 5);
    // Its end is no news, and the servo goes on.
    CHECK(guardian.wait(200) == GuardianNews::kNone);
    CHECK(seen.tick >= 5);
    CHECK(guardian.stop());
  }

  TEST_CASE("a watcher that never ends is killed with the guardian's end") {
    GuardianSettings settings = settings_of(0);
    settings.watcher = [](std::span<const std::span<const std::byte>>) {
      for (;;) pause();
      return 0;
    };
    DeviceGuardian guardian(settings);
    REQUIRE(guardian.start(tick_on) == 0);
    CHECK(guardian.wait(100) == GuardianNews::kNone);
    const pid_t watcher = guardian.watcher_pid();
    CHECK(guardian.stop());
    CHECK(kill(watcher, 0) != 0);
    CHECK(errno == ESRCH);
  }

  TEST_CASE("a process that no longer ticks is killed; one that does is left alone") {
    DeviceGuardian guardian(settings_of(1));
    REQUIRE(guardian.start(tick_on) == 0);
    CHECK(guardian.wait(500) == GuardianNews::kNone);
    test::signal_process(guardian.pid(), SIGSTOP);
    CHECK(news_of(guardian) == GuardianNews::kServoEnded);
    CHECK(guardian.servo_end().hung);
    CHECK(guardian.servo_end().end.signal == SIGKILL);
    CHECK(to_text(guardian.servo_end()) == "hung, and killed for it: no tick came any more");
    CHECK(guardian.take_over());
    CHECK(guardian.wait(300) == GuardianNews::kNone);
    CHECK(guardian.stop());
  }

  TEST_CASE("an endless loop of a real-time thread does not own its core") {
    GuardianSettings settings = settings_of(0);
    settings.first_tick_ms = 60'000;
    DeviceGuardian guardian(settings);
    REQUIRE(guardian.start([](const ServoSeat&) {
      if (set_fifo_priority(1) != 0) return 7;
      for (volatile unsigned k = 0;;) k = k + 1;
      return 0;
    }) == 0);
    REQUIRE(news_of(guardian) == GuardianNews::kServoEnded);
    if (guardian.servo_end().end.exit_code == 7) {
      MESSAGE("skipped: SCHED_FIFO is not granted, and no limit is there for an ordinary thread");
      return;
    }
    CHECK(guardian.servo_end().end.signal == SIGXCPU);
  }

  TEST_CASE("a spare that stands still is not waited for") {
    DeviceGuardian guardian(settings_of(2));
    REQUIRE(guardian.start(tick_on) == 0);
    CHECK(guardian.wait(200) == GuardianNews::kNone);
    const pid_t spare = test::child_named(getpid(), "haptic-spare");
    test::signal_process(spare, SIGSTOP);
    // A busy machine takes a while until it stands.
    CHECK(guardian.wait(300) == GuardianNews::kNone);
    const int first = guardian.pid();
    test::signal_process(first, SIGKILL);
    REQUIRE(news_of(guardian) == GuardianNews::kServoEnded);
    REQUIRE(guardian.take_over());
    CHECK(guardian.pid() != spare);
    CHECK(guardian.wait(300) == GuardianNews::kNone);
    static_cast<void>(guardian.stop());
  }

  TEST_CASE("signals: all that can be caught ask to stop, and say which") {
    for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM,
                             SIGPROF, SIGTSTP, SIGXCPU, SIGRTMIN}) {
      CAPTURE(number);
      DeviceGuardian guardian(settings_of(0));
      REQUIRE(guardian.start(tick_on) == 0);
      test::signal_process(getpid(), number);
      CHECK(news_of(guardian) == GuardianNews::kStopAsked);
      CHECK(guardian.stop_signal() == number);
      CHECK(guardian.stop());
    }
  }

  TEST_CASE("signals to a servo process are the guardian's business alone") {
    DeviceGuardian guardian(settings_of(0));
    REQUIRE(guardian.start(tick_on) == 0);
    CHECK(guardian.wait(200) == GuardianNews::kNone);
    for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGPIPE, SIGTSTP})
      test::signal_process(guardian.pid(), number);
    CHECK(guardian.wait(300) == GuardianNews::kNone);
    CHECK(guardian.stop());
  }

  TEST_CASE("a keeper that dies is reported once") {
    DeviceGuardian guardian(settings_of(0));
    REQUIRE(guardian.start(tick_on) == 0);
    test::signal_process(guardian.keeper_pid(), SIGKILL);
    CHECK(news_of(guardian) == GuardianNews::kKeeperEnded);
    CHECK(guardian.wait(200) == GuardianNews::kNone);
    CHECK(guardian.stop());
  }
}
