// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reaction of the programs of a held device to signals. Every signal that can be caught and would
/// end the holder starts the ramp; a fatal one, after which nothing can be relied upon, sends one
/// zero command; the servo processes listen to the holder alone.

#include <csignal>
#include <cstddef>
#include <string>

#include "hal/zero_command.hpp"

namespace haptic::hal {

/// Owner: the thread that holds the device's processes; threads that it makes inherit the mask.
class StopSignals {
 public:
  StopSignals() = default;
  ~StopSignals() { give_back(); }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// From now on HUP, INT, QUIT, TERM, USR1, USR2, ALRM, VTALRM, PROF, XCPU, IO, PWR, STKFLT, TSTP
  /// and the real-time signals are read from descriptor(); PIPE, TTIN, TTOU and XFSZ are ignored:
  /// the call that caused them says so. CHLD is as the system has it at first, for a caller that
  /// ignored it would keep from us how a child ended. @return 0 or an errno.
  int take() noexcept;
  /// As before `take`; what has come since is dropped.
  void give_back() noexcept;

  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// The signal that came; 0: none.
  [[nodiscard]] int asked() noexcept;

 private:
  int descriptor_ = -1;  ///< signalfd
  sigset_t mask_before_{};
};

/// Blocks for good the signals that StopSignals reads, in this thread and those that it makes: for
/// a program that has more to write once its processes have ended, and that ends then. A second
/// signal does not cost it its report.
void block_stop_signals() noexcept;

/// In a servo process: everything that the holder reads is ignored. A signal to a whole group is
/// the holder's to follow, and who has been asked to stop ends as it says.
void leave_signals_to_holder() noexcept;

/// SIGSEGV, BUS, FPE, ILL, ABRT, SYS and TRAP of this process send the `command` of each `device`,
/// below kMostDevices, once, then do what they would have done. Null: no longer. `command` stays
/// valid meanwhile.
void send_zero_on_fatal(std::size_t device, const ZeroCommand* command) noexcept;

/// "SIGHUP (Hangup)".
[[nodiscard]] std::string signal_text(int number);

}  // namespace haptic::hal
