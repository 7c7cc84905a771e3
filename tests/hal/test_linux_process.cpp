// SPDX-License-Identifier: Apache-2.0
// Where this machine does not grant a request, its errno must say so and nothing may have changed.
#include <doctest/doctest.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstdlib>
#include <memory>
#include <thread>

#include "hal/clock/linux_process.hpp"
#include "hal/realtime/system_probes.hpp"
#include "hal/realtime/system_tree.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::hal;

namespace {

// A sanitizer has its own heap and stacks, and locks no memory. g++ and clang++ say so differently.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HAPTIC_TEST_SANITIZED
#endif
#endif
#if defined(HAPTIC_TEST_SANITIZED) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kOwnMemory = false;
#else
constexpr bool kOwnMemory = true;
#endif

constexpr std::size_t kPageBytes = 4096;

template <typename Body>
void in_a_thread(Body body) {
  std::thread(body).join();
}

// Touches the stack below the caller.
[[gnu::noinline]] int use_stack() {
  volatile unsigned char block[96 * 1024];
  for (std::size_t i = 0; i < sizeof block; i += kPageBytes) block[i] = 1;
  return block[0];
}

long locked_kilobytes() {
  return std::atol(
      value_after(SystemTree().text("/proc/self/status").value_or(""), "VmLck:").c_str());
}

}  // namespace

TEST_SUITE("hal.linux_process") {
  TEST_CASE("set_timer_slack: what the kernel then has; 0 is refused") {
    in_a_thread([] {
      CHECK(set_timer_slack(0) == EINVAL);
      CHECK(set_timer_slack(1) == 0);
      CHECK(prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0) == 1);
      CHECK(set_timer_slack(70'000) == 0);
      CHECK(prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0) == 70'000);
    });
  }

  TEST_CASE("tie_to_cpu: one core of those allowed; one that is not there is refused") {
    in_a_thread([] {
      cpu_set_t allowed;
      REQUIRE(pthread_getaffinity_np(pthread_self(), sizeof allowed, &allowed) == 0);
      CHECK(tie_to_cpu(-1) == EINVAL);
      CHECK(tie_to_cpu(CPU_SETSIZE) == EINVAL);
      cpu_set_t now;
      pthread_getaffinity_np(pthread_self(), sizeof now, &now);
      CHECK(CPU_EQUAL(&now, &allowed));
      int cpu = 0;
      while (!CPU_ISSET(static_cast<unsigned>(cpu), &allowed)) ++cpu;
      CHECK(tie_to_cpu(cpu) == 0);
      CHECK(sched_getcpu() == cpu);
      pthread_getaffinity_np(pthread_self(), sizeof now, &now);
      CHECK(CPU_COUNT(&now) == 1);
    });
  }

  TEST_CASE("set_fifo_priority: granted and so, or EPERM and as before; out of range is refused") {
    in_a_thread([] {
      CHECK(set_fifo_priority(0) == EINVAL);
      CHECK(set_fifo_priority(100) == EINVAL);
      const int error = set_fifo_priority(7);
      sched_param parameters{};
      int policy = -1;
      REQUIRE(pthread_getschedparam(pthread_self(), &policy, &parameters) == 0);
      CHECK((error == 0 || error == EPERM));
      CHECK(policy == (error == 0 ? SCHED_FIFO : SCHED_OTHER));
      CHECK(parameters.sched_priority == (error == 0 ? 7 : 0));
    });
  }

  TEST_CASE("page_faults_of_thread: counts pages that are touched first, and only those") {
    constexpr std::size_t kPages = 64;
    void* const memory = mmap(nullptr, kPages * kPageBytes, PROT_READ | PROT_WRITE,
                              MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED);
    madvise(memory, kPages * kPageBytes, MADV_NOHUGEPAGE);
    auto* const bytes = static_cast<volatile unsigned char*>(memory);
    const auto touch = [&] {
      for (std::size_t i = 0; i < kPages; ++i) bytes[i * kPageBytes] = 1;
    };
    const PageFaults before = page_faults_of_thread(), process_before = page_faults_of_process();
    touch();
    const PageFaults between = page_faults_of_thread();
    touch();
    const PageFaults after = page_faults_of_thread();
    munmap(memory, kPages * kPageBytes);
    CHECK(between.minor - before.minor >= static_cast<std::int64_t>(kPages));
    CHECK(page_faults_of_process().minor - process_before.minor >=
          static_cast<std::int64_t>(kPages));
    if (kOwnMemory) CHECK(after == between);
  }

  TEST_CASE("prefault_stack: what was touched does not fault again; without it, it does") {
    if (!kOwnMemory) return;
    PageFaults with, without;
    const auto faults_of_use = [] {
      const PageFaults before = page_faults_of_thread();
      CHECK(use_stack() == 1);
      const PageFaults after = page_faults_of_thread();
      return PageFaults{after.minor - before.minor, after.major - before.major};
    };
    // Not std::thread: the stack is mapped again here, and no earlier thread has touched it.
    struct Run {
      decltype(faults_of_use)& measure;
      PageFaults& result;
      bool prefault;
    };
    for (const bool prefault : {false, true}) {
      constexpr std::size_t kStackBytes = 512 * 1024;
      void* const stack = mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE,
                               MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
      REQUIRE(stack != MAP_FAILED);
      madvise(stack, kStackBytes, MADV_NOHUGEPAGE);
      Run run{faults_of_use, prefault ? with : without, prefault};
      pthread_attr_t attributes;
      pthread_attr_init(&attributes);
      pthread_attr_setstack(&attributes, stack, kStackBytes);
      pthread_t thread{};
      REQUIRE(pthread_create(
                  &thread, &attributes,
                  [](void* argument) -> void* {
                    auto& r = *static_cast<Run*>(argument);
                    (void)page_faults_of_thread();
                    if (r.prefault) prefault_stack(200 * 1024);
                    r.result = r.measure();
                    return nullptr;
                  },
                  &run) == 0);
      pthread_join(thread, nullptr);
      pthread_attr_destroy(&attributes);
      munmap(stack, kStackBytes);
    }
    CHECK(without.minor >= 20);  // 24 pages, less those that the start had touched
    CHECK(with == PageFaults{});
  }

  TEST_CASE("keep_heap: a large block comes from the heap, not from a mapping of its own") {
    if (!kOwnMemory) return;
    CHECK(keep_heap() == 0);
    const std::size_t mapped = mallinfo2().hblks;
    void* volatile block = std::malloc(4 * 1024 * 1024);
    CHECK(mallinfo2().hblks == mapped);
    std::free(block);
    touch_heap();
  }

  TEST_CASE("IdleStateHold: writes a latency of 0 and keeps the file; tells why it could not") {
    const haptic::sim::test::ScratchFolder folder("idle_states");
    const std::string file = folder.file("cpu_dma_latency");
    IdleStateHold absent(file.c_str());
    CHECK(absent.hold() == ENOENT);
    CHECK_FALSE(absent.held());
    std::ofstream(file).flush();
    IdleStateHold hold(file.c_str());
    CHECK(hold.hold() == 0);
    CHECK(hold.held());
    CHECK(hold.hold() == 0);  // once
    CHECK(haptic::sim::test::text_of_file(file) == std::string(4, '\0'));
    hold.release();
    CHECK_FALSE(hold.held());
  }

  TEST_CASE("RealtimeProcess: locks while it lives, and says what it was not granted") {
    const long before = locked_kilobytes();
    {
      RealtimeProcess process;
      ProcessSettings settings;
      settings.hold_idle_states = false;
      const auto grants = process.start(settings);
      CHECK(grants[0].step == StartStep::kHeap);
      CHECK(grants[1].step == StartStep::kMemoryLock);
      CHECK(grants[1].asked);
      if (grants[1].granted()) {
        if (kOwnMemory) CHECK(locked_kilobytes() > before);
      } else {
        CHECK((grants[1].error == ENOMEM || grants[1].error == EPERM));
      }
      CHECK_FALSE(grants[2].asked);
      CHECK_FALSE(grants[2].granted());
    }
    CHECK(locked_kilobytes() == 0);
  }

  TEST_CASE("start_realtime_thread: each step in turn, what was not asked for is not granted") {
    in_a_thread([] {
      ThreadSettings settings;
      settings.cpu = CPU_SETSIZE + 1;
      const auto grants = start_realtime_thread(settings);
      CHECK(grants[0].granted());
      CHECK(grants[1].granted());
      CHECK(grants[2].error == EINVAL);
      CHECK_FALSE(grants[3].asked);
      CHECK(prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0) == 1);
    });
    for (std::size_t i = 0; i < static_cast<std::size_t>(StartStep::kCount); ++i)
      CHECK(std::string(to_text(static_cast<StartStep>(i))).size() > 3);
  }
}

