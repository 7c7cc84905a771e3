// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Words of a bridge about its device: to a person, and as a line of JSON.

#include <string>

#include "hal/bridge/bridged_device.hpp"
#include "tools/bridges/record/replay.hpp"

namespace haptic::tools {

/// @param facts  null: it is not there, and `why` says the reason.
[[nodiscard]] std::string facts_text(const std::string& bridge, const hal::BridgeFacts* facts,
                                     const std::string& why);

/// One line of JSON: {"bridge", "found", "name", "words", "needs", "why", "sensed_dof",
/// "driven_dof", "max_force_n", "max_torque_nm", "max_stiffness_n_per_m", "report_period_us",
/// "product", "serial", "latency_us", "measures"}; numbers of a device that was found alone. Bytes
/// of a device's name that are no UTF-8 are replaced.
[[nodiscard]] std::string facts_line(const std::string& bridge, const hal::BridgeFacts* facts,
                                     const std::string& why);

/// How many poses of a recording were made again, and where the first one differs.
[[nodiscard]] std::string replay_text(const std::string& bridge, const ReplayResult& result);

/// One line of JSON: {"bridge", "poses", "different", "first", "whole"}.
[[nodiscard]] std::string replay_line(const std::string& bridge, const ReplayResult& result);

}  // namespace haptic::tools
