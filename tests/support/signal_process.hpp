// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A signal to one process.

#include <doctest/doctest.h>
#include <sys/types.h>

#include <csignal>

namespace haptic::test {

/// For kill(), 0 is the whole group and -1 every process of the user: what fork() returns when it
/// fails, and what a process that was not started has for its number.
inline void signal_process(pid_t pid, int number) {
  REQUIRE(pid > 0);
  REQUIRE(kill(pid, number) == 0);
}

}  // namespace haptic::test
