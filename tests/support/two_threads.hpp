// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A writer and a reader at full speed against each other, to meet in the middle of a copy.

#include <sched.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>

namespace haptic::test {

/// The processors of this thread while it lives: the `nth` of those it had, for two threads that
/// are to run at the same time; with fewer it stays as it is.
class OneProcessor {
 public:
  explicit OneProcessor(int nth) {
    if (sched_getaffinity(0, sizeof(before_), &before_) != 0 || CPU_COUNT(&before_) < 2) return;
    for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (!CPU_ISSET(cpu, &before_) || nth-- != 0) continue;
      cpu_set_t one;
      CPU_ZERO(&one);
      CPU_SET(cpu, &one);
      changed_ = sched_setaffinity(0, sizeof(one), &one) == 0;
    }
  }
  ~OneProcessor() {
    if (changed_) sched_setaffinity(0, sizeof(before_), &before_);
  }
  OneProcessor(const OneProcessor&) = delete;
  OneProcessor& operator=(const OneProcessor&) = delete;

 private:
  cpu_set_t before_{};
  bool changed_ = false;
};

struct TwoThreadRun {
  std::uint64_t written = 0, read = 0;
};

/// Calls `write(n)` with 1, 2, .. in a thread of its own and `read()`, which returns how many
/// values it got, in this one: until `wanted` were got or `most` written. Both are over on return.
template <class Write, class Read>
TwoThreadRun run_two_threads(std::uint64_t wanted, std::uint64_t most, Write write, Read read) {
  TwoThreadRun run;
  // Relaxed and stop-only, so that the run itself orders nothing between the two.
  std::atomic<bool> begun{false}, enough{false}, ended{false};
  std::thread writer([&] {
    const OneProcessor own(1);
    while (!begun.load(std::memory_order_relaxed)) std::this_thread::yield();
    while (run.written < most && !enough.load(std::memory_order_relaxed)) {
      write(++run.written);
      // For a machine with one core; rare, so that most changes of thread are within a copy.
      if (run.written % 4096 == 0) std::this_thread::yield();
    }
    ended.store(true, std::memory_order_relaxed);
  });
  const OneProcessor own(0);
  begun.store(true, std::memory_order_relaxed);
  while (run.read < wanted && !ended.load(std::memory_order_relaxed)) run.read += read();
  enough.store(true, std::memory_order_relaxed);
  writer.join();
  return run;
}

}  // namespace haptic::test
