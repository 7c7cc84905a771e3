// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop in a process of its own, so that a crash of it leaves somebody who holds the
/// device: the parent keeps the USB thread and ramps the force down, however the child ended.

#include <cstdint>
#include <functional>
#include <string>

namespace haptic::hal {

/// How a process ended.
struct ProcessEnd {
  bool ended = false;
  int exit_code = 0;  ///< when it was not killed; -1: another took the news of it
  int signal = 0;     ///< that killed it; 0: it returned
};

/// "running", "exit code 0", "killed by signal 11 (Segmentation fault)".
[[nodiscard]] std::string to_text(const ProcessEnd& end);

/// Owner: one thread of the parent. Start it before any thread of the parent and before a device is
/// open: the child has only the thread that forked, and would keep the device's descriptor open.
class ServoProcess {
 public:
  ServoProcess() = default;
  ~ServoProcess();  ///< kills a child that still runs
  ServoProcess(const ServoProcess&) = delete;
  ServoProcess& operator=(const ServoProcess&) = delete;

  enum class Tie : std::uint8_t { kDiesWithParent = 0, kOutlivesParent };

  /// Forks; the child runs `body` and leaves with its result, without the parent's destructors; an
  /// exception out of `body` aborts it. The parent's signal handlers are not the child's, as after
  /// exec; its signal mask is. Tied to the parent, the child is killed when the thread that called
  /// this ends: what it computes can reach the device by the parent alone. Returns 0, the errno of
  /// fork, or EBUSY: it was started before.
  int start(const std::function<int()>& body, Tie tie = Tie::kDiesWithParent);

  [[nodiscard]] int pid() const noexcept { return pid_; }
  /// Readable once the child has ended; -1: the kernel has no such thing (before Linux 5.3).
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

  /// Says whether the child has ended, and how; waits at most `timeout_ms` (0: only looks), less if
  /// a signal comes.
  [[nodiscard]] ProcessEnd poll(int timeout_ms) noexcept;

  /// True while it is stopped by SIGSTOP or a debugger.
  [[nodiscard]] bool is_stopped() const noexcept;

  /// Its end, which is made where it does not come within `timeout_ms`: killed, also when frozen.
  ProcessEnd finish(int timeout_ms) noexcept;

  void signal(int number) noexcept;  ///< to the child, while it runs

 private:
  int pid_ = -1;
  int descriptor_ = -1;  ///< pidfd
  ProcessEnd end_;
};

}  // namespace haptic::hal
