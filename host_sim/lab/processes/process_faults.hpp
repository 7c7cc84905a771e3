// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What can happen to each process of a run, and what the device must be handed then.

#include <cstdint>
#include <span>
#include <string>

namespace haptic::sim {

/// Where the operator is when it happens; the device is calibrated and reports.
enum class OperatorState : std::uint8_t {
  kDisarmed = 0,  ///< pressed on the wall, never armed
  kArming,        ///< pressed lightly, on the way of the ramp in
  kArmedFree,     ///< armed, away from the wall
  kArmedContact,  ///< armed, pressed firmly
  kDisarming,     ///< as before, on the way of the ramp out
  kFaulted,       ///< as before, then an emergency stop is latched
  kCount
};
[[nodiscard]] const char* to_text(OperatorState state);

/// To whom it happens.
enum class ProcessVictim : std::uint8_t {
  kServo = 0,
  kSpare,
  kServoAndSpare,
  kGuardian,
  kZeroKeeper,
  kGroup,  ///< all of them but the zero-keeper, which is in a session of its own
  kTerminal,
  kLogReader,
  kSecondProgram,
  kSecondDevice,
  kDevice,  ///< the process that serves it
  kBridge   ///< between it and run_device
};
[[nodiscard]] const char* to_text(ProcessVictim victim);

enum class ProcessCause : std::uint8_t {
  kNothing = 0,
  kSignal,       ///< ProcessFault::number
  kScribble,     ///< every byte of what it may write: pattern ProcessFault::number
  kClose,        ///< the reader's end is closed
  kStopReading,  ///< nobody reads any more; then SIGTERM
  kStart,        ///< another run_device on the same device
  kReplace,      ///< the device is unplugged, another of 0.2 N is plugged in
  kStopThenGo,   ///< SIGSTOP, and SIGCONT after ProcessFault::number ms
  kDeaf,         ///< it passes on no command for ProcessFault::number ms, and goes on reporting
  kDeafThenKill  ///< the same, a bridge stopped, and the guardian is killed on the way
};

/// What the device is handed from then on.
enum class ProcessOutput : std::uint8_t {
  kGoesOn = 0,   ///< as if nothing had happened
  kBounded,      ///< follows what is said, within force and slew limits, or ramps to zero
  kRampsToZero,  ///< no step beyond the slew limit, and it never rises
  kZeroAtOnce    ///< one zero command, or the device's own cut
};
[[nodiscard]] const char* to_text(ProcessOutput output);

struct ProcessFault {
  const char* name;
  ProcessVictim victim;
  ProcessCause cause;
  int number = 0;
  ProcessOutput output = ProcessOutput::kGoesOn;
  int exit_code = -1;      ///< of the program by itself; -1: it goes on
  const char* says = "";   ///< in its lines; empty: nothing in particular
  const char* never = "";  ///< not in its lines
  const char* latched_as = "-";
};

/// All; the first is none.
[[nodiscard]] std::span<const ProcessFault> process_faults();

/// As a Markdown table: process, fault, output, what is said, exit code. Equal rows share one.
[[nodiscard]] std::string process_semantics();

}  // namespace haptic::sim
