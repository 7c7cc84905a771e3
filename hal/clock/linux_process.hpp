// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Requests of a process and its threads to Linux before a servo loop: memory that stays where it
/// is, a heap that keeps what it has, a stack that is there, no timer slack, no deep idle states, a
/// real-time priority, a core. Each request is answered with 0 or an errno; none throws, and one
/// that is refused changes nothing.

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>

namespace haptic::hal {

/// mlockall of what is mapped and of all that will be. With a finite RLIMIT_MEMLOCK and without
/// CAP_IPC_LOCK it may be granted and later allocations refused (EAGAIN, ENOMEM).
[[nodiscard]] int lock_all_memory() noexcept;
void unlock_all_memory() noexcept;

/// free() gives no page back and malloc() maps no region of its own, so that memory which was
/// touched once is never faulted in again. For the life of the process. EINVAL: another malloc.
[[nodiscard]] int keep_heap() noexcept;

/// Touches `bytes` of the calling thread's stack below the caller, page by page. The stack must
/// have them.
void prefault_stack(std::size_t bytes) noexcept;

/// One malloc and free: the first of a thread sets up its arena, which takes far longer than those
/// that follow.
void touch_heap() noexcept;

/// How much later than asked the kernel may wake the calling thread [ns], 1 at the least; 50 000 by
/// default. Threads of SCHED_FIFO have none anyway.
[[nodiscard]] int set_timer_slack(std::int64_t slack_ns) noexcept;

/// SCHED_FIFO for the calling thread. EPERM: neither RLIMIT_RTPRIO nor CAP_SYS_NICE, or a control
/// group without real-time budget. EINVAL: not within 1 to 99.
[[nodiscard]] int set_fifo_priority(int priority) noexcept;

/// Ties the calling thread to one core. EINVAL: no such core, or not one of this control group.
[[nodiscard]] int tie_to_cpu(int cpu) noexcept;

/// Pages that had to be brought in since the start; `major` ones came from a disk. In a loop that
/// is set up well both stay as they are.
struct PageFaults {
  std::int64_t minor = 0, major = 0;
  friend bool operator==(const PageFaults&, const PageFaults&) = default;
};
[[nodiscard]] PageFaults page_faults_of_thread() noexcept;  ///< of the calling thread
[[nodiscard]] PageFaults page_faults_of_process() noexcept;

/// Keeps all cores out of deep idle states while it lives (PM quality of service, latency 0).
class IdleStateHold {
 public:
  explicit IdleStateHold(const char* file = "/dev/cpu_dma_latency") noexcept : file_(file) {}
  ~IdleStateHold() { release(); }
  IdleStateHold(const IdleStateHold&) = delete;
  IdleStateHold& operator=(const IdleStateHold&) = delete;

  [[nodiscard]] int hold() noexcept;  ///< held already: 0
  void release() noexcept;
  [[nodiscard]] bool held() const noexcept { return descriptor_ >= 0; }

 private:
  const char* file_;
  int descriptor_ = -1;
};

/// The requests in the order in which they are made.
enum class StartStep : std::uint8_t {
  kHeap = 0,
  kMemoryLock,
  kIdleStates,
  kTimerSlack,
  kStack,
  kAffinity,
  kPriority,
  kCount
};

/// "memory lock", "SCHED_FIFO priority".
[[nodiscard]] const char* to_text(StartStep step) noexcept;

/// One request and its answer.
struct StepGrant {
  StartStep step = StartStep::kCount;
  bool asked = false;
  int error = 0;  ///< errno; 0: granted, or not asked for
  [[nodiscard]] bool granted() const noexcept { return asked && error == 0; }
};

struct ProcessSettings {
  bool keep_heap = true, lock_memory = true, hold_idle_states = true;
};
struct ThreadSettings {
  int priority = 0;  ///< SCHED_FIFO, 1 to 99; 0: ordinary
  int cpu = -1;      ///< negative: any
  std::size_t prefault_bytes = 128 * 1024;
  std::int64_t timer_slack_ns = 1;
};

/// Holds what was granted to a process while its loop runs. Owner: the main thread, which starts it
/// before any thread of the loop.
class RealtimeProcess {
 public:
  RealtimeProcess() = default;
  ~RealtimeProcess();  ///< unlocks the memory that it locked
  RealtimeProcess(const RealtimeProcess&) = delete;
  RealtimeProcess& operator=(const RealtimeProcess&) = delete;

  std::array<StepGrant, 3> start(const ProcessSettings& settings) noexcept;

 private:
  IdleStateHold idle_states_;
  bool locked_ = false;
};

/// To be called by the thread itself, before its loop. The priority comes last: what is slow is
/// done before this thread can hold up others.
std::array<StepGrant, 4> start_realtime_thread(const ThreadSettings& settings) noexcept;

/// While it lives the threads that are made block every signal but those of errors of their own
/// (SEGV, BUS, FPE, ILL, ABRT, SYS, TRAP): a handler of the program that they belong to never runs
/// on a real-time thread, at its priority. Owner: the thread that makes them.
class SignalsHeld {
 public:
  SignalsHeld() noexcept;
  ~SignalsHeld();
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace haptic::hal
