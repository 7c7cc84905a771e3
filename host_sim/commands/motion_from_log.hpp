// SPDX-License-Identifier: Apache-2.0
#pragma once
/// host_sim motion --from LOG: a motion of another program, read, judged, placed and resampled.

#include <CLI/App.hpp>
#include <optional>
#include <string>

#include "host_sim/motion_log/log_options.hpp"

namespace haptic::sim {

struct LogArguments {
  LogOptions log;
  std::string place, turn;        ///< as the person writes them
  std::string scene, start_at;    ///< compiled scenes
  std::optional<double> rate_hz;  ///< of the motion; nothing: 1000
};

/// Adds --from and what goes with it.
void add_log_options(CLI::App& app, LogArguments& arguments);

/// Writes the motion to `out`, says what it is, and warns on standard error.
int motion_from_log(const LogArguments& arguments, const std::string& out);

}  // namespace haptic::sim
