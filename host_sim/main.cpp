// SPDX-License-Identifier: Apache-2.0
// host_sim: the host simulator. Scenes and motions in; replays, checks and plots out.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/laboratory.hpp"
#include "tools/common/error.hpp"

int main(int argc, char** argv) {
  using namespace haptic;
  if (argc > 1 && sim::is_laboratory_command(argv[1])) {
    try {
      sim::become_laboratory(argv);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "host_sim: %s\n", error.what());
      return tools::kExitDeviceOrOs;
    }
  }
  CLI::App program("Host simulator: replays motions through the real-time core and shows them.",
                   "host_sim");
  program.set_version_flag("--version", std::string("host_sim ") + HAPTIC_VERSION);
  program.footer(sim::laboratory_help());
  const sim::Command commands[] = {sim::add_motion_command(program), sim::add_play_command(program),
                                   sim::add_replay_command(program), sim::add_run_command(program),
                                   sim::add_usb_device_command(program)};
  return sim::run_program(program, commands, argc, argv);
}
