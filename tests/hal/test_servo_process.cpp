// SPDX-License-Identifier: Apache-2.0
// Processes that share memory: mailbox, futex, ends of a child. Waits bound a test that hangs; no
// case depends on how long anything takes.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>
#include <stdexcept>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_mailbox.hpp"
#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "rt_core/exchange/step_trace.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr int kPatience_ms = 20'000;
constexpr std::int64_t kPatience_ns = 20'000'000'000;

template <class T>
T& placed(SharedMemory& memory) {
  REQUIRE(memory.bytes().size() >= sizeof(T));
  return *new (memory.bytes().data()) T;
}

/// Sleeps for ever; the pause is left by signals only.
int sleep_on() {
  for (;;) pause();
}

/// Looks until `holds` or the patience ends.
template <class Condition>
bool comes(Condition holds) {
  const std::int64_t end_ns = monotonic_ns() + kPatience_ns;
  while (!holds() && monotonic_ns() < end_ns) usleep(200);
  return holds();
}

struct Pipe {
  Pipe() { REQUIRE(pipe2(ends.data(), O_CLOEXEC) == 0); }
  ~Pipe() {
    close_read();
    close_write();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_read() { shut(ends[0]); }
  void close_write() { shut(ends[1]); }
  static void shut(int& end) {
    if (end >= 0) close(end);
    end = -1;
  }
  std::array<int, 2> ends{-1, -1};
};

}  // namespace

