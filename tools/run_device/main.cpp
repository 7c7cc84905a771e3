// SPDX-License-Identifier: Apache-2.0
// run_device: haptic devices on this machine.
#include <CLI/CLI.hpp>
#include <string_view>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/common/run_main.hpp"
#include "tools/run_device/commands.hpp"

namespace {

// A configuration in the place of a command is one to run.
std::vector<const char*> with_command(int argc, char** argv) {
  std::vector<const char*> arguments(argv, argv + argc);
  if (argc > 1 && std::string_view(argv[1]).ends_with(".toml"))
    arguments.insert(arguments.begin() + 1, "run");
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace haptic::tools;
  CLI::App program(
      "Haptic devices on this machine.\n"
      "Exit codes: 0 done, 1 a check failed, 2 usage, 3 bad input file, 4 the device or the "
      "machine is not fit.",
      "run_device");
  program.set_version_flag("--version", "run_device " HAPTIC_VERSION);
  program.require_subcommand(1);
  const Command commands[] = {add_doctor_command(program), add_run_command(program)};
  const std::vector<const char*> arguments = with_command(argc, argv);
  try {
    program.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kExitDone : kExitUsage;
  }
  return run_main("run_device", [&]() -> int {
    for (const Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
    return kExitUsage;
  });
}
