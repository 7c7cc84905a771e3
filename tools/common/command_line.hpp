// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The command line of every program, over CLI11: unknown names are named before anything else is
/// said, help is text with exit codes and an example, and each error has its exit code.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"

namespace haptic::tools {

/// A sub-command, or a program that has none, and what it does when it was named.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
  std::string example;  ///< a call that works, for --help
  /// Options of other commands that people give to this one, and what to do instead.
  std::vector<std::pair<std::string, std::string>> elsewhere = {};
};

/// Names of commands that another program does (host_sim hands them to host_lab).
using OtherCommands = std::vector<std::string>;

/// Parses the command line and runs the command that it names: one of the sub-commands, or the only
/// one, whose `app` is the program itself. Adds `help COMMAND`, -V and --version, and to each help
/// its example and `exit_codes`. @return the exit code of the program; errors are printed with the
/// program's name.
[[nodiscard]] int run_program(CLI::App& program, std::span<const Command> commands,
                              const std::string& exit_codes, int argc, const char* const* argv,
                              const OtherCommands& others = {});

/// A command that this build leaves out: with any words behind its name it says how to get it
/// (left_out_text) and ends with kExitUsage. @param command  that builds a program with it.
[[nodiscard]] Command add_left_out_command(CLI::App& program, const std::string& name,
                                           const std::string& command);

/// Meaning of the exit codes for a program that has no meaning of its own for 1.
inline constexpr const char* kCommonExitCodes =
    "0 done, 1 a check failed, 2 usage, 3 bad input, 4 the device or the system refused";

/// Checks of numbers whose messages a person reads.
[[nodiscard]] CLI::Validator positive_number();
[[nodiscard]] CLI::Validator number_not_negative();
/// CLI::Range, and nan is no number in it.
[[nodiscard]] CLI::Validator number_within(double least, double most);

/// An option whose value is one of `choices`, by name.
template <typename T>
CLI::Option* add_choice(CLI::App& app, const std::string& names, T& target,
                        std::vector<std::pair<std::string, T>> choices, const std::string& help) {
  std::vector<std::string> known;
  for (const auto& choice : choices) known.push_back(choice.first);
  return app
      .add_option_function<std::string>(
          names,
          [&target, choices = std::move(choices)](const std::string& word) {
            for (const auto& [name, value] : choices)
              if (name == word) target = value;
          },
          help)
      ->check(CLI::IsMember(known));
}

/// The same for a list of values, separated by commas or spaces.
template <typename T>
CLI::Option* add_choices(CLI::App& app, const std::string& names, std::vector<T>& target,
                         std::vector<std::pair<std::string, T>> choices, const std::string& help) {
  std::vector<std::string> known;
  for (const auto& choice : choices) known.push_back(choice.first);
  return app
      .add_option_function<std::vector<std::string>>(
          names,
          [&target, choices = std::move(choices)](const std::vector<std::string>& words) {
            target.clear();
            for (const std::string& word : words)
              for (const auto& [name, value] : choices)
                if (name == word) target.push_back(value);
          },
          help)
      ->delimiter(',')
      ->check(CLI::IsMember(known));
}

}  // namespace haptic::tools
