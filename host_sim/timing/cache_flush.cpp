// SPDX-License-Identifier: Apache-2.0
#include "host_sim/timing/cache_flush.hpp"

#include <link.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace haptic::sim {
namespace {

constexpr std::size_t kLineBytes = 64;

#if defined(__x86_64__)

constexpr std::size_t kStackBytes = std::size_t{64} * 1024;

/// Segments of the program itself, which comes first, that are not written: code and constants.
int add_program(dl_phdr_info* info, std::size_t, void* list) {
  auto& memory = *static_cast<std::vector<std::span<const std::byte>>*>(list);
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& segment = info->dlpi_phdr[i];
    if (segment.p_type != PT_LOAD || (segment.p_flags & PF_W) != 0) continue;
    memory.emplace_back(reinterpret_cast<const std::byte*>(info->dlpi_addr + segment.p_vaddr),
                        segment.p_memsz);
  }
  return 1;
}

void flush(std::span<const std::byte> bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += kLineBytes) _mm_clflush(bytes.data() + at);
}

/// The stack that the next calls will use, where the caller's frame ends.
[[gnu::noinline]] void flush_stack() {
  volatile std::byte below[kStackBytes];
  for (std::size_t at = 0; at < kStackBytes; at += kLineBytes) below[at] = std::byte{0};
  for (std::size_t at = 0; at < kStackBytes; at += kLineBytes)
    _mm_clflush(const_cast<const std::byte*>(&below[at]));
}

#else

/// Twice the last-level cache as the C library knows it.
std::size_t walk_bytes() {
  constexpr long kUnknownBytes = 32L * 1024 * 1024;
  long cache = 0;
#if defined(_SC_LEVEL3_CACHE_SIZE)
  cache = std::max(sysconf(_SC_LEVEL3_CACHE_SIZE), sysconf(_SC_LEVEL2_CACHE_SIZE));
#endif
  return 2 * static_cast<std::size_t>(cache > 0 ? cache : kUnknownBytes);
}

#endif

}  // namespace

#if defined(__x86_64__)

CacheFlush::CacheFlush(std::vector<std::span<const std::byte>> memory)
    : memory_(std::move(memory)) {
  dl_iterate_phdr(add_program, &memory_);
}

void CacheFlush::run() {
  for (const std::span<const std::byte> bytes : memory_) flush(bytes);
  flush_stack();
  _mm_mfence();
}

std::size_t CacheFlush::byte_count() const {
  std::size_t count = kStackBytes;
  for (const std::span<const std::byte> bytes : memory_) count += bytes.size();
  return count;
}

const char* CacheFlush::method() { return "line flush"; }

#else

CacheFlush::CacheFlush(std::vector<std::span<const std::byte>> memory)
    : memory_(std::move(memory)), walked_(walk_bytes()) {}

void CacheFlush::run() {
  for (std::size_t at = 0; at < walked_.size(); at += kLineBytes) {
    volatile unsigned char& line = walked_[at];
    line = static_cast<unsigned char>(line + 1);
  }
}

std::size_t CacheFlush::byte_count() const { return walked_.size(); }

const char* CacheFlush::method() { return "walk over a buffer"; }

#endif

}  // namespace haptic::sim
