// SPDX-License-Identifier: Apache-2.0
// host_sim: the host simulator. Scenes and motions in; replays, checks and plots out.
#include <CLI/App.hpp>
#include <cstdio>
#include <exception>
#include <string_view>
#include <utility>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/laboratory.hpp"

int main(int argc, char** argv) {
  using namespace haptic;
  // host_sim help wcet is host_lab help wcet.
  const bool asks = argc > 2 && std::string_view(argv[1]) == "help";
  if (argc > 1 && sim::is_laboratory_command(argv[asks ? 2 : 1])) {
    try {
      sim::become_laboratory(argv);
    } catch (const tools::UsageError& error) {
      std::fprintf(stderr, "host_sim: %s\n", error.what());
      return tools::kExitUsage;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "host_sim: %s\n", error.what());
      return tools::kExitDeviceOrOs;
    }
  }
  CLI::App program("Host simulator: replays motions through the real-time core and shows them.",
                   "host_sim");
  const sim::Command commands[] = {
      sim::add_motion_command(program),     sim::add_plan_command(program),
      sim::add_play_command(program),       sim::add_replay_command(program),
      sim::add_run_command(program),        sim::add_serve_command(program),
      sim::add_usb_device_command(program), sim::add_view_command(program)};
  program.footer(sim::laboratory_help());  // now, or every command would inherit it
  return tools::run_program(program, commands, tools::kCommonExitCodes, argc, argv,
                            sim::laboratory_commands());
}
