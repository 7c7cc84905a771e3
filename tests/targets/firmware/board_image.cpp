// SPDX-License-Identifier: Apache-2.0
// The firmware core on an emulated Cortex-M: reads calls (board_calls.h) from one file of the host,
// makes them and writes the answers to another. Command line: board CALLS ANSWERS [spoil]; with
// `spoil` every hundredth answer has a wrong bit, for the probe of the tests.
// Exit codes: 0 asked to end, 2 command line, 3 calls end, 4 answers are not taken, 70 fault of the
// processor.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "linker/semihosting.hpp"
#include "tests/targets/firmware/board_calls.h"

extern "C" {
extern std::byte haptic_stack_begin[];  // board.ld
[[noreturn]] void image_main() noexcept;
}

namespace haptic {
namespace {

constexpr std::byte kPaint{0xA5};
constexpr std::ptrdiff_t kOwnFrame = 64;  // of those who paint and look
constexpr std::uint32_t kSpoilEvery = 100;

haptic_board_call call;
haptic_board_answer answer;
char words[128];

/// SysTick, which counts down at the processor's clock; less than 2^24 units a call.
class Stopwatch {
 public:
  static constexpr std::uint32_t kTop = 0x00FFFFFF;
  void start() const noexcept {
    at(0xE000E014) = kTop;
    at(0xE000E018) = 0;
    at(0xE000E010) = 5;  // runs, from the processor's clock, no exception
    begin_ = at(0xE000E018);
  }
  [[nodiscard]] std::uint32_t stop() const noexcept { return (begin_ - at(0xE000E018)) & kTop; }

 private:
  static volatile std::uint32_t& at(std::uintptr_t address) noexcept {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
  }
  mutable std::uint32_t begin_ = 0;
};

[[gnu::noinline]] void paint_stack() noexcept {
  const auto* here = static_cast<const std::byte*>(__builtin_frame_address(0));
  for (volatile std::byte* p = haptic_stack_begin; p < here - kOwnFrame; ++p) *p = kPaint;
}

/// @return bytes from the caller's frame to the deepest that was written.
[[gnu::noinline]] std::uint32_t stack_used() noexcept {
  const volatile std::byte* deepest = haptic_stack_begin;
  const auto* here = static_cast<const std::byte*>(__builtin_frame_address(0));
  while (deepest < here && *deepest == kPaint) ++deepest;
  return static_cast<std::uint32_t>(here - const_cast<const std::byte*>(deepest));
}

/// @return the result of the function that is asked for.
[[gnu::noinline]] std::int32_t made() noexcept {
  haptic_device* const device = &answer.device;
  switch (call.function) {
    case HAPTIC_BOARD_BEGIN:
      haptic_device_begin(device, &call.facts);
      return 0;
    case HAPTIC_BOARD_ANSWER:
      return haptic_device_answer(device, static_cast<std::uint8_t>(call.request_type),
                                  static_cast<std::uint8_t>(call.request),
                                  static_cast<std::uint16_t>(call.value), answer.bytes, call.size);
    case HAPTIC_BOARD_PERIOD:
      return static_cast<std::int32_t>(
          haptic_device_period(device, &call.sample, answer.bytes, call.size));
    case HAPTIC_BOARD_COMMAND:
      return haptic_device_command(device, call.bytes, call.size, call.now_us);
    default:
      haptic_device_bus_event(device);
      return 0;
  }
}

void make_answer() noexcept {
  const Stopwatch stopwatch;
  answer = {};
  if (call.record_bytes != sizeof call || call.device_bytes != sizeof call.device) return;
  answer.record_bytes = sizeof answer;
  answer.device = call.device;
  paint_stack();
  stopwatch.start();
  answer.result = made();
  answer.clock_units = stopwatch.stop();
  answer.stack_bytes = stack_used();
  const auto* const drive = reinterpret_cast<const std::byte*>(haptic_device_drive(&answer.device));
  answer.drive_at =
      static_cast<std::uint32_t>(drive - reinterpret_cast<const std::byte*>(&answer.device));
}

bool read_call(semihosting::File from) noexcept {
  std::span<std::byte> rest = std::as_writable_bytes(std::span(&call, 1));
  while (!rest.empty()) {
    const std::size_t count = semihosting::read(from, rest);
    if (count == 0) return false;
    rest = rest.subspan(count);
  }
  return true;
}

/// The words of the command line, cut apart in place; @return how many there are.
std::size_t cut_words(std::array<const char*, 4>& word) noexcept {
  if (!semihosting::command_line(words)) return 0;
  std::size_t count = 0;
  bool within = false;
  for (char& c : words) {
    if (c == '\0') break;
    if (c == ' ') {
      c = '\0';
      within = false;
    } else if (!within) {
      if (count == word.size()) return 0;
      word[count++] = &c;
      within = true;
    }
  }
  return count;
}

int serve() noexcept {
  std::array<const char*, 4> word{};
  const std::size_t count = cut_words(word);
  if (count < 3) return 2;
  const semihosting::File calls = semihosting::open(word[1], semihosting::Mode::kRead);
  if (calls < 0) return 3;
  const semihosting::File answers = semihosting::open(word[2], semihosting::Mode::kWrite);
  if (answers < 0) return 4;
  for (std::uint32_t number = 1;; ++number) {
    if (!read_call(calls)) return 3;
    if (call.function == HAPTIC_BOARD_END) return 0;
    make_answer();
    if (count == 4 && number % kSpoilEvery == 0) answer.bytes[20] ^= 1;
    if (!semihosting::write(answers, std::as_bytes(std::span(&answer, 1)))) return 4;
  }
}

}  // namespace
}  // namespace haptic

void image_main() noexcept { haptic::semihosting::exit(haptic::serve()); }
