// SPDX-License-Identifier: Apache-2.0
// What a host_sim of tools/quickstart does without: the simulated device, the live view and the
// commands of the planner, which are half of its compile time.
#include <string>

#include "host_sim/commands/commands.hpp"
#include "tools/common/left_out.hpp"

namespace haptic::sim {
namespace {

Command left_out(CLI::App& program, const std::string& name) {
  return tools::add_left_out_command(program, name, tools::build_command("host_sim"));
}

}  // namespace

Command add_plan_command(CLI::App& program) { return left_out(program, "plan"); }
Command add_play_command(CLI::App& program) { return left_out(program, "play"); }
Command add_run_command(CLI::App& program) { return left_out(program, "run"); }
Command add_serve_command(CLI::App& program) { return left_out(program, "serve"); }
Command add_usb_device_command(CLI::App& program) { return left_out(program, "usb-device"); }

}  // namespace haptic::sim