TEST_SUITE("hal.system_probes") {
  TEST_CASE("probes put back what they tried") {
    LinuxProbes probes;
    cpu_set_t before, after;
    pthread_getaffinity_np(pthread_self(), sizeof before, &before);
    const int fifo = probes.try_fifo(5);
    CHECK((fifo == 0 || fifo == EPERM));
    CHECK(sched_getscheduler(0) == SCHED_OTHER);
    CHECK(probes.try_cpu(CPU_SETSIZE - 1) == EINVAL);
    for (int cpu = 0; cpu < 4; ++cpu) {
      const bool allowed = CPU_ISSET(static_cast<unsigned>(cpu), &before);
      if (allowed) CHECK(probes.try_cpu(cpu) == 0);
    }
    pthread_getaffinity_np(pthread_self(), sizeof after, &after);
    CHECK(CPU_EQUAL(&before, &after));
    (void)probes.try_memory_lock();
    CHECK(locked_kilobytes() == 0);
    CHECK(probes.try_node("/dev/null") == 0);
    CHECK(probes.try_node("/nowhere/at/all") == ENOENT);
    CHECK(probes.try_usb_library().version.starts_with("1."));
  }

  TEST_CASE("measure: counts every tick of the time asked for, none twice") {
    const auto m = std::make_unique<WakeupMeasurement>();
    LinuxProbes().measure({1'000'000, 100'000'000, 0, -1}, *m);
    CHECK(m->error == 0);
    CHECK(m->priority == 0);
    CHECK(m->lateness.count() + m->missed_periods >= 100);
    CHECK(m->lateness.count() <= 100);
    CHECK(m->late_ticks <= m->missed_periods);
    CHECK(locked_kilobytes() == 0);
  }
}
