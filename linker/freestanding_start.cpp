// SPDX-License-Identifier: Apache-2.0
// Everything that the core needs besides itself: an entry, a stack, four functions of memory. The
// image knows two system calls, write and exit, so that it can run as a test on x86-64 Linux; a
// board has its own in their place.

#include <cstddef>
#include <cstdint>
#include <span>

#include "linker/image_run.hpp"

#ifndef __x86_64__
#error \
    "the example image starts on x86-64 Linux; write _start and the two calls for another machine"
#endif

extern "C" {
extern const std::byte rt_scene_blob[];  // scene_blob.S.in
extern const std::byte rt_scene_blob_end[];
extern std::byte rt_state[];  // image_state.S.in
extern std::byte rt_state_end[];
[[gnu::weak]] extern const haptic::Real rt_motion[];  // image_motion.S.in, where there is one
[[gnu::weak]] extern const haptic::Real rt_motion_end[];
extern std::byte haptic_stack_begin[];  // bare_metal_example.ld
extern std::byte haptic_stack_end[];

// The compiler may call these for any copy or comparison of memory. They are built with
// -fno-builtin: otherwise it would see a copy loop and call memcpy from within memcpy.
void* memcpy(void* to, const void* from, std::size_t bytes) {
  auto* out = static_cast<unsigned char*>(to);
  const auto* in = static_cast<const unsigned char*>(from);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = in[i];
  return to;
}

void* memmove(void* to, const void* from, std::size_t bytes) {
  auto* out = static_cast<unsigned char*>(to);
  const auto* in = static_cast<const unsigned char*>(from);
  if (reinterpret_cast<std::uintptr_t>(out) <= reinterpret_cast<std::uintptr_t>(in))
    return memcpy(to, from, bytes);
  for (std::size_t i = bytes; i > 0; --i) out[i - 1] = in[i - 1];
  return to;
}

void* memset(void* to, int value, std::size_t bytes) {
  auto* out = static_cast<unsigned char*>(to);
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<unsigned char>(value);
  return to;
}

int memcmp(const void* left, const void* right, std::size_t bytes) {
  const auto* a = static_cast<const unsigned char*>(left);
  const auto* b = static_cast<const unsigned char*>(right);
  for (std::size_t i = 0; i < bytes; ++i) {
    if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
  }
  return 0;
}
}

namespace {

constexpr std::byte kPaint{0xA5};

long system_call(long number, long a, long b, long c) noexcept {
  long result = 0;
  asm volatile("syscall"
               : "=a"(result)
               : "a"(number), "D"(a), "S"(b), "d"(c)
               : "rcx", "r11", "memory");
  return result;
}

/// One line of text built in place; longer text is cut.
class Line {
 public:
  void add(const char* text) noexcept {
    while (*text != '\0') put(*text++);
  }
  void add_number(std::uint64_t value) noexcept {
    char digits[20];
    int count = 0;
    do {
      digits[count++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    while (count > 0) put(digits[--count]);
  }
  void add_hash(std::uint64_t value) noexcept {
    for (int shift = 60; shift >= 0; shift -= 4) put("0123456789abcdef"[(value >> shift) & 15u]);
  }
  void print() noexcept {
    put('\n');
    system_call(1, 1, reinterpret_cast<long>(text_), static_cast<long>(size_));
  }

 private:
  void put(char c) noexcept {
    if (size_ < sizeof(text_)) text_[size_++] = c;
  }
  char text_[160] = {};
  std::size_t size_ = 0;
};

}  // namespace

/// Called by _start on the image's own stack. Paints the unused stack first, so that afterwards the
/// lowest byte that changed tells how deep the calls went.
extern "C" [[noreturn, gnu::used]] void freestanding_main(std::byte* stack_pointer) noexcept {
  constexpr std::ptrdiff_t kOwnFrame = 1024;  // this function and what it calls to paint
  for (volatile std::byte* p = haptic_stack_begin; p < stack_pointer - kOwnFrame; ++p) *p = kPaint;

  const std::span<const std::byte> blob(
      rt_scene_blob, static_cast<std::size_t>(rt_scene_blob_end - rt_scene_blob));
  const std::span<std::byte> state(rt_state, static_cast<std::size_t>(rt_state_end - rt_state));
  const std::span<const haptic::Real> motion(rt_motion,
                                             static_cast<std::size_t>(rt_motion_end - rt_motion));
  const haptic::ImageReport report = haptic::run_image(blob, state, motion);

  const std::byte* deepest = haptic_stack_begin;
  while (deepest < haptic_stack_end && *deepest == kPaint) ++deepest;

  Line line;
  line.add("verdict ");
  line.add_number(static_cast<std::uint64_t>(report.verdict));
  line.add(" ticks ");
  line.add_number(report.ticks);
  line.add(" contact ");
  line.add_number(report.contact_ticks);
  line.add(" hash ");
  line.add_hash(report.hash);
  line.print();
  Line stack;
  stack.add("stack ");
  stack.add_number(static_cast<std::uint64_t>(haptic_stack_end - deepest));
  stack.add(" of ");
  stack.add_number(static_cast<std::uint64_t>(haptic_stack_end - haptic_stack_begin));
  stack.add(" bytes");
  stack.print();
  system_call(231, static_cast<long>(report.verdict), 0, 0);  // exit_group
  __builtin_trap();
}

// The kernel's stack is left unused: a board starts with the one that the linker script reserves.
asm(R"(
    .section .start,"ax",@progbits
    .globl _start
    .type _start, @function
_start:
    xorl %ebp, %ebp
    leaq haptic_stack_end(%rip), %rsp
    andq $-16, %rsp
    movq %rsp, %rdi
    call freestanding_main
    ud2
    .size _start, . - _start
    .text
)");
