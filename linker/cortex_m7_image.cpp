// SPDX-License-Identifier: Apache-2.0
// The core on a Cortex-M7: runs the embedded scene over a motion that the host feeds as a file and
// writes what each tick gave and cost. Command line: image POSES RESULTS (pose_drive.hpp).
// Exit codes: 0 done, 1 a tick or the scene was refused, 2 command line, 3 poses cannot be read, 4
// results cannot be written, 70 fault of the processor.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "linker/pose_drive.hpp"
#include "linker/semihosting.hpp"

extern "C" {
extern const std::byte rt_scene_blob[];  // scene_blob.S.in
extern const std::byte rt_scene_blob_end[];
extern std::byte haptic_stack_begin[];  // cortex_m7.ld
extern std::byte haptic_stack_end[];
[[noreturn]] void image_main() noexcept;
}

namespace haptic {
namespace {

constexpr std::byte kPaint{0xA5};
constexpr std::size_t kBlock = 64;  // ticks per call of the host

[[gnu::section(".bss.rt_state"), gnu::aligned(64)]] std::byte state[HAPTIC_IMAGE_STATE_BYTES];
std::array<DrivePose, kBlock> poses;
std::array<DriveTick, kBlock> ticks;
char words[256];

/// SysTick, which counts down from 2^24 - 1 at the processor's clock. Exact as long as less than
/// 2^24 units pass between start() and stop().
class Stopwatch {
 public:
  static constexpr std::uint32_t kTop = 0x00FFFFFF;

  Stopwatch() noexcept {
    reload() = kTop;
    current() = 0;  // any value: it starts again from the top
    control() = 5;  // runs, from the processor's clock, no exception
  }
  void start() noexcept {
    (void)(control() & kWrapped);  // reading clears the mark
    begin_ = current();
  }
  [[nodiscard]] std::uint32_t stop() const noexcept {
    // Mark before value: a wrap between the two then shows in the value alone.
    const bool wrapped = (control() & kWrapped) != 0;
    const std::uint32_t end = current();
    const std::uint32_t units = (begin_ - end) & kTop;
    return wrapped && end <= begin_ ? units + kTop + 1 : units;
  }

 private:
  static constexpr std::uint32_t kWrapped = 1u << 16;
  static volatile std::uint32_t& at(std::uintptr_t address) noexcept {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
  }
  static volatile std::uint32_t& control() noexcept { return at(0xE000E010); }
  static volatile std::uint32_t& reload() noexcept { return at(0xE000E014); }
  static volatile std::uint32_t& current() noexcept { return at(0xE000E018); }

  std::uint32_t begin_ = 0;
};

/// What a tick with nothing in it costs.
std::uint32_t empty_units(Stopwatch& stopwatch) noexcept {
  std::uint32_t least = Stopwatch::kTop;
  for (int trial = 0; trial < 8; ++trial) {
    stopwatch.start();
    least = std::min(least, stopwatch.stop());
  }
  return least;
}

/// The two file names of the command line, cut apart in place.
bool file_names(const char*& motion, const char*& results) noexcept {
  if (!semihosting::command_line(words)) return false;
  const char* word[3] = {};
  std::size_t count = 0;
  bool within = false;
  for (char& c : words) {
    if (c == '\0') break;
    if (c == ' ') {
      c = '\0';
      within = false;
    } else if (!within) {
      if (count == 3) return false;
      word[count++] = &c;
      within = true;
    }
  }
  motion = word[1];
  results = word[2];
  return count == 3;
}

/// Feeds all poses of `motion`; false when the results were not taken.
bool run(PoseDrive& drive, Stopwatch& stopwatch, semihosting::File motion,
         semihosting::File results) noexcept {
  for (;;) {
    const std::size_t bytes = semihosting::read(motion, std::as_writable_bytes(std::span(poses)));
    const std::size_t count = bytes / sizeof(DrivePose);
    if (count == 0) return true;
    for (std::size_t k = 0; k < count; ++k) {
      const StepInput input = drive.input_of(poses[k]);
      stopwatch.start();
      const StepResult result = drive.core().step(input);
      const std::uint32_t units = stopwatch.stop();
      ticks[k] = drive.tick_of(result);
      ticks[k].clock_units = units;
    }
    if (!semihosting::write(results, std::as_bytes(std::span(ticks).first(count)))) return false;
  }
}

/// Paints the stack below the caller's frames.
void paint_stack() noexcept {
  constexpr std::ptrdiff_t kOwnFrame = 256;
  const auto* here = static_cast<const std::byte*>(__builtin_frame_address(0));
  for (volatile std::byte* p = haptic_stack_begin; p < here - kOwnFrame; ++p) *p = kPaint;
}

std::uint32_t stack_used() noexcept {
  const std::byte* deepest = haptic_stack_begin;
  while (deepest < haptic_stack_end && *deepest == kPaint) ++deepest;
  return static_cast<std::uint32_t>(haptic_stack_end - deepest);
}

int drive_scene() noexcept {
  const char* motion_name = nullptr;
  const char* results_name = nullptr;
  if (!file_names(motion_name, results_name)) return 2;
  const semihosting::File motion = semihosting::open(motion_name, semihosting::Mode::kRead);
  if (motion < 0) return 3;
  const semihosting::File results = semihosting::open(results_name, semihosting::Mode::kWrite);
  if (results < 0) return 4;

  PoseDrive drive;
  Stopwatch stopwatch;
  const std::span<const std::byte> blob(
      rt_scene_blob, static_cast<std::size_t>(rt_scene_blob_end - rt_scene_blob));
  const RtStatus opened = drive.open(blob, state);
  if (opened == RtStatus::kOk && !run(drive, stopwatch, motion, results)) return 4;
  DriveSummary summary = drive.summary();
  summary.empty_clock_units = empty_units(stopwatch);
  summary.stack_bytes = stack_used();
  summary.stack_room_bytes = static_cast<std::uint32_t>(haptic_stack_end - haptic_stack_begin);
  if (!semihosting::write(results, std::as_bytes(std::span(&summary, 1)))) return 4;
  if (!semihosting::close(results)) return 4;
  return summary.status == static_cast<std::uint32_t>(RtStatus::kOk) ? 0 : 1;
}

}  // namespace
}  // namespace haptic

void image_main() noexcept {
  haptic::paint_stack();
  haptic::semihosting::exit(haptic::drive_scene());
}
