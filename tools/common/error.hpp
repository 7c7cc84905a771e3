// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Errors and exit codes of the offline programs.

#include <stdexcept>
#include <string>

namespace haptic::tools {

/// Exit codes of every program of the project.
enum ExitCode : int {
  kExitDone = 0,
  kExitCheckFailed = 1,  ///< a check failed: wrong verdict, replay diverged, count over its bound
  kExitUsage = 2,        ///< unknown option or missing argument
  kExitBadInput = 3,     ///< a file cannot be read or cannot be repaired
  kExitDeviceOrOs = 4    ///< the device or the operating system refused
};

/// The command line asks for what cannot be meant: kExitUsage. Form: "m.csv: --out would overwrite
/// the motion; give another name".
class UsageError : public std::runtime_error {
 public:
  explicit UsageError(const std::string& text) : std::runtime_error(text) {}
};

/// The operating system refused: kExitDeviceOrOs.
class OsError : public std::runtime_error {
 public:
  explicit OsError(const std::string& text) : std::runtime_error(text) {}
};

/// Bad input. The text is complete for a person: file, place (line, byte offset or metres), defect,
/// fix. Form: "peg.obj:41: face 12 is not flat (2.1e-3 m); split the face into triangles".
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& text) : std::runtime_error(text) {}
};

/// A part exceeds a limit that stands for time or memory: too many reflex edges, pieces or units of
/// exact work. The input may be sound; a coarser one passes, a finer one does not.
class LimitError : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace haptic::tools
