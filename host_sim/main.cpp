// SPDX-License-Identifier: Apache-2.0
// host_sim: the host simulator. Scenes and motions in; replays, checks, plots and timings out.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "host_sim/commands/commands.hpp"
#include "tools/common/error.hpp"

int main(int argc, char** argv) {
  using namespace haptic;
  CLI::App program(
      "Host simulator: replays motions through the real-time core, checks and times it.",
      "host_sim");
  program.set_version_flag("--version", std::string("host_sim ") + HAPTIC_VERSION);
  program.require_subcommand(1);
  const sim::Command commands[] = {sim::add_compare_laws_command(program),
                                   sim::add_continuity_command(program),
                                   sim::add_delay_command(program),
                                   sim::add_faults_command(program),
                                   sim::add_motion_command(program),
                                   sim::add_pareto_command(program),
                                   sim::add_play_command(program),
                                   sim::add_proxy_fuzz_command(program),
                                   sim::add_rates_command(program),
                                   sim::add_replay_command(program),
                                   sim::add_reproduce_paper_command(program),
                                   sim::add_run_command(program),
                                   sim::add_soak_command(program),
                                   sim::add_stability_command(program),
                                   sim::add_usb_device_command(program),
                                   sim::add_vectors_command(program),
                                   sim::add_verify_command(program),
                                   sim::add_wcet_command(program)};
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? tools::kExitDone : tools::kExitUsage;
  }
  try {
    for (const sim::Command& command : commands) {
      if (command.app->parsed()) return command.run();
    }
  } catch (const tools::InputError& error) {
    std::fprintf(stderr, "host_sim: %s\n", error.what());
    return tools::kExitBadInput;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "host_sim: the operating system refused: %s\n", error.what());
    return tools::kExitDeviceOrOs;
  }
  return tools::kExitUsage;
}
