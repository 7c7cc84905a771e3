// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of run_device, one per file. Each adds its options to the command line; the
/// returned function runs it and gives the exit code (tools/common/error.hpp).

#include "tools/common/command_line.hpp"

namespace haptic::tools {

[[nodiscard]] Command add_conform_command(CLI::App& program);
[[nodiscard]] Command add_doctor_command(CLI::App& program);
[[nodiscard]] Command add_list_command(CLI::App& program);
[[nodiscard]] Command add_run_command(CLI::App& program);

}  // namespace haptic::tools
