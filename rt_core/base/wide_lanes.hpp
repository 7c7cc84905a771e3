// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Asks this processor for the registers that code for AVX2 takes.

#include <cstdint>

namespace haptic {

#if defined(__x86_64__)
struct ProcessorAnswer {
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
};
/// Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2A, CPUID.
inline ProcessorAnswer ask_processor(std::uint32_t leaf) noexcept {
  ProcessorAnswer answer;
  __asm__ volatile("cpuid"
                   : "=a"(answer.a), "=b"(answer.b), "=c"(answer.c), "=d"(answer.d)
                   : "a"(leaf), "c"(0));
  return answer;
}
#endif

/// True if it has them, and the operating system keeps them. Not for the servo loop.
[[nodiscard]] inline bool has_wide_lanes() noexcept {
#if defined(__x86_64__)
  constexpr std::uint32_t kSavedState = 1u << 27, kAvx = 1u << 28, kAvx2 = 1u << 5, kRegisters = 6;
  if (ask_processor(0).a < 7) return false;
  const std::uint32_t features = ask_processor(1).c;
  if ((features & kSavedState) == 0 || (features & kAvx) == 0) return false;
  std::uint32_t low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return (low & kRegisters) == kRegisters && (ask_processor(7).b & kAvx2) != 0;
#else
  return false;
#endif
}

}  // namespace haptic
