// SPDX-License-Identifier: Apache-2.0
#include "hal/clock/linux_process.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace haptic::hal {
namespace {

constexpr std::size_t kPageBytes = 4096;

PageFaults page_faults_of(int who) noexcept {
  rusage usage{};
  (void)getrusage(who, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace

int lock_all_memory() noexcept { return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno; }

void unlock_all_memory() noexcept { (void)munlockall(); }

int keep_heap() noexcept {
  // -1 switches trimming off: it stands for the greatest size.
  const bool kept = mallopt(M_TRIM_THRESHOLD, -1) == 1 && mallopt(M_MMAP_MAX, 0) == 1;
  return kept ? 0 : EINVAL;
}

[[gnu::noinline]] void prefault_stack(std::size_t bytes) noexcept {
  volatile unsigned char page[kPageBytes];
  page[0] = 1;
  // A compiler that sees every use of the page keeps the two bytes alone, as clang++ does.
  asm volatile("" : : "r"(page) : "memory");
  if (bytes > kPageBytes) prefault_stack(bytes - kPageBytes);
  page[kPageBytes - 1] = page[0];  // after the call: the frame stays
}

void touch_heap() noexcept {
  void* volatile block = std::malloc(kPageBytes);
  std::free(block);
}

int set_timer_slack(std::int64_t slack_ns) noexcept {
  if (slack_ns < 1) return EINVAL;  // 0 would mean: back to the default
  return prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(slack_ns), 0, 0, 0) == 0 ? 0 : errno;
}

int set_fifo_priority(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
}

int tie_to_cpu(int cpu) noexcept {
  if (cpu < 0 || cpu >= CPU_SETSIZE) return EINVAL;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET(static_cast<unsigned>(cpu), &cpus);
  return pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
}

PageFaults page_faults_of_thread() noexcept { return page_faults_of(RUSAGE_THREAD); }

PageFaults page_faults_of_process() noexcept { return page_faults_of(RUSAGE_SELF); }

int IdleStateHold::hold() noexcept {
  if (held()) return 0;
  const int descriptor = open(file_, O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const std::int32_t latency_us = 0;
  if (write(descriptor, &latency_us, sizeof latency_us) != sizeof latency_us) {
    const int error = errno;
    close(descriptor);
    return error;
  }
  descriptor_ = descriptor;
  return 0;
}

void IdleStateHold::release() noexcept {
  if (!held()) return;
  close(descriptor_);
  descriptor_ = -1;
}

const char* to_text(StartStep step) noexcept {
  static constexpr const char* kTexts[] = {
      "heap kept",        "memory lock",   "no deep idle states", "timer slack",
      "stack prefaulted", "core affinity", "SCHED_FIFO priority"};
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) == static_cast<std::size_t>(StartStep::kCount));
  return step < StartStep::kCount ? kTexts[static_cast<std::size_t>(step)] : "?";
}

RealtimeProcess::~RealtimeProcess() {
  if (locked_) unlock_all_memory();
}

std::array<StepGrant, 3> RealtimeProcess::start(const ProcessSettings& settings) noexcept {
  // The heap first: what it maps by itself should lie within what is locked.
  const int heap_error = settings.keep_heap ? hal::keep_heap() : 0;
  const int lock_error = settings.lock_memory ? lock_all_memory() : 0;
  locked_ = locked_ || (settings.lock_memory && lock_error == 0);
  const int idle_error = settings.hold_idle_states ? idle_states_.hold() : 0;
  return {StepGrant{StartStep::kHeap, settings.keep_heap, heap_error},
          StepGrant{StartStep::kMemoryLock, settings.lock_memory, lock_error},
          StepGrant{StartStep::kIdleStates, settings.hold_idle_states, idle_error}};
}

std::array<StepGrant, 4> start_realtime_thread(const ThreadSettings& settings) noexcept {
  const int slack_error = set_timer_slack(settings.timer_slack_ns);
  const bool prefault = settings.prefault_bytes > 0;
  if (prefault) prefault_stack(settings.prefault_bytes);
  touch_heap();
  const bool tie = settings.cpu >= 0, raise = settings.priority > 0;
  const int cpu_error = tie ? tie_to_cpu(settings.cpu) : 0;
  const int priority_error = raise ? set_fifo_priority(settings.priority) : 0;
  return {StepGrant{StartStep::kTimerSlack, true, slack_error},
          StepGrant{StartStep::kStack, prefault, 0},
          StepGrant{StartStep::kAffinity, tie, cpu_error},
          StepGrant{StartStep::kPriority, raise, priority_error}};
}

SignalsHeld::SignalsHeld() noexcept {
  sigset_t held;
  sigfillset(&held);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP})
    sigdelset(&held, number);
  (void)pthread_sigmask(SIG_BLOCK, &held, &before_);
}

SignalsHeld::~SignalsHeld() { (void)pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

}  // namespace haptic::hal
