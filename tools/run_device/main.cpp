// SPDX-License-Identifier: Apache-2.0
// run_device: haptic devices on this machine.
#include <CLI/App.hpp>
#include <string_view>
#include <vector>

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
  CLI::App program("Haptic devices on this machine.", "run_device");
  const Command commands[] = {add_doctor_command(program), add_run_command(program)};
  const std::vector<const char*> arguments = with_command(argc, argv);
  return run_program(program, commands,
                     "0 done, 1 a check failed, 2 usage, 3 bad input file, 4 the device or the "
                     "machine is not fit",
                     static_cast<int>(arguments.size()), arguments.data());
}
