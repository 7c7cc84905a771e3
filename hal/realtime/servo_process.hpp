// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo loop in a process of its own, so that a crash of it leaves somebody who holds the
/// device: the parent keeps the USB thread and ramps the force down, whatever killed the child.

#include <functional>
#include <string>

namespace haptic::hal {

/// How a process ended.
struct ProcessEnd {
  bool ended = false;
  int exit_code = 0;  ///< when it was not killed
  int signal = 0;     ///< that killed it; 0: it returned
};

/// "exit code 0", "killed by signal 11 (Segmentation fault)".
[[nodiscard]] std::string to_text(const ProcessEnd& end);

/// Owner: one thread of the parent. Start it before any thread of the parent: the child has only
/// the thread that forked.
class ServoProcess {
 public:
  ServoProcess() = default;
  ~ServoProcess();  ///< kills a child that still runs
  ServoProcess(const ServoProcess&) = delete;
  ServoProcess& operator=(const ServoProcess&) = delete;

  /// Forks; the child runs `body` and leaves with its result, without the parent's destructors. It
  /// gets SIGTERM when the parent dies. Returns 0, or the errno of fork.
  int start(const std::function<int()>& body);

  [[nodiscard]] int pid() const noexcept { return pid_; }

  /// Whether the child has ended, and how; waits at most `timeout_ms` (0: only looks).
  [[nodiscard]] ProcessEnd poll(int timeout_ms) noexcept;

  void signal(int number) noexcept;  ///< to the child, while it runs

 private:
  int pid_ = -1;
  int descriptor_ = -1;  ///< pidfd: readable when the child has ended
  ProcessEnd end_;
};

}  // namespace haptic::hal
