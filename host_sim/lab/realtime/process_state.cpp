// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/realtime/process_state.hpp"

#include <dirent.h>
#include <malloc.h>

#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace haptic::sim {
namespace {

unsigned open_descriptors() {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) throw std::runtime_error("/proc/self/fd cannot be read");
  unsigned count = 0;
  while (const dirent* entry = ::readdir(folder)) count += entry->d_name[0] != '.' ? 1u : 0u;
  ::closedir(folder);
  return count - 1;  // the folder's own
}

}  // namespace

ProcessState process_state() {
  ProcessState state;
  std::FILE* file = std::fopen("/proc/self/status", "r");
  if (file == nullptr) throw std::runtime_error("/proc/self/status cannot be read");
  char line[256];
  while (std::fgets(line, sizeof line, file) != nullptr) {
    unsigned long value = 0;
    if (std::sscanf(line, "VmRSS: %lu kB", &value) == 1) state.resident_bytes = 1024ull * value;
    if (std::sscanf(line, "Threads: %lu", &value) == 1)
      state.threads = static_cast<unsigned>(value);
  }
  std::fclose(file);
  state.descriptors = open_descriptors();
#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 heap = ::mallinfo2();
  state.heap_bytes = heap.uordblks + heap.hblkhd;
#endif
  return state;
}

}  // namespace haptic::sim
