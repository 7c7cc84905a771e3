// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of host_sim, one per file. Each adds its options to the command line; the returned
/// function runs it and gives the exit code (tools/common/error.hpp). Bad input comes out as
/// tools::InputError.

#include <CLI/App.hpp>
#include <functional>

namespace haptic::sim {

/// A command line subcommand and what it does when it was named.
struct Command {
  CLI::App* app = nullptr;
  std::function<int()> run;
};

[[nodiscard]] Command add_compare_laws_command(CLI::App& program);
[[nodiscard]] Command add_continuity_command(CLI::App& program);
[[nodiscard]] Command add_delay_command(CLI::App& program);
[[nodiscard]] Command add_faults_command(CLI::App& program);
[[nodiscard]] Command add_motion_command(CLI::App& program);
[[nodiscard]] Command add_pareto_command(CLI::App& program);
[[nodiscard]] Command add_play_command(CLI::App& program);
[[nodiscard]] Command add_proxy_fuzz_command(CLI::App& program);
[[nodiscard]] Command add_rates_command(CLI::App& program);
[[nodiscard]] Command add_replay_command(CLI::App& program);
[[nodiscard]] Command add_reproduce_paper_command(CLI::App& program);
[[nodiscard]] Command add_run_command(CLI::App& program);
[[nodiscard]] Command add_soak_command(CLI::App& program);
[[nodiscard]] Command add_stability_command(CLI::App& program);
[[nodiscard]] Command add_usb_device_command(CLI::App& program);
[[nodiscard]] Command add_vectors_command(CLI::App& program);
[[nodiscard]] Command add_verify_command(CLI::App& program);
[[nodiscard]] Command add_wcet_command(CLI::App& program);

}  // namespace haptic::sim
