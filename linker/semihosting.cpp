// SPDX-License-Identifier: Apache-2.0
#include "linker/semihosting.hpp"

#ifndef __thumb__
#error "semihosting of the Arm M profile: breakpoint 0xAB in Thumb state"
#endif

namespace haptic::semihosting {
namespace {

/// Operation numbers of the specification.
enum class Operation : std::uint32_t {
  kOpen = 0x01,
  kClose = 0x02,
  kPrint = 0x04,
  kWrite = 0x05,
  kRead = 0x06,
  kCommandLine = 0x15,
  kExit = 0x20
};

/// `block`: the operation's argument, most often the address of an array of words.
std::int32_t call(Operation operation, const volatile void* block) noexcept {
  register std::uint32_t r0 asm("r0") = static_cast<std::uint32_t>(operation);
  register const volatile void* r1 asm("r1") = block;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory", "cc");
  return static_cast<std::int32_t>(r0);
}

std::uint32_t address(const void* p) noexcept {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(p));
}

}  // namespace

File open(const char* name, Mode mode) noexcept {
  std::uint32_t length = 0;
  while (name[length] != '\0') ++length;
  const std::uint32_t block[] = {address(name), static_cast<std::uint32_t>(mode), length};
  return call(Operation::kOpen, block);
}

bool close(File file) noexcept {
  const std::uint32_t block[] = {static_cast<std::uint32_t>(file)};
  return call(Operation::kClose, block) == 0;
}

std::size_t read(File file, std::span<std::byte> bytes) noexcept {
  const std::uint32_t block[] = {static_cast<std::uint32_t>(file), address(bytes.data()),
                                 static_cast<std::uint32_t>(bytes.size())};
  const auto left = static_cast<std::uint32_t>(call(Operation::kRead, block));
  return left <= bytes.size() ? bytes.size() - left : 0;
}

bool write(File file, std::span<const std::byte> bytes) noexcept {
  const std::uint32_t block[] = {static_cast<std::uint32_t>(file), address(bytes.data()),
                                 static_cast<std::uint32_t>(bytes.size())};
  return call(Operation::kWrite, block) == 0;
}

void print(const char* text) noexcept { call(Operation::kPrint, text); }

bool command_line(std::span<char> text) noexcept {
  std::uint32_t block[] = {address(text.data()), static_cast<std::uint32_t>(text.size())};
  return call(Operation::kCommandLine, block) == 0;
}

void exit(int code) noexcept {
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t block[] = {kApplicationExit, static_cast<std::uint32_t>(code)};
  call(Operation::kExit, block);
  for (;;) asm volatile("wfi");
}

}  // namespace haptic::semihosting
