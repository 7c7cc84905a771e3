// SPDX-License-Identifier: Apache-2.0
// ioctl, read and lseek are those of haptic_usbfs, which ends in syscall() for descriptors that it
// does not answer.
#include "tests/support/os_call_guard.hpp"

#include <dlfcn.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HAPTIC_COUNT_CALLS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAPTIC_COUNT_CALLS 0
#endif
#endif
#ifndef HAPTIC_COUNT_CALLS
#define HAPTIC_COUNT_CALLS 1
#endif

namespace {

thread_local bool guarded = false;
thread_local haptic::test::OsCalls counted;

}  // namespace

#if HAPTIC_COUNT_CALLS
namespace {

void count(std::uint64_t haptic::test::OsCalls::*kind) {
  if (guarded) counted.*kind += 1;
}

using Any = long (*)(long, long, long, long, long, long);

/// The library's own function behind ours; looked up once. What has more than one version is found
/// by name in its oldest, which for conditions is another type.
void* behind(std::atomic<void*>& known, const char* name, const char* version = nullptr) {
  void* function = known.load(std::memory_order_relaxed);
  if (function == nullptr) {
    if (version != nullptr) function = dlvsym(RTLD_NEXT, name, version);
    if (function == nullptr) function = dlsym(RTLD_NEXT, name);
    known.store(function, std::memory_order_relaxed);
  }
  return function;
}

}  // namespace

// Arguments of these are integers and pointers, at most six, which the machine's calling convention
// passes alike: what is not an argument is not looked at. A pointer that comes back comes whole.
// The label gives the symbol, since the headers have declared the name already.
#define HAPTIC_STAND_IN(kind, name, version)                                                     \
  extern "C" long in_front_of_##name(long a, long b, long c, long d, long e, long f) asm(#name); \
  extern "C" long in_front_of_##name(long a, long b, long c, long d, long e, long f) {           \
    static constinit std::atomic<void*> known{nullptr};                                          \
    count(&haptic::test::OsCalls::kind);                                                         \
    const auto its = reinterpret_cast<Any>(behind(known, #name, version));                       \
    return its(a, b, c, d, e, f);                                                                \
  }
#define HAPTIC_LOCK(name) HAPTIC_STAND_IN(locks, name, nullptr)
#define HAPTIC_SYSTEM(name) HAPTIC_STAND_IN(others, name, nullptr)
#define HAPTIC_CONDITION(name) HAPTIC_STAND_IN(locks, name, "GLIBC_2.3.2")

HAPTIC_LOCK(pthread_mutex_lock)
HAPTIC_LOCK(pthread_mutex_trylock)
HAPTIC_LOCK(pthread_mutex_timedlock)
HAPTIC_LOCK(pthread_rwlock_rdlock)
HAPTIC_LOCK(pthread_rwlock_wrlock)
HAPTIC_LOCK(pthread_rwlock_tryrdlock)
HAPTIC_LOCK(pthread_rwlock_trywrlock)
HAPTIC_LOCK(pthread_spin_lock)
HAPTIC_LOCK(pthread_spin_trylock)
HAPTIC_CONDITION(pthread_cond_wait)
HAPTIC_CONDITION(pthread_cond_timedwait)
HAPTIC_CONDITION(pthread_cond_signal)
HAPTIC_CONDITION(pthread_cond_broadcast)
HAPTIC_LOCK(pthread_barrier_wait)
HAPTIC_LOCK(sem_wait)
HAPTIC_LOCK(sem_trywait)
HAPTIC_LOCK(sem_timedwait)
HAPTIC_LOCK(sem_post)
HAPTIC_STAND_IN(clocks, clock_gettime, nullptr)
HAPTIC_SYSTEM(gettimeofday)
HAPTIC_SYSTEM(time)
HAPTIC_SYSTEM(write)
HAPTIC_SYSTEM(readv)
HAPTIC_SYSTEM(writev)
HAPTIC_SYSTEM(pread)
HAPTIC_SYSTEM(pwrite)
HAPTIC_SYSTEM(openat)
HAPTIC_SYSTEM(close)
HAPTIC_SYSTEM(poll)
HAPTIC_SYSTEM(ppoll)
HAPTIC_SYSTEM(select)
HAPTIC_SYSTEM(pselect)
HAPTIC_SYSTEM(epoll_wait)
HAPTIC_SYSTEM(epoll_pwait)
HAPTIC_SYSTEM(send)
HAPTIC_SYSTEM(recv)
HAPTIC_SYSTEM(nanosleep)
HAPTIC_SYSTEM(clock_nanosleep)
HAPTIC_SYSTEM(usleep)
HAPTIC_SYSTEM(sched_yield)
HAPTIC_SYSTEM(mmap)
HAPTIC_SYSTEM(munmap)
HAPTIC_SYSTEM(mremap)
HAPTIC_SYSTEM(mprotect)
HAPTIC_SYSTEM(madvise)
HAPTIC_SYSTEM(brk)
HAPTIC_SYSTEM(sbrk)
HAPTIC_SYSTEM(getpid)
HAPTIC_SYSTEM(kill)
HAPTIC_SYSTEM(pthread_kill)

extern "C" long in_front_of_syscall(long number, ...) asm("syscall");
extern "C" long in_front_of_syscall(long number, ...) {
  using Real = long (*)(long, long, long, long, long, long, long);
  static constinit std::atomic<void*> known{nullptr};
  std::array<long, 6> a{};
  va_list list;
  va_start(list, number);
  for (long& argument : a) argument = va_arg(list, long);
  va_end(list);
  count(number == SYS_futex ? &haptic::test::OsCalls::sleeps : &haptic::test::OsCalls::others);
  const auto real = reinterpret_cast<Real>(behind(known, "syscall"));
  return real(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}
#endif

namespace haptic::test {

OsCallGuard::OsCallGuard() {
  counted = OsCalls{};
  guarded = true;
}
OsCallGuard::~OsCallGuard() { guarded = false; }
OsCalls OsCallGuard::calls() const { return counted; }

bool os_calls_are_counted() { return HAPTIC_COUNT_CALLS != 0; }

int allow_only(std::span<const int> allowed) {
  constexpr std::size_t kMost = 16;
  std::array<sock_filter, 2 * kMost + 5> program{};
  std::size_t n = 0;
  const auto add = [&](unsigned code, unsigned k, unsigned yes = 0, unsigned no = 0) {
    program[n++] = {static_cast<__u16>(code), static_cast<__u8>(yes), static_cast<__u8>(no), k};
  };
  if (allowed.size() > kMost) return E2BIG;
#if defined(__x86_64__)
  // Numbers mean something else on another architecture, and x32 shares ours.
  add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch));
  add(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 1, 0);
  add(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
#endif
  add(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  for (const int number : allowed) {
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(number), 0, 1);
    add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  }
  add(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  const sock_fprog filter{static_cast<unsigned short>(n), program.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return errno;
  return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0 ? errno : 0;
}

}  // namespace haptic::test
