// SPDX-License-Identifier: Apache-2.0
#include "host_sim/timing/heap_interposer.hpp"

#include <cerrno>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HAPTIC_COUNT_HEAP 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAPTIC_COUNT_HEAP 0
#endif
#endif
#ifndef HAPTIC_COUNT_HEAP
#if defined(__GLIBC__)
#define HAPTIC_COUNT_HEAP 1
#else
#define HAPTIC_COUNT_HEAP 0
#endif
#endif

namespace {
thread_local std::uint64_t calls = 0;
}  // namespace

#if HAPTIC_COUNT_HEAP
// Memory comes from glibc as before; `free` needs no stand-in.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  ++calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  ++calls;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  ++calls;
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++calls;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  ++calls;
  *p = __libc_memalign(alignment, size);
  return *p == nullptr ? ENOMEM : 0;
}
}
#endif

namespace haptic::sim {

std::uint64_t heap_calls_of_this_thread() { return calls; }

bool heap_calls_are_counted() { return HAPTIC_COUNT_HEAP != 0; }

}  // namespace haptic::sim
