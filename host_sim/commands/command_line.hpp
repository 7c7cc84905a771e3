// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Command line of a program with sub-commands, one per file. Each adds its options; the returned
/// function runs it and gives the exit code (tools/common/error.hpp). Bad input comes out as
/// tools::InputError.

#include <CLI/App.hpp>
#include <functional>
#include <span>

namespace haptic::sim {

/// A command line sub-command and what it does when it was named.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

/// Parses the command line and runs the command that it names. @return the exit code of the
/// program; errors are printed with the program's name.
[[nodiscard]] int run_program(CLI::App& program, std::span<const Command> commands, int argc,
                              char** argv);

}  // namespace haptic::sim
