// SPDX-License-Identifier: Apache-2.0
// run_device: haptic devices on this machine.
#include <unistd.h>

#include <CLI/App.hpp>
#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

#include "hal/realtime/process_hardening.hpp"
#include "tools/run_device/commands.hpp"

namespace {

// The descriptor of `--session N`; -1: there is none.
int session_descriptor(std::span<char* const> arguments) {
  for (std::size_t k = 0; k + 1 < arguments.size(); ++k)
    if (std::string_view(arguments[k]) == "--session") return std::atoi(arguments[k + 1]);
  return -1;
}

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
  // A run lasts: what a shell had open is not held by it, nor by its children.
  const int kept[] = {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO,
                      session_descriptor({argv, static_cast<std::size_t>(argc)})};
  (void)haptic::hal::close_inherited_descriptors(kept);
  CLI::App program("Haptic devices on this machine.", "run_device");
  const Command commands[] = {add_doctor_command(program), add_list_command(program),
                              add_run_command(program), add_conform_command(program)};
  const std::vector<const char*> arguments = with_command(argc, argv);
  return run_program(program, commands,
                     "0 done, 1 a check failed, 2 usage, 3 bad input file, 4 the device or the "
                     "machine is not fit",
                     static_cast<int>(arguments.size()), arguments.data());
}
