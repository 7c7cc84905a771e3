// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of run_device, one per file. Each adds its options to the command line; the
/// returned function runs it and gives the exit code (tools/common/error.hpp).

#include <CLI/App.hpp>
#include <functional>

namespace haptic::tools {

/// A command line subcommand and what it does when it was named.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

[[nodiscard]] Command add_doctor_command(CLI::App& program);
[[nodiscard]] Command add_run_command(CLI::App& program);

}  // namespace haptic::tools