TEST_SUITE("hal.servo_process") {
  TEST_CASE("shared memory: aligned, zeroed, written by a child and read here") {
    SharedMemory memory(3 * 4096 + 1);
    REQUIRE(memory.bytes().size() == 3 * 4096 + 1);
    CHECK(std::bit_cast<std::uintptr_t>(memory.bytes().data()) % 4096 == 0);
    for (const std::byte b : memory.bytes()) REQUIRE(b == std::byte{0});
    ServoProcess child;
    REQUIRE(child.start([&memory] {
      const bool locked = memory.enter();
      if (locked != memory.locked()) return 1;
      std::memset(memory.bytes().data(), 7, memory.bytes().size());
      return 0;
    }) == 0);
    CHECK(child.finish(kPatience_ms).exit_code == 0);
    for (const std::byte b : memory.bytes()) REQUIRE(b == std::byte{7});
    CHECK(SharedMemory(0).bytes().empty());
  }

  TEST_CASE("mailbox: a state wakes the loop in another process, with its number and its values") {
    constexpr std::uint32_t kStates = 200;
    SharedMemory memory(sizeof(MailboxMemory));
    MailboxMemory& mailbox = placed<MailboxMemory>(memory);
    DeviceSide device(mailbox);
    ServoProcess child;
    // Answers each state; a wake that is lost leaves it asleep until its deadline, which is beyond
    // the patience of this test.
    REQUIRE(child.start([&mailbox] {
      ServoSide servo(mailbox);
      std::uint32_t seen = 0;
      const std::int64_t end_ns = monotonic_ns() + 10 * kPatience_ns;
      for (std::uint64_t tick = 1; seen < kStates; ++tick) {
        std::uint32_t count = seen;
        while (count == seen) count = servo.wait_for_state(seen, end_ns);
        seen = count;
        const DeviceState state = servo.state();
        if (state.sequence < seen || state.stamp_ns != 10 * std::int64_t(state.sequence)) return 1;
        DeviceCommand command;
        command.tick = tick;
        command.sequence = state.sequence;
        servo.publish(command);
      }
      return 0;
    }) == 0);
    for (std::uint32_t k = 1; k <= kStates; ++k) {
      DeviceState state;
      state.sequence = k;
      state.stamp_ns = 10 * std::int64_t{k};
      device.publish(state, true);
      REQUIRE(comes([&] { return device.command().sequence == k; }));
    }
    CHECK(child.finish(kPatience_ms).exit_code == 0);
    CHECK(mailbox.states->published.load() == kStates);
  }

  TEST_CASE("mailbox: without a wake the sleeper comes back at its deadline, not before") {
    MailboxMemory mailbox;
    const ServoSide servo(mailbox);
    const std::int64_t deadline_ns = monotonic_ns() + 3'000'000;
    std::uint32_t count = 0;
    while (monotonic_ns() < deadline_ns) count = servo.wait_for_state(0, deadline_ns);
    CHECK(count == 0);
    DeviceSide(mailbox).publish(DeviceState{}, false);
    CHECK(servo.wait_for_state(0, deadline_ns + kPatience_ns) == 1);  // at once: it differs
  }

  TEST_CASE("end of a child: codes, signals, texts") {
    CHECK(to_text(ProcessEnd{}) == "running");
    CHECK(to_text(ProcessEnd{true, 3, 0}) == "exit code 3");
    CHECK(to_text(ProcessEnd{true, 0, SIGSEGV}) == "killed by signal 11 (Segmentation fault)");
    CHECK(to_text(ProcessEnd{true, 0, SIGKILL}) == "killed by signal 9 (Killed)");

    ServoProcess returns;
    CHECK_FALSE(returns.poll(0).ended);  // not started
    REQUIRE(returns.start([] { return 42; }) == 0);
    CHECK(returns.start([] { return 0; }) == EBUSY);
    CHECK(to_text(returns.finish(kPatience_ms)) == "exit code 42");
    CHECK(to_text(returns.poll(0)) == "exit code 42");  // and stays so

    ServoProcess faults;
    REQUIRE(faults.start([] {
      raise(SIGSEGV);
      return 0;
    }) == 0);
    CHECK(faults.finish(kPatience_ms).signal == SIGSEGV);

    ServoProcess throws;
    REQUIRE(throws.start([]() -> int { throw std::runtime_error("not for the parent"); }) == 0);
    CHECK(throws.finish(kPatience_ms).signal == SIGABRT);
  }

  TEST_CASE("end of a child: its descriptor tells; a running one has not ended") {
    ServoProcess child;
    REQUIRE(child.start(sleep_on) == 0);
    CHECK_FALSE(child.poll(0).ended);
    CHECK_FALSE(child.poll(2).ended);
    if (child.descriptor() < 0) MESSAGE("this kernel has no pidfd");
    child.signal(SIGKILL);
    if (child.descriptor() >= 0) {
      pollfd watched{child.descriptor(), POLLIN, 0};
      CHECK(::poll(&watched, 1, kPatience_ms) == 1);
    }
    CHECK(comes([&] { return child.poll(1).ended; }));
    CHECK(child.poll(0).signal == SIGKILL);
    child.signal(SIGKILL);  // nobody: its number may be another's by now
  }

  TEST_CASE("finish: a frozen child is killed, a deaf one too") {
    ServoProcess frozen, deaf;
    REQUIRE(frozen.start(sleep_on) == 0);
    frozen.signal(SIGSTOP);
    CHECK(frozen.finish(1).signal == SIGKILL);
    SharedMemory memory(sizeof(std::atomic<bool>));
    auto& is_deaf = placed<std::atomic<bool>>(memory);
    REQUIRE(deaf.start([&is_deaf] {
      signal(SIGTERM, SIG_IGN);
      is_deaf.store(true);
      return sleep_on();
    }) == 0);
    REQUIRE(comes([&is_deaf] { return is_deaf.load(); }));
    deaf.signal(SIGTERM);
    CHECK_FALSE(deaf.poll(2).ended);
    CHECK(deaf.finish(1).signal == SIGKILL);
  }

  TEST_CASE("start: handlers of the parent are not the child's, what it ignores stays ignored") {
    const auto before = signal(SIGUSR1, [](int) {});
    const auto ignored_before = signal(SIGUSR2, SIG_IGN);
    ServoProcess child;
    REQUIRE(child.start([] {
      raise(SIGUSR2);
      raise(SIGUSR1);
      return 0;
    }) == 0);
    signal(SIGUSR1, before);
    signal(SIGUSR2, ignored_before);
    CHECK(child.finish(kPatience_ms).signal == SIGUSR1);
  }

  TEST_CASE("a parent that is killed takes its servo process with it") {
    Pipe alive;
    ServoProcess holder;
    REQUIRE(holder.start([&alive] {
      ServoProcess servo;
      if (servo.start(sleep_on) != 0) return 1;
      const char told = 1;
      if (write(alive.ends[1], &told, 1) != 1) return 1;
      return sleep_on();
    }) == 0);
    alive.close_write();
    char told = 0;
    REQUIRE(read(alive.ends[0], &told, 1) == 1);
    holder.signal(SIGKILL);
    CHECK(holder.finish(kPatience_ms).signal == SIGKILL);
    // The grandchild has the writing end as well: the end of file is the end of both.
    pollfd watched{alive.ends[0], POLLIN, 0};
    REQUIRE(::poll(&watched, 1, kPatience_ms) == 1);
    CHECK(read(alive.ends[0], &told, 1) == 0);
  }

  TEST_CASE("flight recorder: what a killed child wrote is read here, in order and whole") {
    constexpr std::size_t kRecords = 64;
    SharedMemory memory(FlightRecorder::bytes_for(kRecords));
    ServoProcess child;
    std::array<StepTrace, kRecords> records;
    const auto newest = [&] { return FlightRecorder::copy_newest(memory.bytes(), records); };
    CHECK(newest() == 0);
    REQUIRE(child.start([&memory] {
      FlightRecorder recorder(memory.bytes());
      StepTrace trace;
      for (trace.tick = 1;; ++trace.tick) {
        trace.state_hash = trace.tick * 0x9e3779b97f4a7c15u;
        recorder.write(trace);
      }
      return 0;
    }) == 0);
    REQUIRE(comes([&] { return newest() > 0 && records[0].tick > 2 * kRecords; }));
    child.signal(SIGKILL);
    CHECK(child.finish(kPatience_ms).signal == SIGKILL);
    const std::size_t count = newest();
    // The one that was being written when the signal came is left out.
    CHECK(count >= kRecords - 1);
    for (std::size_t k = 0; k < count; ++k) {
      CHECK(records[k].tick == records[0].tick + k);
      CHECK(records[k].state_hash == records[k].tick * 0x9e3779b97f4a7c15u);
    }
  }
}
