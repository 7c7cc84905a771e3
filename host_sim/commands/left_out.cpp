// SPDX-License-Identifier: Apache-2.0
// What a host_sim of tools/quickstart does without: the simulated device, the live view and the
// commands of the planner, which are half of its compile time. Each command says so, and how to
// build the whole program.
#include <string>

#include "host_sim/commands/commands.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kWhole =
    "this host_sim was built by tools/quickstart, which leaves it out; build the whole one: "
    "cmake --preset release && cmake --build --preset release --target host_sim";

Command left_out(CLI::App& program, const std::string& name) {
  CLI::App* app =
      program.add_subcommand(name, "Not in this program, which tools/quickstart built.");
  app->allow_extras();
  return {app, [name]() -> int { throw tools::OsError(name + ": " + kWhole); },
          "cmake --preset release && cmake --build --preset release --target host_sim"};
}

}  // namespace

Command add_plan_command(CLI::App& program) { return left_out(program, "plan"); }
Command add_play_command(CLI::App& program) { return left_out(program, "play"); }
Command add_run_command(CLI::App& program) { return left_out(program, "run"); }
Command add_serve_command(CLI::App& program) { return left_out(program, "serve"); }
Command add_usb_device_command(CLI::App& program) { return left_out(program, "usb-device"); }

}  // namespace haptic::sim
