// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How the kernel schedules each thread of this process.

#include <sched.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace haptic::test {

struct OwnThread {
  int id = 0;
  std::string name;
  int policy = -1;
  int priority = 0;
  int cpus = 0;  ///< that it may run on
};

inline std::vector<OwnThread> own_threads() {
  std::vector<OwnThread> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    OwnThread thread;
    thread.id = std::stoi(entry.path().filename());
    std::ifstream(entry.path() / "comm") >> thread.name;
    thread.policy = sched_getscheduler(thread.id);
    sched_param parameters{};
    if (sched_getparam(thread.id, &parameters) == 0) thread.priority = parameters.sched_priority;
    cpu_set_t cpus;
    if (sched_getaffinity(thread.id, sizeof cpus, &cpus) == 0) thread.cpus = CPU_COUNT(&cpus);
    if (thread.policy >= 0) threads.push_back(thread);  // else it has ended meanwhile
  }
  return threads;
}

/// The first of that name; policy -1 where there is none.
inline OwnThread own_thread(const std::string& name) {
  for (OwnThread& each : own_threads()) {
    if (each.name == name) return each;
  }
  return {};
}

inline bool all_ordinary(const std::vector<OwnThread>& threads, const std::string& but = "") {
  for (const OwnThread& each : threads) {
    if (each.policy != SCHED_OTHER && each.name != but) return false;
  }
  return true;
}

}  // namespace haptic::test
