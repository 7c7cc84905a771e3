// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands that host_sim hands on to host_lab, the program next to it.

#include <string>
#include <string_view>
#include <vector>

namespace haptic::sim {

[[nodiscard]] bool is_laboratory_command(std::string_view name);

/// Their names.
[[nodiscard]] std::vector<std::string> laboratory_commands();

/// The names with what each does, for --help.
[[nodiscard]] std::string laboratory_help();

/// Becomes host_lab with the same arguments; returns only where that program cannot be started.
/// @throws tools::UsageError  it is not there, with what to build; std::system_error.
[[noreturn]] void become_laboratory(char** argv);

}  // namespace haptic::sim
