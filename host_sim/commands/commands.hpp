// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of host_sim.

#include "tools/common/command_line.hpp"

namespace haptic::sim {

using tools::Command;

[[nodiscard]] Command add_motion_command(CLI::App& program);
[[nodiscard]] Command add_plan_command(CLI::App& program);
[[nodiscard]] Command add_play_command(CLI::App& program);
[[nodiscard]] Command add_replay_command(CLI::App& program);
[[nodiscard]] Command add_run_command(CLI::App& program);
[[nodiscard]] Command add_serve_command(CLI::App& program);
[[nodiscard]] Command add_usb_device_command(CLI::App& program);
[[nodiscard]] Command add_view_command(CLI::App& program);

}  // namespace haptic::sim
