// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a program says when it is asked for a part that its build leaves out.

#include <string>

namespace haptic::tools {

/// The command that builds a target of CMake. @param option  of preset release; may be empty.
[[nodiscard]] inline std::string build_command(const std::string& target,
                                               const std::string& option = {}) {
  return "cmake --preset release " + (option.empty() ? "" : option + " ") +
         "&& cmake --build --preset release --target " + target;
}

/// "plan is not in this build; to get it: COMMAND". The text of a UsageError where `what` was asked
/// for by name.
[[nodiscard]] inline std::string left_out_text(const std::string& what,
                                               const std::string& command) {
  return what + " is not in this build; to get it: " + command;
}

}  // namespace haptic::tools
