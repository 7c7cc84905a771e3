// SPDX-License-Identifier: Apache-2.0
// The functions of hal/firmware/reference_device.h, made by a board in an emulator: a program that
// links this in front of the library runs its tests of the firmware, as they are, on the board's
// processor. HAPTIC_BOARD_MACHINE is the emulator's machine, HAPTIC_BOARD_UNIT_PS a unit of its
// clock, and HAPTIC_BOARD_IMAGE its program (check_firmware makes it); with HAPTIC_BOARD_SPOIL its
// answers are damaged, and the tests must fail.
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/program_run.hpp"
#include "tests/targets/firmware/board_calls.h"

namespace {

constexpr int kPatience_ms = 20'000;
// Instructions are counted: one is 2^6 ns of the machine's time.
constexpr std::uint64_t kInstruction_ps = 64'000;

/// The emulator, its program, and the two pipes between them and us. Owner: any thread, one at a
/// time. @throws std::runtime_error  it cannot be had, or it has gone
class Board {
 public:
  Board() {
    // An end that nobody reads is an error of write(2), not a signal.
    (void)std::signal(SIGPIPE, SIG_IGN);
    start();
  }
  ~Board() {
    haptic_board_call last{};
    last.function = HAPTIC_BOARD_END;
    const bool asked = write(calls_, &last, sizeof last) == ssize_t{sizeof last};
    int status = 0;
    const bool ended = asked && has_ended(status);
    if (!ended) {
      kill(process_, SIGKILL);
      (void)waitpid(process_, &status, 0);
    }
    close(calls_);
    close(answers_);
    std::printf("board %s: %llu calls; most of a call: stack %u bytes", machine_.c_str(),
                static_cast<unsigned long long>(made_), most_stack_);
    for (const auto& [function, name] : kNames)
      std::printf(
          ", %s %llu instructions", name,
          static_cast<unsigned long long>(most_clock_[function] * unit_ps_ / kInstruction_ps));
    std::printf("%s\n", ended && WIFEXITED(status) && WEXITSTATUS(status) == 0
                            ? ""
                            : "; it did not end when asked to");
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  haptic_board_answer make(const haptic_board_call& asked) {
    const std::lock_guard lock(mutex_);
    haptic_board_call call = asked;
    call.record_bytes = sizeof call;
    call.device_bytes = sizeof call.device;
    if (write(calls_, &call, sizeof call) != ssize_t{sizeof call}) fail("takes no call");
    haptic_board_answer answer{};
    auto rest = std::as_writable_bytes(std::span(&answer, 1));
    while (!rest.empty()) {
      pollfd watched{answers_, POLLIN, 0};
      if (poll(&watched, 1, kPatience_ms) <= 0) fail("does not answer");
      const ssize_t count = read(answers_, rest.data(), rest.size());
      if (count <= 0) fail("has ended");
      rest = rest.subspan(static_cast<std::size_t>(count));
    }
    if (answer.record_bytes != sizeof answer)
      fail("lays out the structures of reference_device.h otherwise than this processor");
    if (answer.drive_at >= sizeof answer.device) fail("has its drive outside of the device");
    ++made_;
    most_stack_ = std::max(most_stack_, answer.stack_bytes);
    std::uint32_t& clock = most_clock_[call.function];
    clock = std::max(clock, answer.clock_units);
    drive_at_ = answer.drive_at;
    return answer;
  }
  [[nodiscard]] std::size_t drive_at() {
    const std::lock_guard lock(mutex_);
    return drive_at_;
  }

 private:
  struct Name {
    std::uint32_t function;
    const char* name;
  };
  static constexpr Name kNames[] = {{HAPTIC_BOARD_PERIOD, "period"},
                                    {HAPTIC_BOARD_COMMAND, "command"},
                                    {HAPTIC_BOARD_ANSWER, "answer"}};

  static std::string setting(const char* name) {
    const char* const value = std::getenv(name);
    if (value == nullptr || *value == '\0')
      throw std::runtime_error(std::string(name) +
                               " is not set; run tests/targets/firmware/check_firmware");
    return value;
  }
  [[noreturn]] void fail(const char* what) {
    throw std::runtime_error("the board in the emulator " + std::string(what) + ": " + machine_ +
                             ", " + image_);
  }

  void start() {
    machine_ = setting("HAPTIC_BOARD_MACHINE");
    image_ = setting("HAPTIC_BOARD_IMAGE");
    unit_ps_ = std::strtoull(setting("HAPTIC_BOARD_UNIT_PS").c_str(), nullptr, 10);
    const std::string calls = folder_.file("calls"), answers = folder_.file("answers");
    for (const std::string& pipe : {calls, answers})
      if (mkfifo(pipe.c_str(), 0600) != 0) fail("has no pipe");
    // Open for reading too, so that neither this open nor the emulator's waits for the other.
    calls_ = open(calls.c_str(), O_RDWR | O_CLOEXEC);
    answers_ = open(answers.c_str(), O_RDWR | O_CLOEXEC);
    if (calls_ < 0 || answers_ < 0) fail("has no pipe");
    std::string files = "enable=on,target=native,arg=board,arg=" + calls + ",arg=" + answers;
    if (std::getenv("HAPTIC_BOARD_SPOIL") != nullptr) files += ",arg=spoil";
    std::vector<std::string> words = {"qemu-system-arm",
                                      "-M",
                                      machine_,
                                      "-display",
                                      "none",
                                      "-serial",
                                      "null",
                                      "-monitor",
                                      "none",
                                      "-icount",
                                      "shift=6,sleep=off",
                                      "-semihosting-config",
                                      files,
                                      "-kernel",
                                      image_};
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    if (posix_spawnp(&process_, pointers[0], nullptr, nullptr, pointers.data(), environ) != 0)
      fail("cannot be started: is qemu-system-arm there?");
  }

  [[nodiscard]] bool has_ended(int& status) const {
    for (int k = 0; k < kPatience_ms / 10; ++k) {
      if (waitpid(process_, &status, WNOHANG) == process_) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  haptic::sim::test::ScratchFolder folder_{"board"};
  std::mutex mutex_;
  std::string machine_, image_;
  pid_t process_ = -1;
  int calls_ = -1, answers_ = -1;
  std::uint64_t made_ = 0, unit_ps_ = 0;
  std::uint32_t most_stack_ = 0;
  std::array<std::uint32_t, HAPTIC_BOARD_END + 1> most_clock_{};
  std::size_t drive_at_ = 0;
};

Board& board() {
  static Board the_board;
  return the_board;
}

haptic_board_call call_of(std::uint32_t function, const haptic_device& device) {
  haptic_board_call call{};
  call.function = function;
  call.device = device;
  return call;
}

}  // namespace

void haptic_device_begin(haptic_device* device, const haptic_facts* facts) {
  haptic_board_call call = call_of(HAPTIC_BOARD_BEGIN, *device);
  call.facts = *facts;
  *device = board().make(call).device;
}

std::int32_t haptic_device_answer(haptic_device* device, std::uint8_t request_type,
                                  std::uint8_t request, std::uint16_t value, std::uint8_t* room,
                                  std::size_t size) {
  haptic_board_call call = call_of(HAPTIC_BOARD_ANSWER, *device);
  call.request_type = request_type;
  call.request = request;
  call.value = value;
  call.size = static_cast<std::uint32_t>(std::min<std::size_t>(size, HAPTIC_BOARD_BYTES));
  const haptic_board_answer answer = board().make(call);
  *device = answer.device;  // it knows now which version the host speaks
  if (answer.result > 0 && static_cast<std::size_t>(answer.result) <= size)
    std::copy_n(answer.bytes, answer.result, room);
  return answer.result;
}

std::size_t haptic_device_period(haptic_device* device, const haptic_sample* sample,
                                 std::uint8_t* report, std::size_t size) {
  haptic_board_call call = call_of(HAPTIC_BOARD_PERIOD, *device);
  call.sample = *sample;
  call.size = static_cast<std::uint32_t>(std::min<std::size_t>(size, HAPTIC_BOARD_BYTES));
  const haptic_board_answer answer = board().make(call);
  *device = answer.device;
  const auto written = static_cast<std::size_t>(std::max(answer.result, 0));
  if (written <= size) std::copy_n(answer.bytes, written, report);
  return written;
}

std::int32_t haptic_device_command(haptic_device* device, const std::uint8_t* bytes,
                                   std::size_t size, std::uint64_t now_us) {
  haptic_board_call call = call_of(HAPTIC_BOARD_COMMAND, *device);
  call.size = static_cast<std::uint32_t>(size);
  call.now_us = now_us;
  std::copy_n(bytes, std::min<std::size_t>(size, HAPTIC_BOARD_BYTES), call.bytes);
  const haptic_board_answer answer = board().make(call);
  *device = answer.device;
  return answer.result;
}

void haptic_device_bus_event(haptic_device* device) {
  *device = board().make(call_of(HAPTIC_BOARD_BUS_EVENT, *device)).device;
}

const haptic_drive* haptic_device_drive(const haptic_device* device) {
  const auto* const begin = reinterpret_cast<const std::byte*>(device);
  return reinterpret_cast<const haptic_drive*>(begin + board().drive_at());
}
