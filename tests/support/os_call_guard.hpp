// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a thread asks of the C library that may block it or enter the kernel: counted by functions
/// that stand in front of the library's; and a filter with which the kernel itself ends the process
/// at a system call that was not allowed.

#include <cstdint>
#include <span>

namespace haptic::test {

struct OsCalls {
  std::uint64_t locks = 0;   ///< of mutexes, read-write and spin locks, waits for conditions
  std::uint64_t sleeps = 0;  ///< the futex of wait_for_state
  std::uint64_t clocks = 0;  ///< clock_gettime, which need not enter the kernel
  std::uint64_t others = 0;  ///< any other wrapper of a system call among those that are watched
};

/// While one is alive, calls of this thread are counted.
class OsCallGuard {
 public:
  OsCallGuard();
  ~OsCallGuard();
  OsCallGuard(const OsCallGuard&) = delete;
  OsCallGuard& operator=(const OsCallGuard&) = delete;
  [[nodiscard]] OsCalls calls() const;
};

/// False under a sanitizer, which stands in front of the C library itself: nothing is counted, and
/// its own system calls would meet the filter.
[[nodiscard]] bool os_calls_are_counted();

/// From now on any system call of this thread that is not in `allowed` ends the process with
/// SIGSYS. Returns 0, or the errno of a kernel that has no filters or does not let us.
int allow_only(std::span<const int> allowed);

}  // namespace haptic::test
