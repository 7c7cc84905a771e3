// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A signal to one process, and how it is found: by the name that it has given itself.

#include <doctest/doctest.h>
#include <sys/types.h>

#include <csignal>
#include <fstream>
#include <string>

namespace haptic::test {

/// For kill(), 0 is the whole group and -1 every process of the user: what fork() returns when it
/// fails, and what a process that was not started has for its number.
inline void signal_process(pid_t pid, int number) {
  REQUIRE(pid > 0);
  REQUIRE(kill(pid, number) == 0);
}

/// A child of `parent` by its name (/proc/PID/comm); 0: none.
inline pid_t child_named(pid_t parent, const std::string& name) {
  const std::string of_parent = "/proc/" + std::to_string(parent) + "/task/";
  std::ifstream children(of_parent + std::to_string(parent) + "/children");
  for (pid_t child = 0; children >> child;) {
    std::string found;
    std::getline(std::ifstream("/proc/" + std::to_string(child) + "/comm"), found);
    if (found == name) return child;
  }
  return 0;
}

}  // namespace haptic::test
