// SPDX-License-Identifier: Apache-2.0
#include "tests/support/rt_guard.hpp"

#include <cerrno>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HAPTIC_TEST_INTERPOSE 0  // the sanitizers interpose the heap themselves
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAPTIC_TEST_INTERPOSE 0
#endif
#endif
#ifndef HAPTIC_TEST_INTERPOSE
#define HAPTIC_TEST_INTERPOSE 1
#endif

namespace {
thread_local bool guarded = false;
thread_local std::uint64_t calls = 0;
}  // namespace

#if HAPTIC_TEST_INTERPOSE
namespace {
void count() {
  if (guarded) ++calls;
}
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  count();
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  count();
  *p = __libc_memalign(alignment, size);
  return *p == nullptr ? ENOMEM : 0;
}
void free(void* p) {
  count();
  __libc_free(p);
}
}
#endif

namespace haptic::test {

RtGuard::RtGuard() {
  calls = 0;
  guarded = true;
}
RtGuard::~RtGuard() { guarded = false; }
std::uint64_t RtGuard::heap_calls() const { return calls; }

}  // namespace haptic::test
